"""Times of fitted entries: one case, a large batch, the pad alone, the labelled call; floors and break-even."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from rom.comparison.entries import Entry
from rom.comparison.held_out import SHARE
from rom.comparison.timing import interleaved, memory_bandwidth, product_rate
from rom.fullorder import blas_threads
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.validity import ValidityWarning
from rom.scenes import CaseArrays, Scene

BATCH = 2048
SLOW_BATCH = 8
"""Cases in a batch of a method that factorises, at two operating points, so that what can be shared is shared."""


def measure_times(entries: list[Entry], scene: Scene, arrays: CaseArrays, repeats: int, batch: int,
                  progress: Callable) -> dict[str, tuple]:
    """Time variables of the results; every method on the same cases, interleaved.

    Parameters
    ----------
    arrays : CaseArrays
        Held-out cases; at least ``repeats`` of them, or they are taken in turn.
    """
    # in random order: neighbours may share an operating point, and nobody's factor may serve the next case by chance
    arrays = arrays.take(np.random.default_rng(0).permutation(len(arrays)))
    n = len(arrays)
    single = [arrays.take(slice(i % n, i % n + 1)) for i in range(repeats)]
    labelled = [scene.cases_from(case) for case in single]
    names = [entry.label for entry in entries]
    slow = {entry.model: entry.method in SHARE for entry in entries}
    many = arrays.take(np.arange(batch) % n)
    some = arrays.take(np.arange(min(SLOW_BATCH, batch)) % n)
    if scene.harmonic:
        point = np.repeat(np.sort(np.unique(arrays.frequency, return_index=True)[1])[:2], len(some) // 2)
        some = replace(some, frequency=arrays.frequency[point], loss_factor=arrays.loss_factor[point])
    models = {entry.label: entry.model for entry in entries}

    def times(call: Callable, count: int, warm_up: int = 2) -> dict[str, np.ndarray]:
        return interleaved({name: partial(call, model) for name, model in models.items()}, count, warm_up, progress)

    # one case is answered on one thread: a second gains little there and stalls for milliseconds on a busy machine;
    # the direct solver keeps all its threads
    with blas_threads(1):
        online = times(lambda m, i: m.evaluate(single[i], "field"), repeats)
        output = times(lambda m, i: m.evaluate(single[i], "pad"), max(3, repeats // 2), 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ValidityWarning)  # errors are measured elsewhere
            called = times(lambda m, i: m.predict(labelled[i]), max(3, repeats // 3), 1)
        bandwidths = {entry.label: memory_bandwidth(entry.model.online_bytes) for entry in entries
                      if entry.model.online_bytes}
    floor, batch_floor = _floors(entries, scene, bandwidths)
    # answers go into arrays that exist, as an application would let them; methods of one type share one
    kinds = {model: model.evaluate(single[0], "field").dtype for model in slow}
    rooms = {(len(block), kind): np.full((len(block), scene.n_free), np.nan, dtype=kind)  # written: its memory is there
             for block in (some, many) for kind in set(kinds.values())}

    def answer_block(model: Metamodel, _: int) -> None:
        block = some if slow[model] else many
        model.evaluate(block, "field", rooms[len(block), kinds[model]])

    batches = times(answer_block, 3, 0)
    sizes = np.array([len(some) if slow[entry.model] else len(many) for entry in entries])

    def median(found: dict[str, np.ndarray]) -> np.ndarray:
        return np.array([np.median(found[name]) for name in names])

    one_case, per_case = median(online), median(batches) / sizes
    fit = np.array([entry.model.offline_seconds for entry in entries])
    snapshots = np.array([entry.snapshot_seconds for entry in entries])
    direct = names.index("direct") if "direct" in names else None
    def ratio(seconds: np.ndarray) -> np.ndarray:
        return np.full(len(names), np.nan) if direct is None else seconds[direct] / seconds
    gain = one_case[direct] - one_case if direct is not None else np.full(len(names), np.nan)
    break_even = np.divide(fit + snapshots, gain, out=np.full(len(names), np.inf), where=gain > 0)
    s = {"units": "s"}
    return {
        "online_seconds": (("entry", "repeat"), np.array([online[name] for name in names]), {
            "long_name": "wall time of one case, full field", **s}),
        "output_seconds": ("entry", median(output), {"long_name": "wall time of one case, pad surface only", **s}),
        "call_seconds": ("entry", np.maximum(median(called) - one_case, 0.0), {
            "long_name": "what the labelled call adds for one case", **s}),
        "batch_seconds": ("entry", per_case, {"long_name": "wall time of a case in a large batch, full field", **s}),
        "batch_size": ("entry", sizes, {"long_name": "cases in that batch", "units": "1"}),
        "snapshot_seconds": ("entry", snapshots, {"long_name": "solving the training cases", **s}),
        "fit_seconds": ("entry", fit, {"long_name": "fitting, without the snapshots", **s}),
        "offline_seconds": ("entry", fit + snapshots, {"long_name": "snapshots and fitting", **s}),
        "model_bytes": ("entry", np.array([entry.model.model_bytes for entry in entries]), {
            "long_name": "memory of the online stage", "units": "byte"}),
        "floor_seconds": ("entry", floor, {"long_name": "fewest bytes of one answer over memory bandwidth", **s}),
        "batch_floor_seconds": ("entry", batch_floor, {
            "long_name": "operations of the batch product over the matrix-product rate", **s}),
        "speedup": ("entry", ratio(one_case), {"long_name": "median of direct over median of the method, one case",
                                               "units": "1"}),
        "batch_speedup": ("entry", ratio(per_case), {"long_name": "the same in a batch", "units": "1"}),
        "output_speedup": ("entry", ratio(median(output)), {"long_name": "the same, pad only", "units": "1"}),
        "break_even_cases": ("entry", break_even, {"long_name": "cases after which the offline cost is repaid",
                                                   "units": "1"}),
    }


def _floors(entries: list[Entry], scene: Scene, bandwidths: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Least times that the memory and the arithmetic of this machine allow; NaN where a method states none.

    Parameters
    ----------
    bandwidths : dict of float [byte/s]
        At which one thread reads a matrix of each entry's size: a small basis stays in the processor's cache.
    """
    n_bytes = np.array([float(entry.model.online_bytes) for entry in entries])
    floor, batch = np.full(len(entries), np.nan), np.full(len(entries), np.nan)
    rates = {kind: product_rate(kind) for kind in ("float32", "float64")}
    for i, entry in enumerate(entries):
        if not n_bytes[i]:
            continue
        floor[i] = n_bytes[i] / bandwidths[entry.label]
        kind = entry.model.settings.get("precision", "float64")
        width = 4 if kind == "float32" else 8
        parts = 2 if scene.harmonic else 1
        batch[i] = 2.0 * parts * (n_bytes[i] / width) / rates[kind]
    return floor, batch
