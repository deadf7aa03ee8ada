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
            errors = largest[:, s, q]
            known = [i for i, method in enumerate(found.method) if method not in SOLVERS and np.isfinite(errors[i])]
            good = [i for i in known if errors[i] <= found.gate]
            if good:
                i = good[int(np.argmin(found.online[good]))]
                yield (f"{name.capitalize()} within {gate} on the {split} split: fastest by {found.name(i)}, "
                       f"{words.error(errors[i])} at most, {words.ratio(found.speedup[i])} faster than direct.")
            elif known:
                i = known[int(np.argmin(errors[known]))]
                yield (f"{name.capitalize()} within {gate} on the {split} split: not reached; nearest {found.name(i)}, "
                       f"{words.error(errors[i])} at most.")
