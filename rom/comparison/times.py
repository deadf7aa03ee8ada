"""Times of fitted entries: one case, the part alone, the labelled call, a batch; floors, speed-ups, break-even.

Speed-ups are quoted against the fastest full-order method for the same workload: for a batch the grouped solve with as
many right-hand sides as the batch has at an operating point. The ratio to the plain `direct` stands beside.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from rom.comparison.entries import Entry
from rom.comparison.timing import interleaved, memory_bandwidth, product_rate
from rom.fullorder import blas_threads
from rom.metamodels.validity import ValidityWarning
from rom.scenes import Scene

SINGLE = ("cold_seconds", "online_seconds", "output_seconds", "predict_seconds")
"""One case: after all other methods, again at once, the part alone, the labelled call."""
BATCHES = 3
MOST_COLUMNS = 32
"""Cases at one operating point that a slow method is given of the batch: more make no case cheaper."""


def measure_times(entries: list[Entry], scene: Scene, arrays: Any, rounds: int, batch: int, progress: Callable) -> None:
    """Measure entries on the same cases, interleaved; each one's ``facts`` take in raw times.

    Parameters
    ----------
    arrays : Cases
        Held-out cases, taken in turn.
    rounds, batch : int
    progress : callable
        Wraps the iteration over rounds, to show a bar.
    """
    # in random order: neighbours may share an operating point, and nobody's factor may serve the next case by chance
    arrays = arrays.take(np.random.default_rng(0).permutation(len(arrays)))
    n = len(arrays)
    single = [arrays.take(slice(i, i + 1)) for i in range(min(n, len(SINGLE) * rounds))]
    labelled = [scene.cases_from(one) for one in single]
    many = arrays.take(np.arange(batch) % n)
    group = max(scene.groups(many), key=len)[:MOST_COLUMNS]
    some = many.take(group)

    def calls(model: Any) -> list[Callable[[int], object]]:
        field = lambda i: model.evaluate(single[i % len(single)], "field")  # noqa: E731
        part = (lambda i: model.evaluate(single[i % len(single)], scene.part)) if scene.part else (lambda _: None)
        return [field, field, part, lambda i: model.predict(labelled[i % len(single)])]

    # one case is answered on one thread: a second gains little there and stalls for milliseconds on a busy machine;
    # the direct solver keeps all its threads
    with blas_threads(1), warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)  # errors are measured elsewhere
        found = interleaved({entry.label: calls(entry.model) for entry in entries}, rounds, progress=progress)
    for entry in entries:
        entry.facts |= dict(zip(SINGLE, found[entry.label], strict=True))
        if not scene.part:
            entry.facts["output_seconds"] = np.full(rounds, np.nan)
    _measure_batches(entries, scene, many, some)
    rates = {kind: product_rate(kind) for kind in ("float32", "float64")}
    for entry in entries:
        entry.facts |= _floors(entry, scene, rates)


def _measure_batches(entries: list[Entry], scene: Scene, many: Any, some: Any) -> None:
    # answers go into arrays that exist, as an application would let them; methods of one type share one
    rooms: dict[tuple[int, Any], np.ndarray] = {}
    calls: dict[str, list[Callable]] = {}
    for entry in entries:
        block = many if entry.kind.slow == 1 else some
        answer = entry.model.evaluate(block.take(slice(0, 1)), "field")
        out = None
        if isinstance(answer, np.ndarray):
            key = len(block), answer.dtype
            # written, so that its memory is there
            out = rooms.setdefault(key, np.full((len(block), answer.shape[1]), np.nan, dtype=answer.dtype))
        calls[entry.label] = [lambda _, m=entry.model, b=block, o=out: m.evaluate(b, "field", o)]
        entry.facts["batch_size"] = len(block)
    found = interleaved(calls, BATCHES, least=1)
    for entry in entries:
        entry.facts["batch_seconds"] = found[entry.label][0] / entry.facts["batch_size"]


def _floors(entry: Entry, scene: Scene, rates: dict[str, float]) -> dict[str, float]:
    """Least times that the memory and the arithmetic of this machine allow; NaN where a method states none.

    The memory is read as fast as one thread reads a matrix of the entry's size: a small basis stays in the processor's
    cache.
    """
    n_bytes = entry.model.online_bytes
    if not n_bytes:
        return {"floor_seconds": np.nan, "batch_floor_seconds": np.nan}
    precision = entry.model.settings.get("precision", "float64")
    operations = 2.0 * (2 if scene.harmonic else 1) * n_bytes / (4 if precision == "float32" else 8)
    with blas_threads(1):
        floor = n_bytes / memory_bandwidth(n_bytes)
    return {"floor_seconds": floor, "batch_floor_seconds": operations / rates[precision]}


# ---- variables of the results -----------------------------------------------------------------------------------

def time_variables(entries: list[Entry], scene: Scene) -> dict[str, tuple]:
    """Raw times, costs, and speed-ups over the fastest full-order method for the same workload."""
    noun, s, one = scene.case_noun, {"units": "s"}, {"units": "1"}

    def stacked(name: str) -> np.ndarray:
        return np.array([entry.facts[name] for entry in entries])

    words = {"cold_seconds": f"wall time of one {noun}, whole answer, after all other methods ran",
             "online_seconds": f"wall time of one {noun}, whole answer, right after another",
             "output_seconds": f"wall time of one {noun}, {scene.part_words} only",
             "predict_seconds": f"wall time of one labelled {noun} by predict: labels, validity and error included"}
    variables: dict[str, tuple] = {name: (("entry", "repeat"), stacked(name), {"long_name": text, **s})
                                   for name, text in words.items()}
    variables["batch_seconds"] = (("entry", "batch_repeat"), stacked("batch_seconds"), {
        "long_name": f"wall time of a {noun} in a large batch, whole answer", **s})
    for name, text, unit in (
            ("first_seconds", f"wall time of the first {noun} after fitting", "s"),
            ("batch_size", f"{noun}s in that batch", "1"),
            ("snapshot_seconds", f"solving the training {noun}s, one thread", "s"),
            ("fit_seconds", "fitting, without the snapshots", "s"),
            ("model_bytes", "memory of the online stage", "byte"),
            ("floor_seconds", "fewest bytes of one answer over memory bandwidth", "s"),
            ("batch_floor_seconds", "operations of the batch product over the matrix-product rate", "s"),
            ("learned_cases", "training cases behind weights that come with the toolkit", "1")):
        variables[name] = ("entry", stacked(name), {"long_name": text, "units": unit})
    offline = stacked("snapshot_seconds") + stacked("fit_seconds")
    variables["offline_seconds"] = ("entry", offline, {"long_name": "snapshots and fitting", **s})
    solvers = [i for i, entry in enumerate(entries) if entry.kind.full_order]
    medians = {name: _medians(variables[f"{name}_seconds"][1]) for name in ("online", "batch", "output", "predict")}
    for name, seconds in medians.items():
        stem = "" if name == "online" else f"{name}_"
        least = min((seconds[i] for i in solvers), default=np.nan)
        variables[f"{stem}speedup"] = ("entry", least / seconds, {
            "long_name": "time of the fastest full-order method for the same workload over the method's", **one})
        variables[f"{stem}speedup_direct"] = ("entry", (seconds[solvers[0]] if solvers else np.nan) / seconds, {
            "long_name": "the same over the plain full-order method", **one})
    online = medians["online"]
    gain = min((online[i] for i in solvers), default=np.nan) - online
    repaid = np.divide(offline, gain, out=np.full(len(entries), np.inf), where=gain > 0)
    variables["break_even_cases"] = ("entry", repaid, {
        "long_name": f"{noun}s after which the offline cost is repaid, over the fastest full-order method", **one})
    return variables


def _medians(values: np.ndarray) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a scene without a part has no times of it
        return np.nanmedian(values, axis=1)
