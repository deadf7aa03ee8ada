"""Every metamodel of a scene on the same held-out cases: error, time, offline cost, in one dataset of results."""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.entries import Truth, fit_entries
from rom.comparison.errors import relative_errors
from rom.comparison.full_scale import full_scale
from rom.comparison.held_out import measure_errors, worst_fields
from rom.comparison.settings import COMPARED, CURVES, NOT_APPLICABLE, QUICK_CURVES, Curve
from rom.comparison.times import BATCH, measure_times
from rom.comparison.timing import threads_in_use
from rom.datasets import SPLITS, make_dataset, read_dataset, select
from rom.datasets.storage import whole_file, write_netcdf
from rom.fingertip import Fingertip, MeshDensity
from rom.metamodels import create, metamodel_class
from rom.provenance import machine, source_digest, stamp
from rom.scenes import CONTACT_SCENES, CaseArrays, Scene, get_scene

SEED = 2026
"""Default seed of a comparison: nothing that learns was designed or tuned on its held-out cases."""
CASES, REPEATS = 1434, 15
"""Default numbers of cases within the published ranges (6 x 239; a tenth more lie beyond) and of timed repeats."""
QUICK_CASES, QUICK_REPEATS, QUICK_BATCH = 240, 5, 256
QUICK_DENSITY = MeshDensity((6, 6), 3, 2, (1, 1, 1, 2))
PATHS, QUICK_PATHS, LEAST_PATHS = 240, 18, 15
"""Numbers of load paths within the ranges, a third of them of each variant; a tenth more lie beyond."""
PATH_SEED = 4817
"""Default seed of a comparison of load paths: features and settings of what learns there were chosen on other seeds."""
QUICK_SECTION: dict[str, Any] = {"rays": 40, "layers": 5}
FLOOR_SCALE, FLOOR_CASES = 1.25, 4
"""The finer mesh, and the number of cases on it, that measure the mesh-convergence floor."""
Progress = Callable[[Iterable, str], Iterable]


def no_progress(items: Iterable, _: str) -> Iterable:
    """Show nothing."""
    return items


