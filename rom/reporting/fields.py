"""Worst held-out cases in space: the skin, coloured by displacement, truth beside answer beside difference."""

from __future__ import annotations

from typing import Any

import numpy as np

from rom.reporting import words
from rom.reporting.figure import Figure, sheet
from rom.reporting.results import SOLVERS, Results
from rom.reporting.skin import draw_skin

MILLIMETRE = 1e3
SHOWN = 4
DRAWN_AS = 1.6
"""Length [mm] to which the largest displacement is drawn."""


def worst_fields(found: Results) -> Figure | None:
    """Displacement magnitude on the skin in the worst held-out case of a few methods."""
    if not {"worst_truth", "worst_answer", "skin_quads", "skin_x"} <= set(map(str, found.data.variables)):
        return None
    rows = chosen(found)
    if not rows:
        return None
    figure = sheet(2.15 * len(rows) + 0.6, _title(found, rows))
    position = np.column_stack([found.data[f"skin_{axis}"].values for axis in "xyz"]) * MILLIMETRE
    quads = found.data["skin_quads"].transpose("skin_quad", "corner").values.astype(int)
    bands = figure.subfigures(len(rows), 1, squeeze=False)[:, 0]
    for band, (row, entry) in zip(bands, rows, strict=True):
        _strip(band, found, row, entry, position, quads)
    return Figure("worst-fields.png", figure,
                 f"The worst held-out case of some methods on the {found.splits[0]} split, seen from the pad's side. "
                 f"Shapes are scaled so that the truth's largest displacement is drawn as {DRAWN_AS:g} mm. Truth and "
                 "answer share one colour scale, whose steps are finer for small displacements; the difference has "
                 "its own. Black dots mark the loads.",
                 "Fingertip skin coloured by displacement magnitude: truth, answer and difference for some methods.")


def chosen(found: Results) -> list[tuple[int, int]]:
    """(row along ``worst``, entry) of at most four methods from the least to the largest worst error."""
    labels = [str(label) for label in found.data["worst"].values]
    position = {found.label(i): i for i in range(len(found.method))}
    errors = found.errors(found.splits[0])
    rows = [(k, position[label]) for k, label in enumerate(labels) if label in position
            and found.method[position[label]] not in SOLVERS and np.isfinite(errors[position[label]])
            and np.isfinite(found.data["worst_answer"].values[k]).all()]
    rows.sort(key=lambda pair: errors[pair[1]])
    picks = sorted(set(np.linspace(0, len(rows) - 1, min(SHOWN, len(rows))).round().astype(int))) if rows else []
    return [rows[p] for p in picks]


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


def _strip(band: Any, found: Results, row: int, entry: int, position: np.ndarray, quads: np.ndarray) -> None:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize, PowerNorm

    truth, answer = (found.data[name].transpose("worst", "skin_node", "component").values[row]
                     for name in ("worst_truth", "worst_answer"))
    size = {"truth": magnitude(truth), found.method[entry]: magnitude(answer), "difference": magnitude(answer - truth)}
    moved = dict(zip(size, (*snapshot(truth, answer), np.zeros(truth.shape)), strict=True))
    largest = max(size["truth"].max(), np.finfo(float).tiny)
    common = PowerNorm(0.5, vmin=0.0, vmax=max(largest, min(size[found.method[entry]].max(), 1.5 * largest)))
    own = Normalize(vmin=0.0, vmax=max(size["difference"].max(), np.finfo(float).tiny))
    loads = load_points(found, row, entry)
    grid = band.add_gridspec(1, 5, width_ratios=(0.035, 1, 1, 1, 0.035))
    for column, (name, values) in enumerate(size.items(), start=1):
        panel = band.add_subplot(grid[column], projection="3d")
        norm, colour = (own, colormaps["magma_r"]) if name == "difference" else (common, colormaps["viridis"])
        shape = position + np.clip(moved[name] * DRAWN_AS / largest, -2 * DRAWN_AS, 2 * DRAWN_AS)
        draw_skin(panel, shape, quads, colour(norm(values[quads].mean(axis=1))), marks=loads)
        panel.set_title(name, fontsize=10, y=0.95)
    for column, norm, colours, label in ((0, common, "viridis", "|u|"), (4, own, "magma_r", "|difference|")):
        most = float(norm.vmax or 0.0)
        bar = band.colorbar(ScalarMappable(norm, colours), cax=band.add_subplot(grid[column]))
        bar.ax.yaxis.set_ticks_position("left" if column == 0 else "right")
        bar.ax.yaxis.set_label_position("left" if column == 0 else "right")
        unit, factor = length_unit(most)
        bar.set_label(f"{label} [{unit}]", fontsize=9)
        ticks = most * np.array([0, 0.1, 0.3, 0.6, 1.0] if column == 0 else [0, 0.25, 0.5, 0.75, 1.0])
        text = words.power if unit == "m" else words.significant
        bar.set_ticks(list(ticks), labels=[text(t * factor, 2) if t > 0 else "0" for t in ticks], fontsize=8)
    band.suptitle(_case_title(found, row, entry), fontsize=10.5, x=0.01, ha="left")


