"""Which method for which question: the cheapest that stays within the gate, workload by workload."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rom.reporting import html, words
from rom.reporting.results import Results

LEVELS = (1e-2, 1e-4, 1e-6)
"""Levels of largest error at which speed-ups are compared, beside the gate."""


class Choice(NamedTuple):
    """A question, the entry that answers it (None: nothing but the full model), its errors there, what it is asked."""

    question: str
    entry: int | None
    errors: dict[str, float]
    workload: str = "one"


def choices(found: Results) -> Iterator[Choice]:
    """Every question that the results can answer."""
    first, noun, offline = found.splits[0], found.noun, found.per_entry("offline_seconds")
    allowed = found.within(found.gate, [first])
    total = np.nan_to_num(offline) + found.online
    once, direct = found.fastest(allowed, total), found.baseline()
    if once is not None and total[direct] <= total[once]:
        once = direct
    yield _judged(found, f"One {noun}, once, preparation included", once)
    yield _judged(found, f"One {noun} at a time, again and again", found.fastest(allowed, found.online))
    if np.isfinite(found.seconds("batch")).any():
        yield _judged(found, f"Thousands of {noun}s", found.fastest(allowed, found.seconds("batch")), "batch")
    if np.isfinite(found.seconds("part")).any():
        yield _judged(found, f"Only the {found.partial}", found.fastest(allowed, found.seconds("part")), "part")
    for q, quantity in enumerate(found.quantities):
        errors = found.quantity_errors()[:, :, q]
        i = found.fastest(errors[:, 0] <= found.gate, found.online)
        yield Choice(f"The {quantity}", i, {} if i is None else dict(zip(found.splits, errors[i], strict=True)))
    held: dict[int | None, list[int]] = {}
    for r in range(len(found.regions)):
        if np.isfinite(found.region_errors[:, r]).any():
            held.setdefault(found.fastest(found.region_errors[:, r] <= found.gate, found.online), []).append(r)
    for i, parts in held.items():
        yield Choice(f"Beyond the training: {'; '.join(found.regions[r] for r in parts)}", i,
                     {} if i is None else {"there": float(found.region_errors[i, parts].max())})
    for level in LEVELS:
        if level < found.gate:
            i = found.fastest(found.within(level, found.splits), found.online)
            yield _judged(found, f"One {noun} within {words.error(level)} on every split", i)
            if i is None:
                break


def _judged(found: Results, question: str, entry: int | None, workload: str = "one") -> Choice:
    errors = {} if entry is None else {split: float(found.errors(split)[entry]) for split in found.splits}
    return Choice(question, entry, errors, workload)


def repaid(found: Results, entry: int) -> str:
    """``35 cases``: after so many, one at a time, preparation is repaid; ``never`` where it is not."""
    number = words.count(max(found.break_even[entry], 1))
    return number if number == "never" else f"{number} {found.noun}{'' if number == '1' else 's'}"


def choice_table(found: Results) -> str:
    """The table *which method for which question*."""
    call, offline = found.seconds("call"), found.per_entry("offline_seconds")
    head = [html.named("question"), html.named("method", "setting"), html.named("largest error", "held-out cases"),
            html.named("time", f"a {found.noun}"), html.named("speed-up", "over the fastest full solve"),
            html.named("through `predict`", "with labels"), html.named("preparation", "pays back after")]
    rows = []
    for one in choices(found):
        i = one.entry
        if i is None:
            nothing = html.cell("not reached", f"only {found.method[found.baseline()]}", "fail")
            rows.append(("", [html.named(one.question), nothing, *[html.cell(words.NONE)] * 5]))
            continue
        (where, error), *others = one.errors.items()
        solver = found.method[i] in found.solvers
        calls = html.cell(words.seconds(call[i]), words.ratio(found.speedup("call")[i])) if (
            one.workload == "one") else html.cell(words.NONE)
        after = "" if solver or not offline[i] > 0 else repaid(found, i)
        rows.append(("", [
            html.named(one.question), html.cell(found.method[i], found.setting(i)),
            html.cell(words.error(error), "; ".join([where, *(f"{s} {words.error(e)}" for s, e in others)]),
                      "pass" if error <= found.gate else "fail"),
            html.cell(words.seconds(found.seconds(one.workload)[i])),
            html.cell(words.NONE, "is the full model") if solver else html.cell(
                words.ratio(found.speedup(one.workload)[i]), f"over {found.method[found.baseline(one.workload)]}"),
            calls, html.cell(words.seconds(offline[i]), after)]))
    return html.table(f"The cheapest within {words.error(found.gate)} for the largest held-out error on the "
                      f"{found.splits[0]} split, if the question names no other bar.", head, rows)
