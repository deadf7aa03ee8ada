"""Error against time: every method a curve over its settings, the gate and the mesh's own error drawn in."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rom.reporting import palette, words
from rom.reporting.figure import (
    SMALLEST,
    Figure,
    drawable,
    error_axis,
    gate_line,
    legend_below,
    mesh_band,
    sheet,
    tidy,
    time_axis,
)
from rom.reporting.results import DIRECT, SOLVERS, Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HIGHEST = 100.0
"""Errors above stand here, so that one hopeless extrapolation does not take the axis from all others."""


def work_precision(found: Results) -> Figure:
    """Online time of one case, full field, against the largest held-out error; a panel a split."""
    figure = sheet(6.4, _title(found, "One full field", found.online))
    panels = list(figure.subplots(1, len(found.splits), sharey=True, squeeze=False)[0])
    lowest = _lowest(found, found.splits)
    for axes, split in zip(panels, found.splits, strict=True):
        _panel(axes, found, found.online, found.errors(split), lowest)
        axes.set_title(f"{split} split", fontsize=11)
        axes.set_xlabel("online time of one case, full field [s]")
    panels[0].set_ylabel("largest relative error, held-out cases [1]")
    legend_below(figure, panels)
    return Figure("work-precision.png", figure,
                 "Work-precision diagram. Each point is a method at one setting; filled points joined by a line are "
                 "its best trade-offs, pale ones are settings that another of its own beats, a ring marks the headline "
                 "setting. Left is faster, low is more accurate. Errors are over all degrees of freedom, the largest "
                 "over the held-out cases. A solver of the full model with an arrow is more accurate than drawn; "
                 "errors above 10,000 % stand at that level.",
                 "Scatter of largest held-out error against online time for each method, one panel for each split.")


def work_precision_elsewhere(found: Results) -> Figure | None:
    """The same in a large batch and where only a part of the answer is wanted, published split."""
    split = found.splits[0]
    sets = [("batch_seconds", "time a case in a large batch, full field [s]", "large batch, full field"),
            ("output_seconds", f"online time of one case, {found.partial} only [s]", f"one case, {found.partial} only")]
    sets = [s for s in sets if np.isfinite(found.per_entry(s[0])).any()]
    if not sets:
        return None
    name = sets[0][0]
    what = "A full field in a large batch" if name == "batch_seconds" else f"The {found.partial} alone"
    figure = sheet(5.4, _title(found, what, found.per_entry(name)))
    panels = list(figure.subplots(1, len(sets), sharey=True, squeeze=False)[0])
    for axes, (variable, label, what) in zip(panels, sets, strict=True):
        _panel(axes, found, found.per_entry(variable), found.errors(split), _lowest(found, [split]))
        axes.set_title(f"{what}, {split} split", fontsize=11)
        axes.set_xlabel(label)
    panels[0].set_ylabel("largest relative error, held-out cases [1]")
    legend_below(figure, panels)
    return Figure("work-precision-batch-pad.png", figure,
                 "The same diagram where many cases are wanted at once, and for the "
                 f"{found.partial} of one case alone. Errors are those of the full field on the {split} split.",
                 "Scatter of largest held-out error against time a case in a batch and for a part of the answer.")


def _panel(axes: Axes, found: Results, times: np.ndarray, errors: np.ndarray, lowest: float) -> None:
    errors = drawable(errors)
    below = np.isfinite(errors) & (errors < lowest)
    errors = np.minimum(np.where(below, lowest, errors), HIGHEST)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for method in found.methods:
        colour, marker = palette.style(method)
        entries = [i for i in found.entries(method) if np.isfinite([times[i], errors[i]]).all() and times[i] > 0]
        front = frontier(times, errors, entries)
        rest = [i for i in entries if i not in front]
        axes.plot(times[rest], errors[rest], marker, color=colour, alpha=0.3, markersize=5, markeredgewidth=0)
        axes.plot(times[front], errors[front], color=colour, marker=marker, markersize=7, linewidth=1.3,
                  markeredgecolor="white", markeredgewidth=0.6, label=method, zorder=3)
        i = found.headline(method)
        if i in entries:
            axes.plot(times[i], errors[i], "o", markerfacecolor="none", markeredgecolor=colour, markersize=14,
                      markeredgewidth=1.3, zorder=3.5)
            if below[i]:
                axes.annotate("", (times[i], 0.1 * lowest), (times[i], lowest), zorder=4,
                              arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 7})
    gate_line(axes, found.gate)
    mesh_band(axes, found.scalar("mesh_floor_median"), found.scalar("mesh_floor_max"))
    if np.isfinite(times[found.direct]):
        axes.axvline(times[found.direct], color=palette.style(DIRECT).colour, linewidth=1.0, linestyle=":",
                     label=f"time of {DIRECT}")
    _room(axes, times, errors, lowest)
    time_axis(axes.xaxis)
    error_axis(axes.yaxis)
    axes.tick_params(labelsize=9)
    tidy(axes)


def _lowest(found: Results, splits: list[str]) -> float:
    """Where full-order solvers stand whose error is smaller still, a decade below all reduced models."""
    reduced = [e for split in splits for e, method in zip(drawable(found.errors(split)), found.method, strict=True)
               if method not in SOLVERS and np.isfinite(e)]
    return max(min(reduced) / 10, SMALLEST) if reduced else SMALLEST


def _room(axes: Axes, times: np.ndarray, errors: np.ndarray, lowest: float) -> None:
    """At least one decade each way, so that a lone point does not blow up the ticks."""
    times = times[np.isfinite(times) & (times > 0)]
    if len(times):
        axes.set_xlim(10 ** (np.log10(times.min()) - 0.5), 10 ** (np.log10(times.max()) + 0.5))
    highest = max(np.nanmax(errors), axes.get_ylim()[1], 10 * lowest) if np.isfinite(errors).any() else 1.0
    axes.set_ylim(lowest * 0.08, highest * 1.5)


def frontier(times: np.ndarray, errors: np.ndarray, entries: list[int]) -> list[int]:
    """Entries that no other of ``entries`` beats in both time and error, fastest first."""
    best, chosen = np.inf, []
    for i in sorted(entries, key=lambda k: (times[k], errors[k])):
        if errors[i] < best:
            best = errors[i]
            chosen.append(i)
    return chosen


def _title(found: Results, what: str, times: np.ndarray) -> str:
    split, gate = found.splits[0], words.error(found.gate)
    entries = [i for i in found.passing([split]) if np.isfinite(times[i])]
    if not entries:
        return f"{what}: no method stays within {gate} on the {split} split"
    i = min(entries, key=lambda k: times[k])
    ratio = times[found.direct] / times[i]
    speed = f", {words.ratio(ratio)} faster than {DIRECT}" if np.isfinite(ratio) and ratio >= 1 else ""
    return f"{what} within {gate} on the {split} split is cheapest with {found.name(i)}{speed}"
