"""The numbers behind the figures: headline settings, speed-ups at a level of error, learners, all settings."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from rom.reporting import html, words
from rom.reporting.choices import LEVELS
from rom.reporting.html import Cell
from rom.reporting.results import Results


def headline_table(found: Results) -> Iterator[str]:
    """One row a method: errors on each split, times, preparation, size."""
    offline, size, call = found.per_entry("offline_seconds"), found.per_entry("model_bytes"), found.seconds("call")
    cold, first = found.per_entry("cold_seconds"), found.per_entry("first_seconds")
    told_cold = bool(np.isfinite(cold).any())
    head = [html.named("method", "setting"),
            *(html.named(f"error, {split}", "max / p95 / median") for split in found.splits), *_time_heads(found),
            html.named("through `predict`", "with labels"), *([html.named("cold", "first ever")] if told_cold else []),
            html.named("offline"), html.named("size"), html.named("pays back", "after answers")]
    rows = []
    for i in map(found.headline, found.methods):
        rows.append(("", [_name(found, i), *(_error(found, i, split) for split in found.splits), *_times(found, i),
                          html.cell(words.seconds(call[i]), words.ratio(found.speedup("call")[i])),
                          *([html.cell(words.seconds(cold[i]), words.seconds(first[i]))] if told_cold else []),
                          html.cell(words.seconds(offline[i])), html.cell(words.size(size[i])),
                          html.cell(words.NONE if found.method[i] in found.solvers
                                    else words.count(found.break_even[i]))]))
    yield html.table("The settings that stand for their methods. Times, and below them how many times faster than the "
                     f"fastest full-order method at the same work. The gate is {words.error(found.gate)} for the "
                     "largest held-out error.", head, rows)


def speed_tables(found: Results) -> Iterator[str]:
    """Largest speed-up at each level of error, or "not reached"; a table a split."""
    levels = sorted({found.gate, *LEVELS}, reverse=True)
    head = [html.named("method"), *(html.named(f"within {words.error(level)}", "gate" if level == found.gate else "")
                        for level in levels)]
    ratios = [found.speedup(workload) for workload in ("one", "batch", "part")]
    for split in found.splits:
        rows = []
        for method in found.reduced:
            cells = [html.named(method, colour=found.style(method).colour)]
            for level in levels:
                entries = [i for i in found.entries(method) if found.within(level, [split])[i]]
                one, batch, part = (words.ratio(max((r[i] for i in entries if np.isfinite(r[i])), default=np.nan))
                                    for r in ratios)
                cells.append(html.cell(one, f"batch {batch}, part {part}") if entries else html.cell("not reached"))
            rows.append(("", cells))
        yield html.table(f"Largest speed-up at a level of largest error, {split} split: one {found.noun}; in a batch "
                         f"and for the {found.partial} below it, each at the setting that suits it best.", head, rows)


def settings_table(found: Results) -> Iterator[str]:
    """Every entry: errors, times, preparation and how near to the machine's floor it runs."""
    floors = {"one": found.per_entry("floor_seconds"), "batch": found.per_entry("batch_floor_seconds")}
    snapshot, fit, size, offline = (found.per_entry(n) for n in (
        "snapshot_seconds", "fit_seconds", "model_bytes", "offline_seconds"))
    head = [html.named("method", "setting"),
            *(html.named(f"largest error, {split}", "its basis alone") for split in found.splits), *_time_heads(found),
            html.named("over floor", "one; batch"), html.named("offline", "snapshots + fit"), html.named("size")]
    rows = []
    for i, method in enumerate(found.method):
        parts = f"{words.seconds(snapshot[i])} + {words.seconds(fit[i])}"
        over = [words.ratio(found.seconds(what)[i] / floor[i]) if floor[i] > 0 else words.NONE
                for what, floor in floors.items()]
        rows.append(("headline" if i == found.headline(method) else "", [
            _name(found, i), *(html.cell(words.error(found.errors(split)[i]), _basis(found, i, split))
                               for split in found.splits), *_times(found, i),
            html.cell(over[0], "" if over[1] == words.NONE else over[1]),
            html.cell(words.seconds(offline[i]), "" if words.NONE in parts else parts),
            html.cell(words.size(size[i]))]))
    yield html.table("All settings; shaded: those that stand for their methods. The floor of the machine: memory read "
                     "once for one case, the matrix product alone for a batch.", head, rows)


