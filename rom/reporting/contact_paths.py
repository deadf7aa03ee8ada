"""The worst held-out paths of the contact scene: forces and areas, true and predicted, and the displacement."""

from __future__ import annotations

from typing import Any

import numpy as np

from rom.reporting import palette, words
from rom.reporting.fields import length_unit
from rom.reporting.figure import Figure, legend_below, sheet, tidy
from rom.reporting.results import SOLVERS, Results

MOST = 6


def worst_paths(found: Results) -> Figure | None:
    """Tangential force and contact area along each method's worst path."""
    if "worst_force_truth" not in found.data:
        return None
    rows = _rows(found)
    travel = found.data["travel"].values.astype(float) * 1e3
    sliding = np.flatnonzero(travel > 0)
    sliding = np.concatenate([[sliding[0] - 1], sliding]) if len(sliding) else np.arange(len(travel))
    figure = sheet(5.4, _curve_title(found, rows), width=max(10.0, 2.6 * len(rows)))
    grid = figure.subplots(2, len(rows), sharex=True, sharey="row", squeeze=False)
    for column, (row, entry) in enumerate(rows):
        colour, marker = palette.style(found.method[entry])
        for axes, name, factor in ((grid[0][column], "force", 1.0), (grid[1][column], "area", 1e6)):
            truth = found.data[f"worst_{name}_truth"].transpose("worst", "position").values[row] * factor
            answer = found.data[f"worst_{name}_answer"].transpose("worst", "position").values[row] * factor
            axes.plot(travel[sliding], truth[sliding], color="black", linewidth=1.6, label="direct")
            axes.plot(travel[sliding], answer[sliding], color=colour, marker=marker, markersize=4, linewidth=1.0,
                      label=found.method[entry])
            tidy(axes)
        grid[0][column].set_title(f"{found.method[entry]}\n{_path_words(found, entry)}", fontsize=8.5)
        grid[1][column].set_xlabel("travel [mm]")
    grid[0][0].set_ylabel("tangential force [N]")
    grid[1][0].set_ylabel("contact area [mm²]")
    legend_below(figure, list(grid.ravel()))
    return Figure("worst-paths.png", figure,
                 "Each method's worst held-out path by displacement (published split): tangential force and contact "
                 "area while the plate moves along, full model in black.",
                 "Tangential force and contact area over travel, full-order model and metamodel, on the worst paths.")


def worst_sections(found: Results) -> Figure | None:
    """The section at each method's worst held-out state: truth, answer, difference."""
    if "worst_section_truth" not in found.data:
        return None
    from matplotlib.collections import PolyCollection

    rows = _rows(found)
    position = np.column_stack([found.data["section_x"].values, found.data["section_y"].values]) * 1e3
    quads = found.data["section_quads"].values.astype(int)
    figure = sheet(2.7 * len(rows) + 0.7, _section_title(found, rows))
    for (row, entry), band in zip(rows, np.ravel(np.asarray(figure.subfigures(len(rows), 1))), strict=True):
        truth, answer = (found.data[f"worst_section_{name}"].transpose("worst", "section_node", "component").values[row]
                         for name in ("truth", "answer"))
        panels = band.subplots(1, 3)
        largest = np.linalg.norm(truth, axis=1).max()
        missed = max(np.linalg.norm(answer - truth, axis=1).max(), np.finfo(float).tiny)
        for axes, what, field, shown, top, colours in (
                (panels[0], "direct", truth, truth, largest, "viridis"),
                (panels[1], found.method[entry], answer, answer, largest, "viridis"),
                (panels[2], "difference", answer - truth, np.zeros_like(truth), missed, "magma_r")):
            unit, factor = length_unit(top)
            size = np.linalg.norm(field, axis=1) * factor
            shape = position + shown * 1e3
            drawn = PolyCollection(list(shape[quads]), array=size[quads].mean(axis=1), cmap=colours,
                                   clim=(0, top * factor), edgecolors="face", linewidths=0.2)
            axes.add_collection(drawn)
            axes.set_aspect("equal")
            axes.autoscale_view()
            axes.set_axis_off()
            axes.set_title(what, fontsize=10)
            bar = band.colorbar(drawn, ax=axes, shrink=0.8)
            bar.set_label(f"|u| [{unit}]" if what != "difference" else f"|difference| [{unit}]", fontsize=8)
            bar.ax.tick_params(labelsize=8)
        error = float(found.data["worst_error"].values[row])
        band.suptitle(f"{found.name(entry)}: {words.error(error)} off, {_path_words(found, entry, ', ')}, "
                      f"{_where(found, row)}", fontsize=10, x=0.01, ha="left")
    return Figure("worst-sections.png", figure,
                 "Displacement of the section at each method's worst held-out state (published split), drawn on the "
                 "deformed shape; the difference stands on the undeformed one, with a scale of its own.",
                 "Maps of displacement magnitude of the full model, the metamodel and their difference in the section.")


def _rows(found: Results) -> list[tuple[int, int]]:
    """Rows of ``worst`` and entries of the headline methods to show, the most accurate first."""
    labels = [str(name) for name in found.data["worst"].values]
    errors = found.data["worst_error"].values
    entries = [found.label(i) for i in range(len(found.method))]
    rows = [(row, entries.index(label)) for row, label in enumerate(labels)]
    rows = [(row, entry) for row, entry in rows if found.method[entry] not in SOLVERS and np.isfinite(errors[row])]
    return sorted(rows, key=lambda pair: errors[pair[0]])[:MOST]


def _case(found: Results, entry: int) -> int:
    case = found.data["worst_case"].transpose("entry", "split").values[entry, 0]
    return int(np.flatnonzero(found.data["case"].values == case)[0])


def _path_words(found: Results, entry: int, separator: str = "\n") -> str:
    case = _case(found, entry)

    def value(name: str) -> Any:
        return found.data[name].values[case]

    return (f"{value('variant')} fibres, c {value('c') / 1e3:.2g} kPa{separator}"
            f"friction {value('friction'):.2g}, {value('normal_force'):.2g} N")


def _where(found: Results, row: int) -> str:
    at = int(found.data["worst_position"].values[row])
    travel = float(found.data["travel"].values[at]) * 1e3
    share = float(found.data["force_share"].values[at])
    return f"{travel:.3g} mm along" if travel > 0 else f"at {share:.2g} of the force"


def _curve_title(found: Results, rows: list[tuple[int, int]]) -> str:
    if not rows:
        return "Worst held-out paths"
    row, best = rows[0]
    if found.data["worst_error"].values[row] <= found.gate:
        return f"Even on its worst path {found.method[best]} follows the full model to {_error(found, row)}"
    return (f"No method follows the full model within {words.error(found.gate)} on its worst path; nearest: "
            f"{found.method[best]}, {_error(found, row)}")


def _section_title(found: Results, rows: list[tuple[int, int]]) -> str:
    if not rows:
        return "Worst held-out states"
    first, last = rows[0], rows[-1]
    return (f"Worst held-out states, from {found.method[first[1]]} ({_error(found, first[0])} off) to "
            f"{found.method[last[1]]} ({_error(found, last[0])} off)")


def _error(found: Results, row: int) -> str:
    return words.error(float(found.data["worst_error"].values[row]))