def magnitude(field: np.ndarray) -> np.ndarray:
    """(n,) ndarray [m]: length of the displacement, or of its complex amplitude, at each node."""
    return np.sqrt((np.abs(field) ** 2).sum(axis=1))


def length_unit(largest: float) -> tuple[str, float]:
    """The unit in which a length [m] reads well, and the factor from metre to it."""
    for unit, factor in (("mm", 1e3), ("µm", 1e6), ("nm", 1e9), ("pm", 1e12)):
        if largest * factor >= 0.5:
            return unit, factor
    return "m", 1.0


def load_points(found: Results, row: int, entry: int) -> np.ndarray:
    """Rows of the loaded nodes along ``skin_node``."""
    loads = _case_values(found, entry, "load_node")
    if loads is None and "worst_load_node" in found.data.variables:
        loads = np.ravel(found.data["worst_load_node"].transpose("worst", ...).values[row])
    if loads is None:
        return np.zeros(0, dtype=int)
    loads = loads[loads >= 0].astype(int)
    count = found.data.sizes["skin_node"]
    ids = found.data["skin_node"].values if "skin_node" in found.data.coords else np.arange(count)
    return np.flatnonzero(np.isin(ids, loads))


def _case_values(found: Results, entry: int, name: str) -> np.ndarray | None:
    """Values of the worst case of an entry on the first split; None where the file does not name it."""
    if "worst_case" not in found.data or name not in found.data.variables or "case" not in found.data.coords:
        return None
    case = found.data["worst_case"].transpose("entry", "split").values[entry, 0]
    rows = np.flatnonzero(found.data["case"].values == case)
    return np.ravel(found.data[name].transpose("case", ...).values[rows[0]]) if len(rows) else None


def _case_title(found: Results, row: int, entry: int) -> str:
    error = float(found.data["worst_error"].values[row]) if "worst_error" in found.data else (
        found.errors(found.splits[0])[entry])
    parts = [f"{found.name(entry)}: {words.error(error)} off"]
    nodes = _case_values(found, entry, "load_node")
    if nodes is not None:
        nodes = nodes[nodes >= 0]
        parts.append(f"load{'s' if len(nodes) > 1 else ''} at node{'s' if len(nodes) > 1 else ''} "
                     f"{words.listed([str(int(n)) for n in nodes])}")
    if found.harmonic:
        for name, form in (("frequency", words.frequency), ("loss_factor", lambda v: f"loss factor {v:g}")):
            value = _case_values(found, entry, name)
            if value is not None:
                parts.append(form(float(value[0])))
    return ", ".join(parts)


def _title(found: Results, rows: list[tuple[int, int]]) -> str:
    errors = found.errors(found.splits[0])
    best, worst = rows[0][1], rows[-1][1]
    if best == worst:
        return f"The worst held-out case of {found.method[best]}: {words.error(errors[best])} off"
    return (f"Worst held-out cases: {found.method[best]} cannot be told from the truth ({words.error(errors[best])}), "
            f"{found.method[worst]} is {words.error(errors[worst])} off" if errors[best] < 1e-2 else
            f"Worst held-out cases, from {found.method[best]} ({words.error(errors[best])} off) to "
            f"{found.method[worst]} ({words.error(errors[worst])} off)")
