"""What to conclude, in plain sentences computed from the results; what failed stands among them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr

from rom.reporting import words
from rom.reporting.contact_conclusions import contact_quantities
from rom.reporting.failures import shortfalls
from rom.reporting.network_verdict import network_verdict
from rom.reporting.results import DIRECT, LEARNED, SOLVERS, UNSEEN_NODE, Results

MANY_TIMES = 3.0
"""An error this many times another is called much larger."""
LOOSE = 5.0
"""A median effectivity this many times the best one is told apart."""


def conclusions(results: xr.Dataset) -> list[str]:
    """Sentences that a reader can act on, the most useful first.

    Parameters
    ----------
    results : xr.Dataset
        As read from ``results.nc``.

    Returns
    -------
    list of str
    """
    found = Results(results)
    parts = (recommended, payback, accuracy, gate_speed, contact_quantities, shortfalls, band_modes, learners,
             network_verdict, pod_at_new_nodes, certificate, mesh)
    return [sentence for part in parts for sentence in part(found)]


def verdict(results: xr.Dataset) -> str:
    """The one sentence that stands for the whole comparison."""
    return next(recommended(Results(results)))


def recommendation(found: Results) -> int | None:
    """The cheapest entry that meets the gate on every split, else on the first; None where there is none."""
    passing = found.passing(found.splits) or found.passing(found.splits[:1])
    return passing[0] if passing else None


def recommended(found: Results) -> Iterator[str]:
    """The cheapest method that meets the gate, on each split."""
    gate, best = words.error(found.gate), {s: found.passing([s]) for s in found.splits}
    cheapest = {split: entries[0] for split, entries in best.items() if entries}
    if len(cheapest) == len(found.splits) > 1 and len(set(cheapest.values())) == 1:
        i = next(iter(cheapest.values()))
        yield (f"Cheapest within {gate} on both splits: {found.name(i)}, {_time(found, i)}, with a largest held-out "
               f"error of {_errors(found, i)}.")
        return
    for split in found.splits:
        if split in cheapest:
            i = cheapest[split]
            yield (f"Cheapest within {gate} on the {split} split: {found.name(i)}, {_time(found, i)}, with a largest "
                   f"held-out error of {words.error(found.errors(split)[i])}.")
        else:
            yield (f"No method stays within {gate} on the {split} split: only {DIRECT} can be trusted there, "
                   f"{words.seconds(found.online[found.direct])} a case.")


def accuracy(found: Results) -> Iterator[str]:
    """The most accurate method on each split, solvers of the full model aside."""
    best: dict[str, int] = {}
    for split in found.splits:
        errors = found.errors(split)
        entries = [i for i in range(len(errors)) if np.isfinite(errors[i]) and found.method[i] not in SOLVERS]
        if entries:
            best[split] = min(entries, key=lambda i: errors[i])
    if len(best) > 1 and len(set(best.values())) == 1:
        i = next(iter(best.values()))
        yield f"Most accurate on both splits: {found.name(i)}, at most {_errors(found, i)} off, {_time(found, i)}."
    else:
        for split, i in best.items():
            error = words.error(found.errors(split)[i])
            yield f"Most accurate on the {split} split: {found.name(i)}, at most {error} off, {_time(found, i)}."


def gate_speed(found: Results) -> Iterator[str]:
    """Largest speed-up at the gate's level of error: one case, batch, a part of the answer."""
    for split in found.splits:
        entries = found.passing([split])
        parts = []
        for what, ratios in (("for one full field", found.speedup), ("a case in a batch", found.batch_speedup),
                             (f"for the {found.partial} alone", found.output_speedup)):
            known = [i for i in entries if np.isfinite(ratios[i])]
            if known:
                i = max(known, key=lambda k: ratios[k])
                parts.append(f"{words.ratio(ratios[i])} {what} ({found.method[i]})")
        reached = "; ".join(parts) if parts else "not reached"
        yield f"Speed-up over {DIRECT} at {words.error(found.gate)} on the {split} split: {reached}."


def band_modes(found: Results) -> Iterator[str]:
    """Plain modal superposition with the modes inside the band, and why it is as good or bad as it is."""
    if "modal" not in found.methods or not found.harmonic:
        return
    inside = int((found.natural_hz <= found.band_hz).sum())
    entries = found.entries("modal")
    named = {i: found.modes_kept(i) for i in entries}
    i = next((i for i, kept in named.items() if inside and kept == inside),
             next((i for i, kept in named.items() if kept is None), found.headline("modal")))
    split = found.splits[0]
    error = found.errors(split)[i]
    kept = named[i] or inside
    modes = words.plural(kept, "mode") if kept else "modes"
    where = f"below {words.frequency(found.band_hz)} " if named[i] in (None, inside) else ""
    start = f"Plain modal superposition with the {modes} {where}is off by up to {words.error(error)}"
    if not error > found.gate:
        yield f"{start}, within the gate of {words.error(found.gate)}."
        return
    text = (f"{start} and must not be trusted: a point load excites all modes above the band too, quasi-statically, "
            "and what they add together, the static part, is missing.")
    largest = max(entries, key=lambda k: named[k] or 0)
    if (named[largest] or 0) > kept:
        text += f" {named[largest]} modes still leave {words.error(found.errors(split)[largest])}."
    for method, what in (("modal-static", "the static response of each load"),
                         ("modal-krylov", "further load-dependent vectors")):
        best = found.best(method, split) if method in found.methods else None
        if best is not None:
            left = found.errors(split)[best]
            outcome = f"the maximum is {words.error(left)}" if left < error else f"it is no better: {words.error(left)}"
            text += f" With {what} ({found.name(best)}) {outcome}."
    yield text


