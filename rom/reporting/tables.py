"""The numbers behind the figures: headline entries, speed-up at an error level, every setting."""

from __future__ import annotations

import math

import numpy as np

from rom.reporting import html, palette, words
from rom.reporting.results import DIRECT, Results

LEVELS = (1e-2, 1e-4, 1e-6)
"""Levels of largest error at which speed-ups are compared, beside the gate."""
NOTHING = words.NONE


def headline_table(found: Results) -> str:
    """One row a method: errors on each split, times as ratios to direct, preparation, size, gate."""
    head = [html.named("method", "setting")]
    for split in found.splits:
        head += [html.named(f"error, {split}", "max / p95 / median")]
    head += [html.named("one case", "full field"), html.named("batch", "a case, full field"),
             html.named(f"{found.partial} only", "one case"), html.named("labelled call", "adds"), "offline", "size",
             html.named("pays back", "after answers")]
    head += [html.named("gate", split) for split in found.splits]
    offline, needed, size = (found.per_entry(n) for n in ("offline_seconds", "break_even_cases", "model_bytes"))
    call = found.per_entry("call_seconds")
    rows = []
    for method in found.methods:
        i = found.headline(method)
        cells = [html.named(method, found.setting(i), palette.style(method).colour)]
        for split in found.splits:
            judged, most = found.judged(i, split)
            of = f" ({judged} of {most} cases)" if judged < most else ""
            cells.append(html.cell(words.error(found.errors(split)[i]),
                                   f"{words.error(found.errors(split, 'p95')[i])} / "
                                   f"{words.error(found.errors(split, 'median')[i])}{of}"))
        cells += _times(found, i)
        cells += [html.cell(words.seconds(call[i])), html.cell(words.seconds(offline[i])),
                  html.cell(words.size(size[i])), html.cell(NOTHING if method == DIRECT else words.count(needed[i]))]
        cells += [_gate(found, i, split) for split in found.splits]
        rows.append(("", cells))
    return html.table(f"Headline settings. Ratios are against {DIRECT}, doing the same; the times stand below them. "
                      f"The gate is {words.error(found.gate)} for the largest held-out error.", head, rows)


def _times(found: Results, entry: int) -> list[str]:
    sets = ((found.speedup, found.online), (found.batch_speedup, found.per_entry("batch_seconds")),
            (found.output_speedup, found.per_entry("output_seconds")))
    if entry == found.direct:
        return [html.cell("1 ×", words.seconds(times[entry])) for _, times in sets]
    return [html.cell(words.ratio(ratios[entry]), words.seconds(times[entry])) for ratios, times in sets]


def _gate(found: Results, entry: int, split: str) -> str:
    error = found.errors(split)[entry]
    if math.isnan(error):
        return html.cell(NOTHING)
    return html.cell("passed", kind="pass") if error <= found.gate else html.cell("failed", kind="fail")


def speed_table(found: Results, split: str) -> str:
    """Largest speed-up at each level of error, or "not reached"."""
    levels = sorted({found.gate, *LEVELS}, reverse=True)
    head = [html.named("method"), *(html.named(f"within {words.error(level)}", "gate" if level == found.gate else "")
                                    for level in levels)]
    rows = []
    for method in found.reduced:
        cells = [html.named(method, colour=palette.style(method).colour)]
        for level in levels:
            entries = [i for i in found.passing([split], level) if found.method[i] == method]
            cells.append(_fastest(found, entries))
        rows.append(("", cells))
    return html.table(f"Largest speed-up over {DIRECT} at a level of largest error, {split} split: one full field, "
                      f"with a case in a batch and the {found.partial} only below it, each at the setting that suits "
                      "it best.",
                      head, rows)


def _fastest(found: Results, entries: list[int]) -> str:
    def most(ratios: np.ndarray) -> float:
        return max((ratios[i] for i in entries if np.isfinite(ratios[i])), default=float("nan"))

    if not entries:
        return html.cell("not reached")
    return html.cell(words.ratio(most(found.speedup)), f"batch {words.ratio(most(found.batch_speedup))}, "
                     f"{found.partial} {words.ratio(most(found.output_speedup))}")


def settings_table(found: Results) -> str:
    """Every entry: errors, times, preparation and how near to the machine's floor it runs."""
    head = [html.named("method", "setting")]
    head += [html.named(f"largest error, {split}", "its basis alone") for split in found.splits]
    head += [html.named("one case", "full field"), html.named("over floor", "memory read once"),
             html.named("batch", "a case, full field"), html.named("over floor", "matrix product"),
             html.named(f"{found.partial} only", "one case"), html.named("offline", "snapshots + fit"), "size",
             html.named("bound / error", "median; least to largest")]
    snapshot, fit, size = (found.per_entry(n) for n in ("snapshot_seconds", "fit_seconds", "model_bytes"))
    offline, batch = found.per_entry("offline_seconds"), found.per_entry("batch_seconds")
    floor, batch_floor = found.per_entry("floor_seconds"), found.per_entry("batch_floor_seconds")
    rows = []
    for i, method in enumerate(found.method):
        cells = [html.named(method, found.setting(i), palette.style(method).colour)]
        for split in found.splits:
            basis = found.projection_errors(split)[i]
            cells.append(html.cell(words.error(found.errors(split)[i]),
                                   words.error(basis) if math.isfinite(basis) else ""))
        one, many, pad = _times(found, i)
        parts = f"{words.seconds(snapshot[i])} + {words.seconds(fit[i])}"
        cells += [one, html.cell(_over(found.online[i], floor[i])), many,
                  html.cell(_over(batch[i], batch_floor[i])), pad,
                  html.cell(words.seconds(offline[i]), "" if NOTHING in parts else parts),
                  html.cell(words.size(size[i])), _bound(found, i)]
        rows.append(("headline" if i == found.headline(method) else "", cells))
    return html.table("All settings; headline settings are shaded.", head, rows)


def _over(seconds: float, floor: float) -> str:
    return words.ratio(seconds / floor) if floor > 0 else NOTHING


def _bound(found: Results, entry: int) -> str:
    low, middle, high = (found.per_entry(f"effectivity_{name}")[entry] for name in ("min", "median", "max"))
    if not np.isfinite([low, middle, high]).all():
        return html.cell(NOTHING)
    return html.cell(words.significant(middle), f"{words.bound(low)} to {words.significant(high)}")
