"""What to conclude of contact quantities, which are judged apart from displacements."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rom.reporting import words
from rom.reporting.results import SOLVERS, Results


def contact_quantities(found: Results) -> Iterator[str]:
    """Who meets the gate in each contact quantity, and who misses it by how much."""
    if not found.contact:
        return
    largest = found.data["contact_error_max"].transpose("entry", "split", "quantity").values
    gate = words.error(found.gate)
    for s, split in enumerate(found.splits):
        for q, name in enumerate(str(n) for n in found.data["quantity"].values):
            best = {}
            for method in found.reduced:
                entries = [i for i in found.entries(method) if np.isfinite(largest[i, s, q])]
                if entries and method not in SOLVERS:
                    best[method] = min(entries, key=lambda i, s=s, q=q: largest[i, s, q])
            good = [i for i in best.values() if largest[i, s, q] <= found.gate]
            if good:
                i = min(good, key=lambda i: found.online[i])
                yield (f"{name.capitalize()} within {gate} on the {split} split: fastest by {found.name(i)}, "
                       f"{words.error(largest[i, s, q])} at most, {words.ratio(found.speedup[i])} faster than direct.")
            elif best:
                i = min(best.values(), key=lambda i, s=s, q=q: largest[i, s, q])
                yield (f"{name.capitalize()} within {gate} on the {split} split: not reached; nearest {found.name(i)}, "
                       f"{words.error(largest[i, s, q])} at most.")
