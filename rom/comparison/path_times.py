"""Times of fitted entries on whole load paths: one path, a batch, contact quantities alone, the labelled call."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial

import numpy as np

from rom.comparison.entries import Entry
from rom.comparison.path_entries import SLOW
from rom.comparison.timing import interleaved
from rom.fullorder import blas_threads
from rom.metamodels.validity import ValidityWarning
from rom.scenes import FingerOnGlass, PathArrays

BATCH = 64


def measure_times(entries: list[Entry], scene: FingerOnGlass, paths: PathArrays, repeats: int, progress: Callable
                  ) -> dict[str, tuple]:
    """Time variables of the results: one whole path, in a batch, contact quantities alone; methods interleaved."""
    paths = paths.take(np.random.default_rng(0).permutation(len(paths)))
    single = [paths.take(slice(i % len(paths), i % len(paths) + 1)) for i in range(repeats)]
    labelled = [scene.cases_from(one) for one in single]
    models = {entry.label: entry.model for entry in entries}
    sizes = np.array([1 if entry.method in SLOW else BATCH for entry in entries])
    many = {entry.label: paths.take(np.arange(size) % len(paths)) for entry, size in zip(entries, sizes, strict=True)}

    def times(call: Callable, count: int, warm_up: int = 1) -> np.ndarray:
        found = interleaved({name: partial(call, name) for name in models}, count, warm_up, progress)
        return np.array([found[name] for name in models])

    with blas_threads(1), warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)  # errors are measured elsewhere
        online = times(lambda name, i: models[name].evaluate(single[i], outputs="field"), repeats)
        output = np.median(times(lambda name, i: models[name].evaluate(single[i], outputs="contact"), 3, 0), axis=1)
        called = np.median(times(lambda name, i: models[name].predict(labelled[i]), 3, 0), axis=1)
        block = times(lambda name, _: models[name].evaluate(many[name], outputs="field"), 3, 0)
    batch = np.median(block, axis=1) / sizes
    one_case = np.median(online, axis=1)
    direct = [entry.method for entry in entries].index("direct")
    fit = np.array([entry.model.offline_seconds for entry in entries])
    snapshots = np.array([entry.snapshot_seconds for entry in entries])
    gain = one_case[direct] - one_case
    break_even = np.divide(fit + snapshots, gain, out=np.full(len(entries), np.inf), where=gain > 0)
    s, one = {"units": "s"}, {"units": "1"}
    return {
        "online_seconds": (("entry", "repeat"), online, {"long_name": "wall time of one path, all positions", **s}),
        "output_seconds": ("entry", output, {"long_name": "the same, contact quantities alone", **s}),
        "call_seconds": ("entry", np.maximum(called - one_case, 0.0), {
            "long_name": "what the labelled call adds for one path", **s}),
        "batch_seconds": ("entry", batch, {"long_name": "wall time of a path in a batch", **s}),
        "batch_size": ("entry", sizes, {"long_name": "paths in that batch", **one}),
        "snapshot_seconds": ("entry", snapshots, {"long_name": "following the training paths", **s}),
        "fit_seconds": ("entry", fit, {"long_name": "fitting, without the training paths", **s}),
        "offline_seconds": ("entry", fit + snapshots, {"long_name": "training paths and fitting", **s}),
        "model_bytes": ("entry", np.array([entry.model.model_bytes for entry in entries]), {
            "long_name": "memory of the online stage", "units": "byte"}),
        "speedup": ("entry", one_case[direct] / one_case, {
            "long_name": "median of direct over median of the method, one path", **one}),
        "batch_speedup": ("entry", batch[direct] / batch, {"long_name": "the same in a batch", **one}),
        "output_speedup": ("entry", output[direct] / output, {
            "long_name": "the same, contact quantities alone", **one}),
        "break_even_cases": ("entry", break_even, {"long_name": "paths after which the offline cost is repaid", **one}),
    }
