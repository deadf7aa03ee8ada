"""What a method costs and saves: preparation, break-even, speed-up, and how near the machine's floor it runs."""

from __future__ import annotations

import numpy as np

from rom.reporting import palette, words
from rom.reporting.figure import Figure, number_axis, sheet, tidy, time_axis
from rom.reporting.results import DIRECT, Results


def offline_cost(found: Results) -> Figure | None:
    """Snapshots and fit beside the queries after which they pay back."""
    methods = found.reduced
    if not methods or not np.isfinite(found.per_entry("offline_seconds")).any():
        return None
    rows = [found.headline(m) for m in methods]
    figure = sheet(0.42 * len(rows) + 2.0, _offline_title(found, rows))
    left, right = figure.subplots(1, 2, sharey=True)
    y = np.arange(len(rows))[::-1]
    total = found.per_entry("offline_seconds")[rows]
    parts = (("snapshot_seconds", "snapshots (direct solutions to learn from)", +0.18, 0.45),
             ("fit_seconds", "fit (modes, basis or training)", -0.18, 1.0))
    shown = np.concatenate([found.per_entry(name)[rows] for name, *_ in parts])
    least = _floor(shown)
    for name, label, shift, alpha in parts:
        values = found.per_entry(name)[rows]
        left.barh(y + shift, np.where(values > 0, values, least), height=0.34, left=0, alpha=alpha,
                  color=[palette.style(m).colour for m in methods])
        left.barh([0], [np.nan], color=palette.QUIET, alpha=alpha, label=label)
    left.set_xscale("log")
    largest = np.nanmax(np.append(shown[np.isfinite(shown)], least))
    left.set_ylim(-0.6, len(rows) - 0.4)
    left.set_xlim(least, 15 * max(largest, 2 * least))
    for k, value in zip(y, total, strict=True):
        if np.isfinite(value):
            at = np.nanmax([least, *(found.per_entry(name)[rows[len(rows) - 1 - k]] for name, *_ in parts)])
            left.text(at * 1.15, k, words.seconds(value), va="center", fontsize=9)
    left.set_yticks(y, methods, fontsize=10)
    left.set_xlabel("time before the first answer [s]; written: total")
    left.legend(fontsize=8.5, frameon=False, loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=1)
    time_axis(left.xaxis)
    tidy(left, "x")
    needed = found.per_entry("break_even_cases")[rows]
    finite = np.isfinite(needed) & (needed > 0)
    right.barh(y[finite], np.maximum(needed[finite], 1), height=0.6, left=0,
               color=[palette.style(m).colour for m, f in zip(methods, finite, strict=True) if f])
    right.set_xscale("log")
    right.set_xlim(0.7, 30 * max(needed[finite].max(), 10) if finite.any() else 100)
    for k, value, offline in zip(y, needed, total, strict=True):
        text = "at once" if offline == 0 and np.isfinite(value) else words.count(value)
        right.text(max(value, 1) * 1.15 if np.isfinite(value) else 0.8, k, text, va="center", fontsize=9)
    right.set_xlabel(f"answers after which it beats {DIRECT} in total time")
    number_axis(right.xaxis)
    tidy(right, "x")
    return Figure("offline-cost.png", figure,
                 "Left: what must be computed before the first answer. Snapshots and fit stand one under the other, "
                 "not end to end, since the axis is logarithmic. Right: the number of single answers after which "
                 f"the total time, preparation included, falls below that of {DIRECT}.",
                 "Bars of offline time and of break-even queries for each method.")


