"""Measurements of fitted entries: errors on held-out cases, times, floors, certificates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.entries import Entry, Truth
from rom.comparison.errors import energy_errors, relative_errors, statistics
from rom.comparison.timing import interleaved, memory_bandwidth, product_rate
from rom.datasets import SPLITS, select
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.fullorder import blas_threads
from rom.metamodels.metamodel import CertifiedMetamodel, Metamodel
from rom.provenance import source_digest
from rom.scenes import CaseArrays, Scene

BATCH = 2048
SHARE = {"direct": 32, "direct-reused": 32, "coarse-fem": 4}
"""One held-out operating point in so many is evaluated where each costs a factorization: `direct` is the truth itself,
and the error of a coarse mesh varies little. All other methods answer every held-out case."""
SLOW_BATCH = 8
"""Cases in a batch of a method that factorises, at two operating points, so that what can be shared is shared."""


def measure_errors(entries: list[Entry], scene: Scene, truth: Truth, values: np.ndarray, arrays: CaseArrays,
                   cases: np.ndarray, progress: Callable) -> dict[str, tuple]:
    """Error variables of the results.

    Parameters
    ----------
    values : (n_case, n_free) ndarray [m]
        True answers of the held-out cases.
    arrays : CaseArrays
        Their inputs.
    cases : (n_case,) ndarray of int
        Their positions in the truth.
    """
    n_entry, n_case, n_region = len(entries), len(cases), len(scene.regions)
    error = np.full((n_entry, len(SPLITS), n_case), np.nan)
    stats = np.full((3, n_entry, len(SPLITS)), np.nan)
    projection = np.full((n_entry, len(SPLITS)), np.nan)
    by_region = np.full((n_entry, n_region), np.nan)
    worst, evaluated = np.full((2, n_entry, len(SPLITS)), -1)
    effectivity = np.full((3, n_entry), np.nan)
    region = truth.index["hard_region"].values[cases]
    for i, entry in enumerate(progress(entries)):
        # neighbours in the sampling share an operating point, hence a factorization
        share = (cases // 8) % SHARE.get(entry.method, 1) == 0
        for j, split in enumerate(SPLITS):
            tested = np.isin(cases, select(truth.index, split, "test"))
            rows = np.flatnonzero(tested & share if (tested & share).any() else tested)
            evaluated[i, j] = len(rows)
            found = _entry_errors(entry, split, scene, truth, values[rows], arrays.take(rows))
            error[i, j, rows] = found["error"]
            stats[:, i, j] = statistics(found["error"])
            worst[i, j] = cases[rows[np.argmax(found["error"])]]
            projection[i, j] = found["projection"].max(initial=-np.inf) if len(found["projection"]) else np.nan
            if j == 0 and len(found["effectivity"]):
                ratio = found["effectivity"]
                effectivity[:, i] = ratio.min(), np.median(ratio), ratio.max()
        for k in range(n_region):
            inside = error[i, -1, region == k + 1]
            by_region[i, k] = np.nan if np.isnan(inside).all() else np.nanmax(inside)
    maximum, p95, median = stats
    one = {"units": "1"}
    return {
        "error_max": (("entry", "split"), maximum, {"long_name": "largest relative error over held-out cases", **one}),
        "error_p95": (("entry", "split"), p95, {"long_name": "95 % quantile of the relative error", **one}),
        "error_median": (("entry", "split"), median, {"long_name": "median relative error", **one}),
        "error_by_region": (("entry", "region"), by_region, {
            "long_name": "largest relative error in a part of the hard split", **one}),
        "case_error": (("entry", "split", "case"), error, {"long_name": "relative error of a held-out case", **one}),
        "worst_case": (("entry", "split"), worst, {"long_name": "case of the largest error", **one}),
        "n_evaluated": (("entry", "split"), evaluated, {"long_name": "held-out cases that were evaluated", **one}),
        "projection_error_max": (("entry", "split"), projection, {
            "long_name": "largest relative error of the best approximation in the method's own basis", **one}),
        **{f"effectivity_{name}": ("entry", effectivity[k], {
            "long_name": f"{name} of bound over true energy error", **one})
            for k, name in enumerate(("min", "median", "max"))},
    }


def _entry_errors(entry: Entry, split: str, scene: Scene, truth: Truth, values: np.ndarray, arrays: CaseArrays
                  ) -> dict[str, np.ndarray]:
    """Errors of one model, found again where the model and the truth are the same."""
    path = cached_path("errors", {"model": entry.keys[split], "truth": truth.key, "split": split,
                                  "source": source_digest("comparison/errors.py", "comparison/measure.py")})
    if path.exists():
        data = read_netcdf(path)
        return {name: data[name].values for name in ("error", "projection", "effectivity")}
    model = entry.models[split]
    answers = model.evaluate(arrays, "field")
    best = model.best_approximation(values)
    found = {"error": relative_errors(answers, values),
             "projection": np.empty(0) if best is None else relative_errors(best, values), "effectivity": np.empty(0)}
    if isinstance(model, CertifiedMetamodel):
        found["effectivity"] = model.error_bound(arrays) / energy_errors(answers, values, scene.full_order.stiffness)
    write_netcdf(xr.Dataset({name: (f"{name}_case", array) for name, array in found.items()}), path)
    return found


def measure_times(entries: list[Entry], scene: Scene, arrays: CaseArrays, repeats: int, batch: int,
                  progress: Callable) -> dict[str, tuple]:
    """Time variables of the results; every method on the same cases, interleaved.

    Parameters
    ----------
    arrays : CaseArrays
        Held-out cases; at least ``repeats`` of them, or they are taken in turn.
    """
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


def worst_fields(entries: list[Entry], scene: Scene, values: np.ndarray, arrays: CaseArrays,
                 error: np.ndarray) -> xr.Dataset:
    """Truth and answer on the skin at the worst held-out case of the published split, for each headline entry."""
    mesh = scene.fingertip.mesh
    skin = mesh.skin_nodes
    headline = [i for i, entry in enumerate(entries) if entry.headline]
    truth: list[np.ndarray] = []
    answer: list[np.ndarray] = []
    rows = [int(np.nanargmax(error[i, 0])) for i in headline]
    for i, row in zip(headline, rows, strict=True):
        one = arrays.take(slice(row, row + 1))
        for found, field in ((truth, values[row]), (answer, entries[i].model.evaluate(one, "field")[0])):
            full = np.zeros(3 * len(mesh.nodes), dtype=scene.dtype)
            full[scene.fingertip.free_dofs] = field
            found.append(full.reshape(-1, 3)[skin])
    metres = {"units": "m"}
    return xr.Dataset({
        "worst_truth": (("worst", "skin_node", "component"), np.array(truth), {
            "long_name": "displacement of the full-order model", **metres}),
        "worst_answer": (("worst", "skin_node", "component"), np.array(answer), {
            "long_name": "displacement of the metamodel", **metres}),
        "worst_error": ("worst", error[headline, 0, rows], {"long_name": "relative error over the whole field",
                                                            "units": "1"}),
        "worst_load_node": ("worst", mesh.pad_nodes[arrays.node[rows, 0]], {"long_name": "first loaded node",
                                                                             "units": "1"}),
        "skin_quads": (("skin_quad", "corner"), np.searchsorted(skin, mesh.skin_quads), {
            "long_name": "corners of the skin's faces", "units": "1"}),
    }, coords={
        "worst": [entries[i].label for i in headline], "component": ["x", "y", "z"],
        **{f"skin_{axis}": ("skin_node", mesh.nodes[skin, k], {"long_name": f"{axis} of a skin node", **metres})
           for k, axis in enumerate("xyz")}})
