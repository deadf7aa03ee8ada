"""Worst held-out cases in space: truth beside answer beside difference, on a surface or in a plane section."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

from rom.reporting import words
from rom.reporting.cases import case_words, worst_case
from rom.reporting.figure import COLUMN, Figure, sheet
from rom.reporting.results import Results
from rom.reporting.skin import draw_skin

MILLIMETRE = 1e3
SHOWN = 4
DRAWN_AS = 0.06
"""Length to which the largest displacement of a surface is drawn, over the surface's size."""


def worst_fields(found: Results) -> Figure | None:
    """Displacement magnitude in the worst held-out case of some methods; None where no mesh to draw it on is stored."""
    name = next((str(name) for name, one in found.data.data_vars.items() if str(name).startswith("worst_")
                 and str(name).endswith("_truth") and {"worst", "component"} < set(one.dims)), "")
    node = next((str(dim) for dim in found.data[name].dims if dim not in ("worst", "component")), "") if name else ""
    mesh = node.removesuffix("_node")
    rows = [pair for pair in found.worst if np.isfinite(found.data[name.replace("truth", "answer")].transpose(
        "worst", ...).values[pair[0]]).all()] if f"{mesh}_quads" in found.data else []
    if not rows:
        return None
    rows = [rows[k] for k in np.unique(np.linspace(0, len(rows) - 1, min(SHOWN, len(rows))).round().astype(int))]
    position = MILLIMETRE * np.column_stack([found.data[f"{mesh}_{axis}"].values for axis in "xyz"
                                             if f"{mesh}_{axis}" in found.data.variables])
    quads = found.data[f"{mesh}_quads"].transpose(f"{mesh}_quad", "corner").values.astype(int)
    figure = sheet((1.6 if position.shape[1] == 3 else 2.2) * len(rows) + 0.5, _title(found, rows), COLUMN)
    for band, (row, entry) in zip(np.ravel(np.asarray(figure.subfigures(len(rows), 1))), rows, strict=True):
        truth, answer = (found.data[one].transpose("worst", node, "component").values[row]
                         for one in (name, name.replace("truth", "answer")))
        _strip(band, {found.truth: truth, found.method[entry]: answer, "difference": answer - truth}, position, quads,
               _loads(found, entry, node))
        told = ", ".join(part for part in (f"{found.name(entry)}: {words.error(_error(found, row, entry))} off",
                                           case_words(found, entry)) if part)
        band.suptitle(textwrap.fill(told, 88), fontsize=9, x=0.01, ha="left")
    return Figure("worst-fields.png", figure,
                  f"The worst held-out case of some methods on the {found.splits[0]} split, drawn on the deformed "
                  "shape. Truth and answer share one colour scale; the difference has its own and stands on the shape "
                  "at rest. Black dots mark loads.",
                  "Maps of displacement magnitude in the worst cases: truth, answer and difference for some methods.")


