"""What did not work, computed from the results: gates missed, models slower than the solver, bounds that are none."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rom.reporting import words
from rom.reporting.results import DIRECT, Results


def shortfalls(found: Results) -> Iterator[str]:
    """Which methods miss the gate at every setting, and by how much, on each split."""
    gate = words.error(found.gate)
    for split in found.splits:
        errors = found.errors(split)
        best = {method: found.best(method, split) for method in found.reduced}
        failing = sorted((i for i in best.values() if i is not None and errors[i] > found.gate),
                         key=lambda i: -errors[i])
        if failing:
            each = [f"{found.name(i)} with {words.error(errors[i])} "
                    f"({words.significant(errors[i] / found.gate, 2)} times the gate)" for i in failing]
            yield f"Outside {gate} on the {split} split, even at their best setting: {words.listed(each)}."
        elif any(i is not None for i in best.values()):
            yield f"Every method has a setting within {gate} on the {split} split."


def failures(found: Results) -> list[str]:
    """Sentences for the section on what did not work; empty where everything did."""
    sentences = [s for s in shortfalls(found) if s.startswith("Outside")]
    for method in found.reduced:
        errors = np.array([found.errors(split)[found.entries(method)] for split in found.splits])
        if not np.isfinite(errors).any():
            sentences.append(f"{method} gave no answer that could be compared.")
    slow = [found.name(i) for i in map(found.headline, found.reduced) if found.speedup[i] < 1.0]
    if slow:
        sentences.append(f"No faster than {DIRECT} for one case: {words.listed(slow)}.")
    needed = found.per_entry("break_even_cases")
    never = [found.name(i) for i in map(found.headline, found.reduced) if np.isinf(needed[i])]
    if never:
        sentences.append(f"Their preparation never pays back: {words.listed(never)}.")
    low = found.per_entry("effectivity_min")
    false = list(dict.fromkeys(found.method[i] for i in range(len(low)) if low[i] < 1.0))
    if false:
        sentences.append(f"The error bound was below the true error in at least one case: {words.listed(false)}.")
    sentences += [f"Not fitted: {reason}" for reason in found.record("omitted") or []]
    return sentences
