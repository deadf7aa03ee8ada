"""Errors of fitted entries on held-out cases, kept by content; the worst fields; the certificates' effectivity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.entries import Entry, Truth
from rom.comparison.errors import energy_errors, relative_errors, statistics
from rom.datasets import SPLITS, select
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.metamodels.metamodel import CertifiedMetamodel, Metamodel
from rom.provenance import source_digest
from rom.scenes import CaseArrays, Scene

BOUNDED_CASES = 64
"""Held-out cases, about, on which the bound of a method without a certificate of its own is measured."""
VISIBLE = 1e-9
"""Relative energy error above which an error is not the truth's own rounding."""
SHARE = {"direct": 32, "direct-reused": 32, "coarse-fem": 4}
"""One held-out operating point in so many is evaluated where each costs a factorization: `direct` is the truth itself,
and the error of a coarse mesh varies little. All other methods answer every held-out case."""


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
            if split not in entry.models:
                continue
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
                                  "source": source_digest("comparison/errors.py", "comparison/held_out.py")})
    if path.exists():
        data = read_netcdf(path)
        return {name: data[name].values for name in ("error", "projection", "effectivity")}
    model = entry.models[split]
    answers = model.evaluate(arrays, "field")
    best = model.best_approximation(values)
    found = {"error": relative_errors(answers, values),
             "projection": np.empty(0) if best is None else relative_errors(best, values), "effectivity": np.empty(0)}
    found["effectivity"] = _effectivity(model, scene, values, answers, arrays)
    write_netcdf(xr.Dataset({name: (f"{name}_case", array) for name, array in found.items()}), path)
    return found


def _effectivity(model: Metamodel, scene: Scene, values: np.ndarray, answers: np.ndarray, arrays: CaseArrays
                 ) -> np.ndarray:
    """Bound over true energy error of the cases whose error stands out from rounding; empty where none is bounded."""
    certified = isinstance(model, CertifiedMetamodel)
    # the bound of all others takes a static solve a case
    rows = slice(None) if certified else slice(None, None, max(1, len(arrays) // BOUNDED_CASES))
    stiffness = scene.full_order.stiffness
    true = values[rows]
    made, size = (energy_errors(other, true, stiffness) for other in (answers[rows], np.zeros_like(true)))
    visible = made > VISIBLE * size
    if model.name in SHARE or not visible.any():
        return np.empty(0)
    block = arrays.take(rows)
    bound = model.error_bound(block) if isinstance(model, CertifiedMetamodel) else size * model.assess(
        block, answers[rows]).error
    return bound[visible] / made[visible]


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
            found.append(scene.on_all_nodes(field[None])[0, skin])
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