def learners(found: Results) -> Iterator[str]:
    """Networks and regression: against whom they lose or win, and what they do at unseen nodes."""
    split = found.splits[0]
    errors = found.errors(split)
    rivals = [i for i in map(found.headline, found.methods)
              if found.method[i] not in (*LEARNED, *SOLVERS) and np.isfinite(errors[i])]
    for method in (name for name in LEARNED if name in found.methods):
        i = found.headline(method)
        if not np.isfinite(errors[i]):
            continue
        middle = found.errors(split, "median")[i]
        text = f"{found.name(i)} is off by up to {words.error(errors[i])}, {words.error(middle)} in the median"
        if rivals:
            rival = min(rivals, key=lambda k: errors[k])
            text += f"; {_match(found, i, rival, split)}"
        unseen = found.region_error(i, UNSEEN_NODE)
        if np.isfinite(unseen):
            text += f". At nodes kept from training it reaches {words.error(unseen)}, {_against(unseen, errors[i])}"
        yield text + "."


def pod_at_new_nodes(found: Results) -> Iterator[str]:
    """What a POD basis does for loads it has not seen, and whether the basis or the coefficients are to blame."""
    if "pod-galerkin" not in found.methods:
        return
    i = found.headline("pod-galerkin")
    unseen, known = found.region_error(i, UNSEEN_NODE), found.errors(found.splits[0])[i]
    if not np.isfinite(unseen) or not np.isfinite(known):
        return
    text = (f"{found.name(i)} is off by up to {words.error(known)} where every node was in training and "
            f"{words.error(unseen)} at unseen nodes")
    projection = found.projection_errors(found.splits[-1])[i]
    if unseen > MANY_TIMES * known:
        text += ": a POD basis does not carry over to loads that it has not seen"
        if projection > 0.3 * unseen:
            text += f" (even the best combination of its vectors misses by {words.error(projection)})"
    elif unseen <= found.gate:
        text += ": the basis carries over to unseen loads"
    else:
        text += ": the basis is too small for either" if known > found.gate else ": outside the gate there"
    yield text + "."


def payback(found: Results) -> Iterator[str]:
    """Offline cost and break-even of the recommended entry."""
    i = recommendation(found)
    if i is None:
        return
    cost, needed = found.per_entry("offline_seconds")[i], found.per_entry("break_even_cases")[i]
    if not np.isfinite(cost):
        return
    after = "never pays back" if not np.isfinite(needed) else (
        f"pays back after {words.count(needed)} answers" if needed > 1 else "pays back with the first answer")
    yield f"{found.name(i)} costs {words.seconds(cost)} offline and {after}."


def certificate(found: Results) -> Iterator[str]:
    """How sharp the error bounds are, and whether one was ever below the true error."""
    low, middle, high = (found.per_entry(f"effectivity_{name}") for name in ("min", "median", "max"))
    for method in found.methods:
        bounded = [i for i in found.entries(method) if np.isfinite([low[i], middle[i], high[i]]).all()]
        if not bounded:
            continue
        tight, loose, least = (min(bounded, key=lambda i: middle[i]), max(bounded, key=lambda i: middle[i]),
                               min(low[i] for i in bounded))
        text = (f"The error bound of {method} is {words.significant(middle[tight])} times the true energy error in the "
                f"median with {found.setting(tight) or 'its only setting'}")
        if middle[loose] > LOOSE * middle[tight]:
            text += (f", and {words.significant(middle[loose])} times with {found.setting(loose)}, whose error is so "
                     "small that the bound is mostly an allowance for rounding")
        yield text + (": at no setting and in no case did it promise too much." if least >= 1.0 else
                      f"; down to {words.bound(least)} times it promised too much: it was not a bound in every case.")


def mesh(found: Results) -> Iterator[str]:
    """How far the mesh itself is from a finer one."""
    middle, high = found.scalar("mesh_floor_median"), found.scalar("mesh_floor_max")
    if np.isfinite(middle) and np.isfinite(high):
        yield (f"The mesh itself differs from a finer one by {words.error(middle)} in the median and "
               f"{words.error(high)} at most: an error far below that is nearer to {DIRECT} on this mesh, not to a "
               "real finger.")


def _time(found: Results, entry: int) -> str:
    """``110 µs a case, 5,000 × faster than direct``."""
    ratio = found.speedup[entry]
    if not np.isfinite(ratio):
        return f"{words.seconds(found.online[entry])} a case"
    speed = f"{words.ratio(ratio)} faster than" if ratio >= 1 else f"{words.ratio(1 / ratio)} slower than"
    return f"{words.seconds(found.online[entry])} a case, {speed} {DIRECT}"


def _errors(found: Results, entry: int) -> str:
    return words.listed([f"{words.error(found.errors(split)[entry])} ({split})" for split in found.splits])


def _match(found: Results, entry: int, rival: int, split: str) -> str:
    errors = found.errors(split)
    better, faster = errors[entry] < errors[rival], found.online[entry] < found.online[rival]
    outcome = {(True, True): "it beats {} in error and time", (True, False): "it is more accurate than {}, but slower",
               (False, True): "it loses to {} in error, but is faster",
               (False, False): "it loses to {} in error and time"}[better, faster]
    return (f"{outcome.format(found.name(rival))} ({words.error(errors[rival])}; "
            f"{words.seconds(found.online[entry])} against {words.seconds(found.online[rival])})")


def _against(unseen: float, known: float) -> str:
    if unseen > MANY_TIMES * known:
        return f"{words.significant(unseen / known, 2)} times as much"
    return "about as much" if unseen > known / MANY_TIMES else "less"
