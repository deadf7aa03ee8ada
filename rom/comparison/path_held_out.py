"""Errors of fitted entries on held-out load paths, kept by content; the worst of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.entries import Entry
from rom.comparison.errors import statistics
from rom.comparison.path_entries import SLOW
from rom.comparison.path_errors import QUANTITIES, contact_errors, displacement_errors
from rom.datasets import SPLITS, select
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.provenance import source_digest
from rom.scenes import FingerOnGlass, PathArrays


def measure_errors(entries: list[Entry], scene: FingerOnGlass, data: xr.Dataset, tests: xr.Dataset,
                   held_out: np.ndarray, key: str, progress: Callable) -> tuple[dict[str, tuple], np.ndarray]:
    """Error variables of the results, and the displacement error of every state (entry, split, case, position)."""
    n, n_case, n_position = len(entries), len(held_out), scene.n_positions
    state = np.full((n, len(SPLITS), n_case, n_position), np.nan)
    contact = np.full((n, len(SPLITS), n_case, len(QUANTITIES)), np.nan)
    basis = np.full((n, len(SPLITS)), np.nan)
    for i, entry in enumerate(progress(entries)):
        every = SLOW.get(entry.method, 1)
        for j, split in enumerate(SPLITS):
            rows = np.flatnonzero(np.isin(held_out, select(data, split, "test")))[::every]
            found = _entry_errors(entry, split, scene, tests.isel(path=rows), held_out[rows], key)
            state[i, j, rows], contact[i, j, rows] = found["state"].values, found["contact"].values
            basis[i, j] = float(found["projection"].values)
    path = _most(state, axis=-1)
    stats = np.array([[statistics(path[i, j][~np.isnan(path[i, j])]) for j in range(len(SPLITS))] for i in range(n)])
    region = tests["hard_region"].values
    by_region = np.stack([_most(path[:, -1, region == k + 1], axis=-1) for k in range(len(scene.regions))], axis=-1)
    filled = np.where(np.isnan(path), -1.0, path)
    one = {"units": "1"}
    middle = np.full((n, len(SPLITS), len(QUANTITIES)), np.nan)
    for i, j in np.ndindex(n, len(SPLITS)):
        known = contact[i, j][~np.isnan(contact[i, j]).all(axis=1)]
        if len(known):
            middle[i, j] = np.median(known, axis=0)
    return {
        "error_max": (("entry", "split"), stats[..., 0], {
            "long_name": "largest displacement error over positions and held-out paths", **one}),
        "error_p95": (("entry", "split"), stats[..., 1], {
            "long_name": "95 % quantile over paths of the largest error along a path", **one}),
        "error_median": (("entry", "split"), stats[..., 2], {
            "long_name": "median over paths of the largest error along a path", **one}),
        "error_by_region": (("entry", "region"), by_region, {
            "long_name": "largest displacement error in a part of the hard split", **one}),
        "case_error": (("entry", "split", "case"), path, {
            "long_name": "largest displacement error along a path", **one}),
        "position_error": (("entry", "split", "case", "position"), state, {"long_name": "displacement error", **one}),
        "contact_case_error": (("entry", "split", "case", "quantity"), contact, {
            "long_name": "largest error of a contact quantity along a path", **one}),
        "contact_error_max": (("entry", "split", "quantity"), _most(contact, axis=2), {
            "long_name": "largest error of a contact quantity over positions and held-out paths", **one}),
        "contact_error_median": (("entry", "split", "quantity"), middle, {
            "long_name": "median over paths of the largest error along a path", **one}),
        "worst_case": (("entry", "split"), held_out[filled.argmax(axis=-1)], {
            "long_name": "path of the largest error", **one}),
        "n_evaluated": (("entry", "split"), (~np.isnan(path)).sum(axis=-1), {
            "long_name": "held-out paths that were evaluated", **one}),
        "projection_error_max": (("entry", "split"), basis, {
            "long_name": "largest displacement error of the best approximation in the method's own basis", **one}),
    }, state


def _entry_errors(entry: Entry, split: str, scene: FingerOnGlass, tests: xr.Dataset, cases: np.ndarray, key: str
                  ) -> xr.Dataset:
    """Errors of one model, found again where the model and the truth are the same."""
    path = cached_path("errors", {"model": entry.keys[split], "truth": key, "cases": cases.tolist(),
                                  "source": source_digest("comparison/path_held_out.py", "comparison/path_errors.py")})
    if path.exists():
        return read_netcdf(path)
    model, paths = entry.models[split], scene.case_arrays(tests)
    truth = {str(name): tests[name].values for name in tests.data_vars if "position" in tests[name].dims}
    answers = model.evaluate(paths, outputs="field")
    best = model.best_approximation(paths, truth["displacement"])
    projection = np.nan if best is None else float(_most(displacement_errors(
        best, truth["displacement"], truth["reached"]), axis=None))
    found = xr.Dataset({
        "state": (("case", "position"), displacement_errors(answers["displacement"], truth["displacement"],
                                                             truth["reached"])),
        "contact": (("case", "quantity"), _most(contact_errors(answers, truth, paths.normal_force), axis=1)),
        "projection": ((), projection)})
    write_netcdf(found, path)
    return found


def _most(values: np.ndarray, axis: int | None) -> np.ndarray:
    """Largest of the values that are there; NaN where none is."""
    known = ~np.isnan(values)
    return np.where(known.any(axis=axis), np.where(known, values, -np.inf).max(axis=axis, initial=-np.inf), np.nan)


def worst_paths(entries: list[Entry], scene: FingerOnGlass, tests: xr.Dataset, paths: PathArrays, state: np.ndarray
                ) -> xr.Dataset:
    """Truth and answer at the worst held-out state of the published split, for each headline entry."""
    headline = [i for i, entry in enumerate(entries) if entry.headline]
    found: dict[str, list] = {name: [] for name in ("force_truth", "force_answer", "area_truth", "area_answer",
                                                    "section_truth", "section_answer", "position", "error")}
    for i in headline:
        errors = np.where(np.isnan(state[i, 0]), -1.0, state[i, 0])
        row, at = np.unravel_index(errors.argmax(), errors.shape)
        answer = entries[i].model.evaluate(paths.take(slice(row, row + 1)), outputs="field")
        for name, variable in (("force", "tangential_force"), ("area", "contact_area")):
            found[f"{name}_truth"].append(tests[variable].values[row])
            found[f"{name}_answer"].append(answer[variable][0])
        found["section_truth"].append(tests["displacement"].values[row, at])
        found["section_answer"].append(answer["displacement"][0, at])
        found["position"].append(at)
        found["error"].append(errors[row, at])
    units = {"force": "N", "area": "m2", "section": "m"}
    dims = {"force": ("worst", "position"), "area": ("worst", "position"),
            "section": ("worst", "section_node", "component")}
    words = {"force": "tangential force", "area": "contact area", "section": "displacement at the worst state"}
    return xr.Dataset({
        **{f"worst_{name}_{who}": (dims[name], np.array(found[f"{name}_{who}"]), {
            "long_name": f"{words[name]}, {text}", "units": units[name]})
           for name in units for who, text in (("truth", "full-order model"), ("answer", "metamodel"))},
        "worst_position": ("worst", np.array(found["position"]), {
            "long_name": "position of the worst state", "units": "1"}),
        "worst_error": ("worst", np.array(found["error"]), {"long_name": "displacement error there", "units": "1"}),
        "section_quads": (("section_quad", "corner"), scene.mesh.quads, {"long_name": "corners of the elements",
                                                                         "units": "1"})},
        coords={"worst": [entries[i].label for i in headline], "component": ["x", "y"],
                **{f"section_{axis}": ("section_node", 1e-3 * scene.mesh.nodes[:, k], {
                    "long_name": f"{axis} of a node", "units": "m"}) for k, axis in enumerate("xy")}})
