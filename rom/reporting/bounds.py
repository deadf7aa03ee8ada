"""How far error bounds can be trusted: what methods claim beside the true errors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rom.reporting import html, palette, words
from rom.reporting.figure import COLUMN, Figure, number_axis, sheet, ticks_about_one, tidy
from rom.reporting.results import Results


def effectivity(found: Results) -> Figure | None:
    """Bound of the energy error over the true energy error: a row a method, a line a setting."""
    sharpness = Sharpness(found)
    if not sharpness.methods:
        return None
    methods, (low, middle, high) = sharpness.methods, sharpness.values
    known = sharpness.known
    figure = sheet(0.4 * len(methods) + 1.9, _title(low[known], high[known]), COLUMN)
    axes = figure.subplots()
    axes.set_xscale("log")
    points = []
    for row, method in enumerate(reversed(methods)):
        colour, marker = found.style(method)
        entries = [i for i in found.entries(method) if known[i]]
        for k, i in enumerate(entries):
            y = row + 0.6 * ((k + 0.5) / len(entries) - 0.5)
            axes.plot([low[i], high[i]], [y, y], color=colour, linewidth=1.5, solid_capstyle="round")
            axes.plot(middle[i], y, marker=marker, color=colour, markersize=6, markeredgecolor="white")
            points.append((axes, middle[i], y, f"{found.name(i)}: {words.bound(low[i])} to "
                                               f"{words.significant(high[i])}, median {words.significant(middle[i])}"))
    axes.axvline(1.0, color=palette.GATE, linewidth=1.2, linestyle=(0, (6, 3)))
    least, most = min(1.0, low[known].min()), max(1.0, high[known].max())
    room = max((most / least) ** 0.08, 1.02)
    axes.set_xlim(least / room, most * room)
    axes.set_xticks(ticks_about_one(least / room, most * room))
    axes.set_yticks(range(len(methods)), methods[::-1], fontsize=9)
    axes.set_ylim(-0.7, len(methods) - 0.3)
    axes.set_xlabel("bound over true energy error [1]")
    number_axis(axes.xaxis)
    tidy(axes, "x")
    return Figure("effectivity.png", figure,
                  "The bound of the energy error over the true one, from the least to the largest case, the marker at "
                  "the median; a line a setting (named under the pointer). At 1 a bound is sharp; below 1 it is wrong.",
                  "Range of bound over true error for each method and setting that returns a bound.",
                  points=points)


class Sharpness:
    """Least, median and largest ratio of bound to true error of the entries that bound themselves."""

    def __init__(self, found: Results) -> None:
        self.values = np.array([found.per_entry(f"effectivity_{name}") for name in ("min", "median", "max")])
        self.known = np.isfinite(self.values).all(axis=0)
        self.methods = [m for m in found.methods if self.known[found.entries(m)].any()]


def bound_table(found: Results) -> Iterator[str]:
    """How sharp each method's bounds are, at the best and at the worst setting, and whether one was ever broken."""
    sharpness = Sharpness(found)
    if not sharpness.methods:
        return
    low, middle, high = sharpness.values
    rows = []
    for method in sharpness.methods:
        entries = [i for i in found.entries(method) if sharpness.known[i]]
        tight, loose = min(entries, key=lambda i: middle[i]), max(entries, key=lambda i: middle[i])
        least, most = low[entries].min(), high[entries].max()
        rows.append(("", [html.named(method, colour=found.style(method).colour),
                          *(html.cell(words.significant(middle[i]), found.setting(i)) for i in (tight, loose)),
                          html.cell(words.bound(least), kind="" if least >= 1 else "fail"),
                          html.cell(words.significant(most))]))
    yield html.table("Bound over true energy error. Far above 1 the error is mostly so small that the bound is an "
                     "allowance for rounding.", [
                         html.named("method"), html.named("median", "at the sharpest setting"),
                         html.named("median", "at the loosest setting"), html.named("least", "of all cases"),
                         html.named("largest", "of all cases")], rows)


def _title(low: np.ndarray, high: np.ndarray) -> str:
    if low.min() < 1.0:
        return f"The error bound falls below the true error in some case (least ratio {words.bound(low.min())})"
    return f"The error bound is never below the true error, and at most {words.significant(high.max())} times above it"