def speed(found: Results) -> Figure | None:
    """Speed-up of each method's headline over direct: one case, batch, a part of the answer."""
    methods = found.reduced
    if not methods:
        return None
    rows = [found.headline(m) for m in methods]
    figure = sheet(0.78 * len(rows) + 1.7, _speed_title(found, rows))
    axes = figure.subplots()
    y = np.arange(len(rows))[::-1].astype(float)
    sets = ((found.speedup, "one case, full field", 0.26, 1.0, "", _over_floor(found, found.online, "floor_seconds")),
            (found.batch_speedup, "a case in a large batch, full field", 0.0, 0.6, "",
             _over_floor(found, found.per_entry("batch_seconds"), "batch_floor_seconds")),
            (found.output_speedup, f"one case, {found.partial} only", -0.26, 0.3, "///",
             np.full(len(found.method), np.nan)))
    known = np.concatenate([s[0][rows] for s in sets])
    known = known[np.isfinite(known) & (known > 0)]
    least, most = (known.min(), known.max()) if len(known) else (1.0, 1.0)
    start = min(0.5, 0.5 * least)
    axes.set_xscale("log")
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set_xlim(start, max(20.0, most * (most / start) ** 0.24))
    for ratios, label, shift, alpha, hatch, over in sets:
        axes.barh(y + shift, ratios[rows], height=0.24, alpha=alpha, hatch=hatch, edgecolor="white", linewidth=0,
                  color=[palette.style(m).colour for m in methods])
        axes.barh([0], [np.nan], color=palette.QUIET, alpha=alpha, hatch=hatch, edgecolor="white", linewidth=0,
                  label=label)
        for k, i in zip(y, rows, strict=True):
            if np.isfinite(ratios[i]):
                floor = f"   ({words.significant(over[i], 2)} × the machine's floor)" if np.isfinite(over[i]) else ""
                axes.text(ratios[i] * 1.08, k + shift, words.ratio(ratios[i]) + floor, va="center", fontsize=8.5)
    axes.axvline(1.0, color=palette.style(DIRECT).colour, linewidth=1.0, linestyle=":")
    split = found.splits[0]
    errors = [words.error(found.errors(split)[i]) for i in rows]
    axes.set_yticks(y, [f"{m}\n{error} error" for m, error in zip(methods, errors, strict=True)], fontsize=9.5)
    axes.set_xlabel(f"times faster than {DIRECT} doing the same")
    axes.legend(fontsize=9, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    number_axis(axes.xaxis)
    tidy(axes, "x")
    return Figure("speed-up.png", figure,
                 f"Speed-up over {DIRECT} at the headline settings; under each name its largest error on the "
                 f"{split} split, since speed without accuracy is worth nothing. The machine's floor: for one case "
                 "the time to read the numbers that the answer is made of once from memory, for a batch the time of "
                 "the matrix product alone.",
                 "Bars of speed-up over the direct solver for one case, a batch and a part of the answer.")


def _over_floor(found: Results, times: np.ndarray, name: str) -> np.ndarray:
    floor = found.per_entry(name)
    return np.divide(times, floor, out=np.full(len(times), np.nan), where=np.isfinite(floor) & (floor > 0))


def _floor(values: np.ndarray) -> float:
    """A tenth of the least positive value [s], but no less than a millionth of the largest: where empty bars end."""
    known = values[np.isfinite(values) & (values > 0)]
    return max(0.1 * known.min(), 1e-6 * known.max()) if len(known) else 1e-3


def _offline_title(found: Results, rows: list[int]) -> str:
    cost = found.per_entry("offline_seconds")
    known = [i for i in rows if np.isfinite(cost[i])]
    good = [i for i in known if found.errors(found.splits[0])[i] <= found.gate and cost[i] > 0]
    if not good:
        return f"Preparation takes {words.seconds(min(cost[known]))} to {words.seconds(max(cost[known]))}"
    i, dear = min(good, key=lambda k: cost[k]), max(known, key=lambda k: cost[k])
    text = f"Cheapest preparation within {words.error(found.gate)}: {found.method[i]}, {words.seconds(cost[i])}"
    return text if i == dear else f"{text}; dearest of all: {found.method[dear]}, {words.seconds(cost[dear])}"


def _speed_title(found: Results, rows: list[int]) -> str:
    errors = found.errors(found.splits[0])
    fast = [i for i in rows if np.isfinite(found.speedup[i])]
    good = [i for i in fast if errors[i] <= found.gate]
    if not good:
        return (f"No headline setting stays within {words.error(found.gate)} on the {found.splits[0]} split, "
                "whatever its speed")
    i = max(good, key=lambda k: found.speedup[k])
    return (f"Fastest headline within {words.error(found.gate)} ({found.splits[0]} split): {found.method[i]}, "
            f"{words.ratio(found.speedup[i])} faster than {DIRECT} for one case")
