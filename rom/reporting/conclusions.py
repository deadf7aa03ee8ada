"""What to conclude, in plain sentences computed from the results: three to five that a reader can act on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr

from rom.reporting import words
from rom.reporting.choices import repaid
from rom.reporting.results import Results


def conclusions(results: xr.Dataset) -> list[str]:
    """The verdict, the most useful sentence first.

    Parameters
    ----------
    results : xr.Dataset
        As read from ``results.nc``.

    Returns
    -------
    list of str
    """
    found = Results(results)
    return [sentence for part in (recommended, payback, elsewhere, learners, mesh) for sentence in part(found)]


def verdict(results: xr.Dataset) -> str:
    """The one sentence that stands for the whole comparison."""
    return next(recommended(Results(results)))


def recommendation(found: Results, splits: list[str]) -> int | None:
    """The fastest entry within the gate on some splits; None where there is none."""
    return found.fastest(found.within(found.gate, splits), found.online)


def recommended(found: Results) -> Iterator[str]:
    """The cheapest method that meets the gate on the first split."""
    split, gate, i = found.splits[0], words.error(found.gate), recommendation(found, found.splits[:1])
    if i is None:
        direct = found.baseline()
        yield (f"No method stays within {gate} on the {split} split: only {found.method[direct]} can be trusted, "
               f"{words.seconds(found.online[direct])} a {found.noun}.")
        return
    yield (f"Cheapest within {gate} on the {split} split: {found.name(i)}, {speed(found, i)} for one {found.noun}, at "
           f"most {words.error(found.errors(split)[i])} off.")


def payback(found: Results) -> Iterator[str]:
    """Preparation of the recommended entry, and what users call."""
    i = recommendation(found, found.splits[:1])
    if i is None:
        return
    cost, after, called = found.per_entry("offline_seconds")[i], repaid(found, i), found.speedup("call")[i]
    if np.isfinite(cost):
        after = f"never pays back against {found.method[found.baseline()]}" if after == "never" else (
            f"pays back after {after}")
        text = f"Its preparation takes {words.seconds(cost)} and {after}"
        yield text + (f"; called through `predict`, labels included, it is {words.ratio(called)} as fast as the "
                      "fastest full solve." if np.isfinite(called) else ".")


def elsewhere(found: Results) -> Iterator[str]:
    """Whether the recommended entry holds on the splits that keep whole parts from training, and what else does."""
    i, gate = recommendation(found, found.splits[:1]), words.error(found.gate)
    others = [split for split in found.splits[1:] if np.isfinite(found.errors(split)).any()]
    if not others:
        return
    where = f"on the {words.listed(others)} split{'s' if len(others) > 1 else ''}"
    error = np.nan if i is None else np.max([found.errors(split)[i] for split in others])
    if error <= found.gate:
        yield f"It holds on parts that were kept from training too: at most {words.error(error)} off {where}."
        return
    holds = recommendation(found, others)
    failing = f"It does not hold {where}, at most {words.error(error)} off; " if np.isfinite(error) else ""
    rest = (f"cheapest within {gate} there: {found.name(holds)}, {speed(found, holds)}." if holds is not None else
            f"no method stays within {gate} there: only {found.method[found.baseline()]} can be trusted.")
    yield failing + rest if failing else rest[0].upper() + rest[1:]


def learners(found: Results) -> Iterator[str]:
    """How many methods that learn from solved cases meet the gate, and the best of them."""
    if not found.learners:
        return
    gate, counts = words.error(found.gate), []
    for split in found.splits:
        good = [m for m in found.learners if found.within(found.gate, [split])[found.entries(m)].any()]
        counts.append(f"{words.listed(good) if good else 'none'} on the {split} split")
    if all(text.startswith("none") for text in counts):
        yield f"No method that learns from solved cases stays within {gate} at any setting."
    else:
        yield f"Of the methods that learn from solved cases, within {gate} at some setting: {'; '.join(counts)}."


def mesh(found: Results) -> Iterator[str]:
    """How far the mesh itself is from a finer one."""
    high = found.scalar("mesh_floor_max")
    if np.isfinite(high):
        yield (f"The mesh itself differs from a finer one by up to {words.error(high)}: an error far below that is "
               f"nearer to {found.truth} on this mesh, not to reality.")


def failures(found: Results) -> Iterator[str]:
    """What did not work beside the gates missed; nothing where everything did."""
    headline = [found.headline(m) for m in found.reduced]
    for method in found.reduced:
        if not any(np.isfinite(found.errors(split)[found.entries(method)]).any() for split in found.splits):
            yield f"{method} gave no answer that could be compared."
    slow = [found.name(i) for i in headline if found.speedup()[i] < 1.0]
    if slow:
        yield f"No faster than {found.method[found.baseline()]} for one {found.noun}: {words.listed(slow)}."
    never = [found.name(i) for i in headline if np.isinf(found.break_even[i])]
    if never:
        yield f"Their preparation never pays back: {words.listed(never)}."
    low = found.per_entry("effectivity_min")
    false = list(dict.fromkeys(m for m, least in zip(found.method, low, strict=True) if least < 1.0))
    if false:
        yield f"The error bound was below the true error in at least one case: {words.listed(false)}."
    for reason in found.record("omitted") or []:
        yield f"Not fitted: {reason}"


def speed(found: Results, entry: int) -> str:
    """``5,000 × faster than direct``."""
    ratio, against = found.speedup()[entry], found.method[found.baseline()]
    if not np.isfinite(ratio):
        return f"{words.seconds(found.online[entry])} a {found.noun}"
    return f"{words.ratio(ratio)} faster than {against}" if ratio >= 1 else (
        f"{words.ratio(1 / ratio)} slower than {against}")
