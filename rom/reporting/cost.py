"""What a method costs and saves: preparation, break-even, speed-up, and how near the machine's floor it runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from rom.reporting import palette, words
from rom.reporting.choices import repaid
from rom.reporting.figure import COLUMN, Figure, number_axis, sheet, ticks_about_one, tidy, time_axis
from rom.reporting.results import Results


def offline_cost(found: Results) -> Figure | None:
    """What must be computed before the first answer, snapshots and fit apart."""
    rows = [found.headline(m) for m in found.reduced]
    parts = {"solving what is learned from": found.per_entry("snapshot_seconds")[rows],
             "fit: modes, basis or training": found.per_entry("fit_seconds")[rows]}
    shown = np.array([np.where(values > 0, values, np.nan) for values in parts.values()])
    if not np.isfinite(shown).any():
        return None
    figure = sheet(0.4 * len(rows) + 1.7, _offline_title(found, rows), COLUMN)
    axes = figure.subplots()
    y, colours = np.arange(len(rows))[::-1], [found.style(found.method[i]).colour for i in rows]
    for values, label, shift, alpha in zip(shown, parts, (0.18, -0.18), (0.45, 1.0), strict=True):
        axes.barh(y + shift, values, height=0.34, alpha=alpha, color=colours)
        axes.barh([0], [np.nan], color=palette.QUIET, alpha=alpha, label=label)
    axes.set_xscale("log")
    least, most = np.nanmin(shown) / 3, np.nanmax(shown) * 3
    axes.set_xlim(least, most * (most / least) ** 0.2)
    for k, i, pair in zip(y, rows, shown.T, strict=True):
        text = f"{words.seconds(found.per_entry('offline_seconds')[i])}, {repaid(found, i)}"
        axes.text(1.2 * np.nanmax([least, *pair]), k, text, va="center", fontsize=8.5)
    axes.set_yticks(y, found.reduced, fontsize=9)
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set_xlabel("time before the first answer")
    axes.legend(fontsize=8.5, frameon=False, loc="lower left", bbox_to_anchor=(-0.2, 1.0), ncols=2)
    time_axis(axes.xaxis)
    tidy(axes, "x")
    return Figure("offline-cost.png", figure,
                  "What must be computed before the first answer; the parts stand one under the other, since the axis "
                  f"is logarithmic. Written: the total, and the single {found.noun}s after which it is repaid against "
                  f"{found.method[found.baseline()]}, the fastest full-order method.",
                  "Bars of offline time for each method, with the answers after which it pays back.")


def speed(found: Results) -> Figure | None:
    """Speed-up of each method's headline over the fastest full-order method for the same workload."""
    methods = found.reduced
    if not methods:
        return None
    rows = [found.headline(m) for m in methods]
    figure = sheet(0.74 * len(rows) + 1.9, _speed_title(found, rows), COLUMN)
    axes = figure.subplots()
    y = np.arange(len(rows))[::-1].astype(float)
    sets = (("one", f"one {found.noun}", 0.26, 1.0, "", "floor_seconds"),
            ("batch", "in a large batch", 0.0, 0.6, "", "batch_floor_seconds"),
            ("part", f"{found.partial} only", -0.26, 0.3, "///", ""))
    ratios = {what: found.speedup(what) for what, *_ in sets}
    known = np.concatenate([one[rows] for one in ratios.values()])
    known = known[np.isfinite(known) & (known > 0)]
    least, most = (known.min(), known.max()) if len(known) else (1.0, 1.0)
    start = min(0.5, 0.5 * least)
    axes.set_xscale("log")
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set_xlim(start, max(20.0, most * (most / start) ** 0.5))
    for what, label, shift, alpha, hatch, floor in sets:
        over = found.seconds(what) / np.where(found.per_entry(floor) > 0, found.per_entry(floor), np.nan)
        bars: dict[str, Any] = {"height": 0.24, "alpha": alpha, "hatch": hatch, "edgecolor": "white", "linewidth": 0}
        axes.barh(y + shift, ratios[what][rows], color=[found.style(m).colour for m in methods], **bars)
        axes.barh([0], [np.nan], color=palette.QUIET, label=label, **bars)
        for k, i in zip(y, rows, strict=True):
            if np.isfinite(ratios[what][i]):
                near = f"  ({words.significant(over[i], 2)} × the floor)" if np.isfinite(over[i]) else ""
                axes.text(1.08 * ratios[what][i], k + shift, words.ratio(ratios[what][i]) + near, va="center",
                          fontsize=8)
    axes.axvline(1.0, color="black", linewidth=1.0, linestyle=":")
    errors = [words.error(found.errors(found.splits[0])[i]) for i in rows]
    axes.set_yticks(y, [f"{m}\n{error} error" for m, error in zip(methods, errors, strict=True)], fontsize=8.5)
    axes.set_xlabel("times faster than the fastest full-order method doing the same", fontsize=9)
    axes.legend(fontsize=8.5, frameon=False, loc="lower left", bbox_to_anchor=(-0.2, 1.0), ncols=3)
    number_axis(axes.xaxis)
    tidy(axes, "x")
    return Figure("speed-up.png", figure,
                  "Speed-up at the settings that stand for their methods, over "
                  + words.listed([f"{found.method[found.baseline(w)]} ({label})" for w, label, *_ in sets])
                  + f"; under each name its largest error on the {found.splits[0]} split. The machine's floor: for one "
                  "case the time to read once from memory what the answer is made of, for a batch the matrix product "
                  "alone.",
                  "Bars of speed-up over the fastest full-order method for one case, a batch and a part of the answer.")


