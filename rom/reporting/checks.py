"""How far numbers can be trusted: bounds beside true errors, and the spread of the raw timings."""

from __future__ import annotations

import numpy as np

from rom.reporting import palette, words
from rom.reporting.figure import Figure, number_axis, sheet, ticks_about_one, tidy
from rom.reporting.results import Results


def effectivity(found: Results) -> Figure | None:
    """Bound of the energy error over the true energy error, for every entry that bounds itself."""
    low, middle, high = (found.per_entry(f"effectivity_{name}") for name in ("min", "median", "max"))
    rows = [i for i in range(len(low)) if np.isfinite([low[i], middle[i], high[i]]).all()]
    if not rows:
        return None
    figure = sheet(0.3 * len(rows) + 1.9, _effectivity_title(low[rows], middle[rows], high[rows]))
    axes = figure.subplots()
    axes.set_xscale("log")
    y = np.arange(len(rows))[::-1]
    for k, i in zip(y, rows, strict=True):
        colour, marker = palette.style(found.method[i])
        axes.plot([low[i], high[i]], [k, k], color=colour, linewidth=2.2, solid_capstyle="round")
        axes.plot(middle[i], k, marker=marker, color=colour, markersize=8, markeredgecolor="white")
    axes.axvline(1.0, color=palette.GATE, linewidth=1.2, linestyle=(0, (6, 3)))
    least, most = min(1.0, low[rows].min()), max(1.0, high[rows].max())
    span = max((most / least) ** 0.08, 1.02)
    axes.set_xlim(least / span, most * span)
    axes.set_xticks(ticks_about_one(least / span, most * span))
    axes.set_yticks(y, [found.name(i) for i in rows], fontsize=9)
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.set_xlabel("bound over true energy error [1]")
    number_axis(axes.xaxis)
    tidy(axes, "x")
    return Figure("effectivity.png", figure,
                 "Certificates: the guaranteed bound of the energy error over the true one, from the least to the "
                 "largest, the marker at the median. At 1 the bound is sharp; below 1 it would be wrong.",
                 "Range of bound over true error for each setting that returns a bound.")


def timing(found: Results) -> Figure | None:
    """Quartiles of the raw timings of one case, relative to their own median."""
    values = np.asarray(found.data["online_seconds"].transpose("entry", "repeat").values, dtype=float)
    rows = [i for i in map(found.headline, found.methods) if np.isfinite(values[i]).sum() > 1 and found.online[i] > 0]
    if not rows:
        return None
    spread = [values[i][np.isfinite(values[i])] / found.online[i] for i in rows]
    middle_half = [np.subtract(*np.percentile(s, [75, 25])) for s in spread]
    wide = int(np.argmax(middle_half))
    figure = sheet(0.4 * len(rows) + 1.7, "The middle half of the repeats spans at most "
                   f"{words.error(max(middle_half))} of the median (widest: {found.method[rows[wide]]})")
    axes = figure.subplots()
    y = np.arange(len(rows))[::-1]
    for k, i, s in zip(y, rows, spread, strict=True):
        colour = palette.style(found.method[i]).colour
        least, lower, upper, most = np.percentile(s, [5, 25, 75, 95])
        axes.plot([least, most], [k, k], color=colour, linewidth=1.2, marker="|", markersize=8)
        axes.barh(k, upper - lower, left=lower, height=0.5, color=colour, alpha=0.55)
        axes.plot([1, 1], [k - 0.25, k + 0.25], color="black", linewidth=1.4)
    axes.set_xscale("log")
    ends = np.concatenate([np.percentile(s, [5, 95]) for s in spread])
    low, high = min(0.9, ends.min() / 1.03), max(1.1, ends.max() * 1.03)
    axes.set_xlim(low, high)
    axes.set_xticks(ticks_about_one(low, high))
    axes.set_yticks(y, [f"{found.method[i]}, {words.seconds(found.online[i])}" for i in rows], fontsize=9.5)
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.set_xlabel("time of one case over its own median [1]; box: quartiles, whiskers: 5 to 95 %")
    number_axis(axes.xaxis)
    tidy(axes, "x")
    return Figure("timing-spread.png", figure,
                 "Spread of the timings of one case, full field, at the headline settings; beside each name the "
                 "median.",
                 "Box plots of raw timings relative to their median for each method.")


def _effectivity_title(low: np.ndarray, middle: np.ndarray, high: np.ndarray) -> str:
    if low.min() < 1.0:
        return f"The error bound falls below the true error in some case (least ratio {words.significant(low.min())})"
    return (f"The error bound is never below the true error and at most {words.significant(high.max())} times above it "
            f"(medians {words.significant(middle.min())} to {words.significant(middle.max())})")