def learner_table(found: Results) -> Iterator[str]:
    """What each method learned from, what that cost, and what it is worth where it has not been."""
    if not found.learners:
        return
    snapshot, fit, learned = (found.per_entry(n) for n in ("snapshot_seconds", "fit_seconds", "learned_cases"))
    train = (found.record("n_train") or {}).get(found.splits[0], math.nan)
    source = found.data["snapshot_source"].values if "snapshot_source" in found.data.variables else None
    basis = found.projection_errors(found.splits[0])
    rows = []
    for i in map(found.headline, found.learners):
        made = str(source[i]) if source is not None else ""
        cases = learned[i] if math.isfinite(learned[i]) else train
        rows.append(("", [_name(found, i), html.cell(words.count(cases), f"solved by {made}" if made else ""),
                          html.cell(words.seconds(snapshot[i])), html.cell(words.seconds(fit[i])),
                          *(_error(found, i, split) for split in found.splits), html.cell(words.error(basis[i])),
                          *(html.cell(words.error(e), kind="" if e <= found.gate else "fail")
                            for e in found.region_errors[i])]))
    head = [html.named("method", "setting"), html.named("learned from", "cases"), html.named("solving them"),
            html.named("fit"), *(html.named(f"error, {split}", "max / p95 / median") for split in found.splits),
            html.named("its basis alone", f"{found.splits[0]} split"), *(html.named(r, "max") for r in found.regions)]
    told = "All learned from equally many." if len({cells[1].words for _, cells in rows}) == 1 else (
        "They did not learn from equally many, so that they are not opponents on equal terms.")
    yield html.table(f"Methods that learn from solved cases. {told}", head, rows)


def shortfall_table(found: Results) -> Iterator[str]:
    """Methods that miss the gate at every setting, by split."""
    missed = [(split, i) for split in found.splits for i in (found.best(m, split) for m in found.reduced)
              if i is not None and found.errors(split)[i] > found.gate]
    if missed:
        head = ["split", "largest error", "over the gate"]
        yield html.table(f"Outside {words.error(found.gate)} even at the method's best setting.",
                         [html.named("method", "its best setting"), *map(html.named, head)],
            [("", [_name(found, i), html.cell(split), html.cell(words.error(found.errors(split)[i])),
                   html.cell(words.ratio(found.errors(split)[i] / found.gate))]) for split, i in missed])


def mode_table(found: Results) -> Iterator[str]:
    """What methods leave that keep a number of natural modes, setting by setting."""
    rows = [("", [_name(found, i), *(html.cell(words.error(found.errors(s)[i])) for s in found.splits)])
            for m in found.methods for i in found.entries(m)
            if any("modes=" in found.setting(k) for k in found.entries(m))]
    if rows and "natural_frequency" in found.data:
        yield html.table(
            "Natural modes kept, and the largest error that is left. A load excites the modes above a band too, "
            "quasi-statically: more modes take that away slowly, static and load-dependent vectors at once.",
            [html.named("method", "setting"), *(html.named(f"{split} split") for split in found.splits)], rows)


def _name(found: Results, entry: int) -> Cell:
    method = found.method[entry]
    return html.named(method, found.setting(entry), found.style(method).colour)


def _error(found: Results, entry: int, split: str) -> Cell:
    error, (judged, most) = found.errors(split)[entry], found.judged(entry, split)
    of = f" ({judged} of {most} {found.noun}s)" if judged < most else ""
    rest = " / ".join(words.error(found.errors(split, statistic)[entry]) for statistic in ("p95", "median"))
    return html.cell(words.error(error), rest + of,
                     "" if math.isnan(error) else "pass" if error <= found.gate else "fail")


def _basis(found: Results, entry: int, split: str) -> str:
    error = found.projection_errors(split)[entry]
    return words.error(error) if math.isfinite(error) else ""


def _time_heads(found: Results) -> list[Cell]:
    return [html.named(f"one {found.noun}", "whole answer"), html.named("in a batch", f"a {found.noun}"),
            html.named("part only", found.partial)]


def _times(found: Results, entry: int) -> list[Cell]:
    return [html.cell(words.seconds(found.seconds(what)[entry]), words.ratio(found.speedup(what)[entry]))
            for what in ("one", "batch", "part")]