def compare(scene_name: str, *, methods: list[str] | None = None, cases: int | None = None, quick: bool = False,
            seed: int | None = None, fingertip: Fingertip | None = None,
            progress: Progress = no_progress) -> xr.Dataset:
    """Fit, predict and time every method of a scene.

    Parameters
    ----------
    scene_name : str
    methods : list of str, optional
        Default: all that apply; `direct` always joins, as the baseline.
    cases : int, optional
        Cases within the published ranges, training and held-out together.
    quick : bool
        A coarse mesh and few cases: a check that everything runs, not a result.
    seed : int, optional
        Decides cases, splits and networks; default :data:`SEED`.
    fingertip : Fingertip, optional
        Default: the `metamodel` preset.

    Returns
    -------
    xr.Dataset
        See the README for its dimensions and variables.

    Raises
    ------
    ValueError
        For an unknown scene or method, or one that does not apply to the scene.
    """
    curves = chosen_curves(scene_name, methods, quick)
    if scene_name in CONTACT_SCENES:
        if fingertip is not None:
            raise ValueError(f"{scene_name} has a section of its own and takes no 3D fingertip: leave it out")
        return _compare_contact(scene_name, curves, cases, quick, PATH_SEED if seed is None else seed, progress)
    if fingertip is None:
        fingertip = Fingertip.preset("metamodel")
        if quick:
            fingertip = replace(fingertip, density=QUICK_DENSITY)
    scene = get_scene(scene_name, fingertip)
    seed = SEED if seed is None else seed
    if cases is None:
        cases = QUICK_CASES if quick else CASES
    if cases < 10:
        raise ValueError(f"{cases} cases are too few to learn from and to hold out: ask for ten or more")
    beyond = beyond_count(cases)
    truth = find_truth(scene, cases, beyond, seed, progress)
    entries, omitted = fit_entries(scene, curves, truth, lambda items: progress(items, "fitting"))
    held_out = truth.held_out()
    tests = read_dataset(truth.path, held_out)
    arrays, values = scene.case_arrays(tests), scene.values(tests)
    errors = measure_errors(entries, scene, truth, values, arrays, held_out, lambda items: progress(items, "errors"))
    published = np.isin(held_out, select(truth.index, "published", "test"))
    times = measure_times(entries, scene, arrays.take(published), QUICK_REPEATS if quick else REPEATS,
                          QUICK_BATCH if quick else BATCH, lambda items: progress(items, "timing"))
    results = xr.Dataset({**errors, **times, **mesh_floor(scene, arrays.take(published), values[published])}, coords={
        "entry": [entry.label for entry in entries], "method": ("entry", [entry.method for entry in entries]),
        "setting": ("entry", [entry.setting for entry in entries]),
        "headline": ("entry", [entry.headline for entry in entries]),
        "split": list(SPLITS), "region": list(scene.regions), **_case_coordinates(tests, held_out)})
    if scene.harmonic:
        results["natural_frequency"] = ("natural_mode", natural_frequencies(scene), {
            "long_name": "natural frequency", "units": "Hz"})
    results = results.merge(worst_fields(entries, scene, values, arrays, results["case_error"].values))
    results = results.merge(full_scale(entries, scene, truth, progress))
    results.attrs = {**_attributes(scene, curves, truth, omitted), "seed": seed, "quick": int(quick),
                     **stamp(created=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"))}
    return results


def _compare_contact(scene_name: str, curves: dict[str, Curve], cases: int | None, quick: bool, seed: int,
                     progress: Progress) -> xr.Dataset:
    from rom.comparison.paths import compare_paths
    from rom.datasets.contact_paths import find_paths, read_path_dataset

    scene = get_scene(scene_name, **(QUICK_SECTION if quick else {}))
    if cases is None:
        cases = QUICK_PATHS if quick else PATHS
    if cases < LEAST_PATHS:
        raise ValueError(f"{cases} paths are too few to learn from and to hold out: ask for {LEAST_PATHS} or more")
    path = find_paths(scene, cases, max(3, cases // 10), seed, progress=lambda items: progress(items, "paths"))
    results = compare_paths(scene, curves, read_path_dataset(path), path.stem, seed=seed, progress=progress,
                            repeats=QUICK_REPEATS if quick else REPEATS)
    results.attrs["quick"] = int(quick)
    return results


def chosen_curves(scene_name: str, methods: list[str] | None, quick: bool) -> dict[str, Curve]:
    """Settings of the methods asked for; ValueError for one that is unknown or does not apply."""
    if scene_name not in COMPARED:
        raise ValueError(f"{scene_name!r} is no scene that is compared: choose one of {', '.join(COMPARED)}")
    curves = (QUICK_CURVES if quick else CURVES)[scene_name]
    if methods is None:
        return curves
    for name in methods:
        metamodel_class(name)  # refuses what is no method
        if name not in curves:
            reason = NOT_APPLICABLE[scene_name].get(name, "it is not part of this comparison")
            raise ValueError(f"{name} does not apply to {scene_name}: {reason}")
    return {name: curve for name, curve in curves.items() if name in methods or name == "direct"}


def find_truth(scene: Scene, cases: int, beyond: int, seed: int, progress: Progress) -> Truth:
    """The truth of a scene from the cache, made if it is not there."""
    path = truth_path(scene, cases, beyond, seed)
    if not path.exists():
        make_dataset(scene, cases, path, beyond=beyond, seed=seed, progress=lambda items: progress(items, "snapshots"))
    return Truth(path, path.stem, seed)


def truth_path(scene: Scene, cases: int, beyond: int, seed: int) -> Path:
    """Where in the cache a scene's truth lies, or would lie."""
    recipe = {"scene": scene.to_json(), "content": scene.content_hash, "cases": cases, "beyond": beyond, "seed": seed,
              "source": source_digest("fullorder", "fingertip", "scenes", "datasets")}
    return cached_path("datasets", recipe)


def beyond_count(cases: int) -> int:
    """Number of cases beyond the published ranges that go with ``cases`` within them."""
    return max(8, cases // 10)


def mesh_floor(scene: Scene, arrays: CaseArrays, values: np.ndarray) -> dict[str, tuple]:
    """How far the truth itself is from a finer mesh: errors below this are not more right."""
    pick = np.linspace(0, len(arrays) - 1, min(FLOOR_CASES, len(arrays))).astype(int)
    recipe = {"content": scene.content_hash, "scene": scene.name, "scale": FLOOR_SCALE,
              "cases": [None if a is None else a[pick].tolist() for a in arrays],
              "source": source_digest("fullorder", "fingertip", "scenes", "metamodels/coarse_fem.py")}
    path = cached_path("floors", recipe, ".json")
    if path.exists():
        error = np.array(json.loads(path.read_text(encoding="utf-8")))
    else:
        finer = create("coarse-fem", scene, scale=FLOOR_SCALE).fit()
        error = relative_errors(finer.evaluate(arrays.take(pick), "field"), values[pick])
        with whole_file(path) as temporary:
            temporary.write_text(json.dumps(error.tolist()), encoding="utf-8")
    text = f"relative difference to a mesh {FLOOR_SCALE:g} times as fine along each edge"
    return {f"mesh_floor_{name}": ((), float(kind(error)), {"long_name": f"{name} {text}", "units": "1"})
            for name, kind in (("median", np.median), ("max", np.max))}


def natural_frequencies(scene: Scene) -> np.ndarray:
    """Natural frequencies within the scene's band [Hz]."""
    return scene.full_order.natural_modes(below_hz=scene.band_hz).frequency_hz


def _case_coordinates(tests: xr.Dataset, held_out: np.ndarray) -> dict[str, xr.Variable | np.ndarray]:
    names = ("load_node", "force_amplitude", "frequency", "loss_factor", "hard_region", "split_published", "split_hard")
    return {"case": held_out, **{name: tests[name].variable for name in names if name in tests}}


def _attributes(scene: Scene, curves: dict[str, Curve], truth: Truth, omitted: list[str]) -> dict:
    kind = "complex" if scene.harmonic else "real"
    counts = {part: {split: len(select(truth.index, split, part)) for split in SPLITS} for part in ("train", "test")}
    return {
        "scene": scene.name, "title": scene.title, "question": scene.question, "gate": scene.gate,
        "scene_needs": json.dumps(scene.needs), "scene_leaves_out": json.dumps(scene.leaves_out),
        "method_summaries": json.dumps({name: metamodel_class(name).summary for name in curves}),
        "not_applicable": json.dumps(NOT_APPLICABLE[scene.name]), "omitted": json.dumps(omitted),
        "machine": machine(), "threads": threads_in_use(),
        "backend": f"{scene.full_order.backend}, {kind} symmetric, symbolic phase reused",
        "n_free": scene.n_free, "n_nodes": len(scene.fingertip.mesh.nodes), "n_pad": scene.n_pad,
        "n_train": json.dumps(counts["train"]), "n_test": json.dumps(counts["test"]),
        "residual_max": float(truth.index["residual"].max()), "scene_parameters": scene.to_json(),
        "scene_hash": scene.content_hash, "mesh_hash": scene.fingertip.mesh.mesh_hash}


def write_results(results: xr.Dataset, folder: str | Path) -> Path:
    """Write ``results.nc`` into a folder and return its path."""
    path = Path(folder) / "results.nc"
    write_netcdf(results, path, compress=True)
    return path