def snapshot(truth: np.ndarray, answer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Real displacements at the instant at which the truth is largest.

    Parameters
    ----------
    truth, answer : (n, 3) ndarray [m], real or complex
        A complex amplitude u stands for Re(u exp(i omega t)).
    """
    if not np.iscomplexobj(truth) and not np.iscomplexobj(answer):
        return truth, answer
    turn = np.exp(-0.5j * np.angle(np.sum(truth ** 2)))
    return (truth * turn).real, (answer * turn).real


def _strip(band: Any, shown: dict[str, np.ndarray], position: np.ndarray, quads: np.ndarray, loads: np.ndarray) -> None:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize, PowerNorm

    solid = position.shape[1] == 3
    size = {name: magnitude(field) for name, field in shown.items()}
    truth, answer, missed = (max(one.max(), np.finfo(float).tiny) for one in size.values())
    moved: tuple[Any, ...] = (*snapshot(*list(shown.values())[:2]), 0.0)
    reach = DRAWN_AS * np.ptp(position, axis=0).max()
    scale = reach / truth if solid else MILLIMETRE  # a section's displacements are large enough as they are
    common: Any = PowerNorm(0.5, 0.0, max(truth, min(answer, 1.5 * truth))) if solid else Normalize(0.0, truth)
    grid = band.add_gridspec(1, 5, width_ratios=(0.035, 1, 1, 1, 0.035))
    norms: tuple[Any, ...] = (common, common, Normalize(0.0, missed))
    for column, ((name, values), move, norm) in enumerate(zip(size.items(), moved, norms, strict=True), start=1):
        shape = position + np.clip(scale * move, -2 * reach, 2 * reach)
        colours = colormaps["magma_r" if column == 3 else "viridis"](norm(values[quads].mean(axis=1)))
        if solid:
            panel = band.add_subplot(grid[column], projection="3d")
            draw_skin(panel, shape, quads, colours, marks=loads)
        else:
            panel = band.add_subplot(grid[column])
            _draw_section(panel, shape, quads, colours)
        panel.set_title(name, fontsize=9, y=0.95 if solid else None)
    for column, norm, name, label in ((0, common, "viridis", "|u|"), (4, norms[2], "magma_r", "|difference|")):
        most, left = float(norm.vmax), column == 0
        bar = band.colorbar(ScalarMappable(norm, name), cax=band.add_subplot(grid[column]))
        bar.ax.yaxis.set_ticks_position("left" if left else "right")
        bar.ax.yaxis.set_label_position("left" if left else "right")
        unit, factor = length_unit(most)
        bar.set_label(f"{label} [{unit}]", fontsize=8)
        ticks = most * np.array([0, 0.1, 0.3, 0.6, 1.0] if left and solid else [0, 0.25, 0.5, 0.75, 1.0])
        say = words.power if unit == "m" else words.significant
        bar.set_ticks(list(ticks), labels=[say(t * factor, 2) if t > 0 else "0" for t in ticks], fontsize=7.5)


def _draw_section(axes: Any, shape: np.ndarray, quads: np.ndarray, colours: np.ndarray) -> None:
    from matplotlib.collections import PolyCollection

    axes.add_collection(PolyCollection(list(shape[quads]), facecolors=colours, edgecolors=colours, linewidths=0.2))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()


def magnitude(field: np.ndarray) -> np.ndarray:
    """(n,) ndarray [m]: length of the displacement, or of its complex amplitude, at each node."""
    return np.sqrt((np.abs(field) ** 2).sum(axis=1))


def length_unit(largest: float) -> tuple[str, float]:
    """The unit in which a length [m] reads well, and the factor from metre to it."""
    for unit, factor in (("mm", 1e3), ("µm", 1e6), ("nm", 1e9), ("pm", 1e12)):
        if largest * factor >= 0.5:
            return unit, factor
    return "m", 1.0


def _loads(found: Results, entry: int, node: str) -> np.ndarray:
    """Rows along the drawn nodes at which the loads of an entry's worst case act."""
    case = worst_case(found, entry)
    if case is None or "load_node" not in found.data.variables:
        return np.zeros(0, dtype=int)
    loads = np.ravel(found.data["load_node"].isel(case=case).values)
    ids = found.data[node].values if node in found.data.coords else np.arange(found.data.sizes[node])
    return np.flatnonzero(np.isin(ids, loads[loads >= 0]))


def _error(found: Results, row: int, entry: int) -> float:
    return float(found.data["worst_error"].values[row]) if "worst_error" in found.data else (
        found.errors(found.splits[0])[entry])


def _title(found: Results, rows: list[tuple[int, int]]) -> str:
    (first, best), (last, worst) = rows[0], rows[-1]
    if best == worst:
        return f"The worst held-out case of {found.method[best]}: {words.error(_error(found, first, best))} off"
    return (f"Worst held-out cases, from {found.method[best]} ({words.error(_error(found, first, best))} off) to "
            f"{found.method[worst]} ({words.error(_error(found, last, worst))} off)")