def timing(found: Results) -> Figure | None:
    """Quartiles of the raw timings of one case, relative to their own median."""
    values = np.asarray(found.data["online_seconds"].transpose("entry", "repeat").values, dtype=float)
    rows = [i for i in map(found.headline, found.methods) if np.isfinite(values[i]).sum() > 1 and found.online[i] > 0]
    if not rows:
        return None
    quantile = np.array([np.percentile(values[i][np.isfinite(values[i])], [5, 25, 75, 95]) / found.online[i]
                         for i in rows])
    half = quantile[:, 2] - quantile[:, 1]
    figure = sheet(0.36 * len(rows) + 1.7, f"The middle half of the repeats spans at most {words.error(half.max())} of "
                   f"the median ({found.method[rows[int(half.argmax())]]})", COLUMN)
    axes = figure.subplots()
    y, colours = np.arange(len(rows))[::-1], [found.style(found.method[i]).colour for i in rows]
    axes.barh(y, half, left=quantile[:, 1], height=0.5, color=colours, alpha=0.55)
    axes.hlines(y, quantile[:, 0], quantile[:, 3], colors=colours, linewidth=1.2)
    axes.vlines(np.ones(len(rows)), y - 0.25, y + 0.25, colors="black", linewidth=1.4)
    axes.set_yticks(y, [f"{found.method[i]}, {words.seconds(found.online[i])}" for i in rows], fontsize=9)
    axes.set_xscale("log")
    axes.set_xlim(min(0.9, quantile.min() / 1.03), max(1.1, quantile.max() * 1.03))
    axes.set_xticks(ticks_about_one(*axes.get_xlim()))
    axes.set_xlabel(f"time of one {found.noun} over its own median")
    number_axis(axes.xaxis)
    tidy(axes, "x")
    return Figure("timing-spread.png", figure,
                  "Spread of the timings of one case, whole answer, at the settings that stand for their methods; "
                  "beside each name the median. Box: quartiles; line: 5 to 95 %.",
                  "Box plots of raw timings relative to their median for each method.")


def _offline_title(found: Results, rows: list[int]) -> str:
    cost, errors = found.per_entry("offline_seconds"), found.errors(found.splits[0])
    known = [i for i in rows if np.isfinite(cost[i])]
    good = [i for i in known if errors[i] <= found.gate]
    if not good:
        return f"Preparation takes up to {words.seconds(max(cost[known]))}"
    i, dear = min(good, key=lambda k: cost[k]), max(known, key=lambda k: cost[k])
    text = f"Cheapest preparation within {words.error(found.gate)}: {found.method[i]}, {words.seconds(cost[i])}"
    return text if i == dear else f"{text}; dearest of all: {found.method[dear]}, {words.seconds(cost[dear])}"


def _speed_title(found: Results, rows: list[int]) -> str:
    errors, ratio = found.errors(found.splits[0]), found.speedup()
    good = [i for i in rows if errors[i] <= found.gate and np.isfinite(ratio[i])]
    where = f"within {words.error(found.gate)} ({found.splits[0]} split)"
    if not good:
        return f"No method at its usual setting stays {where}, whatever its speed"
    i = max(good, key=lambda k: ratio[k])
    return (f"Fastest {where}: {found.method[i]}, {words.ratio(ratio[i])} faster than "
            f"{found.method[found.baseline()]} for one {found.noun}")
