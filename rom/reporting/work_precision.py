"""Error against time: every method a curve over its settings, the gate and the mesh's own error drawn in."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rom.reporting import words
from rom.reporting.figure import (
    COLUMN,
    SMALLEST,
    Figure,
    drawable,
    error_panel,
    legend_below,
    mesh_band,
    sheet,
    time_axis,
)
from rom.reporting.results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HIGHEST = 100.0
"""Errors above stand here, so that one hopeless extrapolation does not take the axis from all others."""
Points = list[tuple["Axes", float, float, str]]


def work_precision(found: Results) -> Figure:
    """Online time of one whole answer against the largest held-out error of the first split; beside it the others."""
    return _figure(found, "work-precision.png", [(found.splits[0], "one")], 5.0, "One whole answer",
                   "Each point is a method at one setting (named under the pointer): left is faster, low is more "
                   f"accurate, for the largest error over the held-out cases of the {found.splits[0]} split. A ring "
                   "marks the setting that stands for its method; pale points are beaten by another of its own."
                   + _thin(found))


def work_precision_elsewhere(found: Results) -> Figure | None:
    """The same on the other splits, in a large batch, and where only a part of the answer is wanted."""
    first = found.splits[0]
    panels = [(split, "one") for split in found.splits[1:] if np.isfinite(found.errors(split)).any()]
    panels += [(first, what) for what in ("batch", "part") if np.isfinite(found.seconds(what)).any()]
    if not panels:
        return None
    return _figure(found, "work-precision-elsewhere.png", panels, 1.2 + 3.3 * len(panels), "Elsewhere",
                   "The same diagram for the splits that keep whole parts from training, in a large batch, and for "
                   f"the {found.partial} alone (with the errors of the whole answer). Errors above "
                   f"{words.error(HIGHEST)} stand at that level.")


def _thin(found: Results) -> str:
    others = found.splits[1:]
    return f" The thin line leads to its largest error on the {words.listed(others)} split." if others else ""


def _figure(found: Results, file: str, sets: list[tuple[str, str]], height: float, what: str, caption: str) -> Figure:
    labels = {"one": f"time of one {found.noun}, whole answer", "batch": f"time a {found.noun} in a large batch",
              "part": f"time of one {found.noun}, {found.partial} only"}
    figure = sheet(height, _title(found, what, sets[0][0]), COLUMN)
    panels = list(figure.subplots(len(sets), 1, squeeze=False)[:, 0])
    points: Points = []
    for axes, (split, workload) in zip(panels, sets, strict=True):
        points += _panel(axes, found, workload, split, whiskers=len(sets) == 1)
        axes.set_xlabel(labels[workload])
        axes.set_ylabel(f"largest error, {split} split")
    legend_below(figure, panels, columns=4)
    return Figure(file, figure, caption, f"Scatter of largest held-out error against time for each method: {what}.",
                  points=points)


def _panel(axes: Axes, found: Results, workload: str, split: str, whiskers: bool) -> Points:
    times, exact = found.seconds(workload), found.errors(split)
    lowest = _lowest(found)
    errors = np.clip(drawable(exact), lowest, HIGHEST)
    below = drawable(exact) < lowest
    elsewhere = np.clip(np.max([drawable(found.errors(s)) for s in found.splits], axis=0), lowest, HIGHEST)
    axes.set_xscale("log")
    points: Points = []
    for method in found.methods:
        colour, marker = found.style(method)
        entries = [i for i in found.entries(method) if np.isfinite([times[i], errors[i]]).all() and times[i] > 0]
        front = frontier(times, errors, entries)
        rest = [i for i in entries if i not in front]
        axes.plot(times[rest], errors[rest], marker, color=colour, alpha=0.3, markersize=5, markeredgewidth=0)
        axes.plot(times[front], errors[front], color=colour, marker=marker, markersize=7, linewidth=1.3,
                  markeredgecolor="white", markeredgewidth=0.6, label=method, zorder=3)
        i = found.headline(method)
        if i in entries:
            axes.plot(times[i], errors[i], "o", markerfacecolor="none", markeredgecolor=colour, markersize=13,
                      markeredgewidth=1.2, zorder=3.5)
            if whiskers and elsewhere[i] > errors[i]:
                axes.plot([times[i]] * 2, [errors[i], elsewhere[i]], color=colour, linewidth=0.8, alpha=0.7)
                axes.plot(times[i], elsewhere[i], "_", color=colour, markersize=8)
            if below[i]:
                axes.annotate("", (times[i], 0.1 * lowest), (times[i], lowest), zorder=4,
                              arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 7})
        points += [(axes, times[i], errors[i], f"{found.name(i)}: {words.seconds(times[i])}\n" + ", ".join(
            f"{words.error(found.errors(s)[i])} ({s})" for s in found.splits)) for i in (*rest, *front)]
    known = np.isfinite(times) & (times > 0)
    if known.any():  # at least a decade, so that a lone point does not blow up the ticks
        axes.set_xlim(10 ** (np.log10(times[known].min()) - 0.4), 10 ** (np.log10(times[known].max()) + 0.4))
    error_panel(axes, found.gate)
    mesh_band(axes, found.scalar("mesh_floor_median"), found.scalar("mesh_floor_max"))
    top = np.nanmax(np.append(elsewhere if whiskers else errors, 10 * lowest))
    axes.set_ylim(lowest * 0.08, max(top, found.gate) * 3)
    time_axis(axes.xaxis)
    return points


def _lowest(found: Results) -> float:
    """Where full-order solvers stand whose error is smaller still, a decade below all reduced models."""
    entries = [i for method in found.reduced for i in found.entries(method)]
    errors = np.array([drawable(found.errors(split))[entries] for split in found.splits])
    return max(float(np.nanmin(errors)) / 10, SMALLEST) if np.isfinite(errors).any() else SMALLEST


def frontier(times: np.ndarray, errors: np.ndarray, entries: list[int]) -> list[int]:
    """Entries that no other of ``entries`` beats in both time and error, fastest first."""
    best, chosen = np.inf, []
    for i in sorted(entries, key=lambda k: (times[k], errors[k])):
        if errors[i] < best:
            best = errors[i]
            chosen.append(i)
    return chosen


def _title(found: Results, what: str, split: str) -> str:
    gate, i = words.error(found.gate), found.fastest(found.within(found.gate, [split]), found.online)
    where = f"within {gate} on the {split} split"
    return f"{what}: no reduced model stays {where}" if i is None else (
        f"{what} {where} is cheapest with {found.method[i]}")
