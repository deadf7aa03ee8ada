"""Every metamodel of a contact scene on the same held-out load paths, in the results that the linear scenes have too.

A case is a whole path. Its error is the largest displacement error over its positions; contact quantities are judged
apart.
"""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.path_entries import SOURCES, fit_entries
from rom.comparison.path_errors import DEFINITIONS, QUANTITIES, displacement_errors
from rom.comparison.path_held_out import measure_errors, worst_paths
from rom.comparison.path_times import measure_times
from rom.comparison.settings import NOT_APPLICABLE, Curve
from rom.comparison.timing import threads_in_use
from rom.datasets import SPLITS, select
from rom.datasets.storage import whole_file
from rom.finger_on_glass.tissue import VARIANTS
from rom.metamodels import create, metamodel_class
from rom.provenance import machine, source_digest, stamp
from rom.scenes import FingerOnGlass, PathArrays

FLOOR_SCALE, FLOOR_PATHS = 1.6, 4
"""The finer mesh, and the number of paths on it, that measure the mesh-convergence floor."""


def compare_paths(scene: FingerOnGlass, curves: dict[str, Curve], data: xr.Dataset, key: str, *, repeats: int,
                  seed: int, progress: Callable) -> xr.Dataset:
    """Fit, predict and time every method on stored paths.

    Parameters
    ----------
    scene : FingerOnGlass
    curves : dict of Curve
        Settings of each method.
    data : xr.Dataset
        Paths with their splits, see :mod:`rom.datasets.contact_paths`.
    key : str
        Identifies them in cache recipes.
    repeats, seed : int
    progress : callable
        Wraps iterations, with a name.

    Returns
    -------
    xr.Dataset
        With the dimensions of every comparison (entry, split, repeat, case, region) and those of paths (position,
        quantity).
    """
    entries, omitted = fit_entries(scene, curves, data, key, seed, lambda items: progress(items, "fitting"))
    held_out = np.unique(np.concatenate([select(data, split, "test") for split in SPLITS]))
    tests = data.isel(path=held_out)
    paths = scene.case_arrays(tests)
    errors, states = measure_errors(entries, scene, data, tests, held_out, key, lambda items: progress(items, "errors"))
    published = paths.take(np.isin(held_out, select(data, "published", "test")))
    results = xr.Dataset({**errors, **measure_times(entries, scene, published, repeats,
                                                    lambda items: progress(items, "timing"))}, coords={
        "entry": [entry.label for entry in entries], "method": ("entry", [entry.method for entry in entries]),
        "setting": ("entry", [entry.setting for entry in entries]),
        "headline": ("entry", [entry.headline for entry in entries]), "split": list(SPLITS),
        "region": list(scene.regions), "quantity": list(QUANTITIES), "case": held_out,
        "variant": ("case", [VARIANTS[v] for v in paths.variant]),
        **{name: ("case", tests[name].values, tests[name].attrs) for name in
           ("c", "k1", "friction", "normal_force", "hard_region", "split_published", "split_hard")},
        **scene.position_coordinates()})
    results = results.merge(worst_paths(entries, scene, tests, paths, states)).assign(mesh_floor(scene, tests, paths))
    results.attrs = {**attributes(scene, curves, data, omitted), "seed": seed,
                     **stamp(created=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"))}
    return results


def mesh_floor(scene: FingerOnGlass, tests: xr.Dataset, paths: PathArrays) -> dict[str, tuple]:
    """How far the truth itself is from a finer mesh: errors below this are not more right.

    Paths with random fibres are left out: another mesh draws other angles.
    """
    fixed = np.flatnonzero((paths.variant != VARIANTS.index("random")) & tests["reached"].values.all(axis=1))
    pick = fixed[np.linspace(0, len(fixed) - 1, min(FLOOR_PATHS, len(fixed))).astype(int)]
    recipe = {"content": scene.content_hash, "scale": FLOOR_SCALE, "paths": [a[pick].tolist() for a in paths],
              "source": source_digest(*SOURCES)}
    file = cached_path("floors", recipe, ".json")
    if file.exists():
        error = np.array(json.loads(file.read_text(encoding="utf-8")))
    else:
        finer = create("coarse-fem", scene, scale=FLOOR_SCALE).fit()
        answer = finer.evaluate(paths.take(pick), outputs="field")["displacement"]
        truth = tests["displacement"].values[pick]
        error = displacement_errors(answer, truth, np.ones(truth.shape[:2], dtype=bool)).max(axis=1)
        with whole_file(file) as temporary:
            temporary.write_text(json.dumps(error.tolist()), encoding="utf-8")
    text = f"largest displacement difference along a path to a mesh {FLOOR_SCALE:g} times as fine along each edge"
    return {f"mesh_floor_{name}": ((), float(kind(error)), {"long_name": f"{name} of the {text}", "units": "1"})
            for name, kind in (("median", np.median), ("max", np.max))}


def attributes(scene: FingerOnGlass, curves: dict[str, Curve], data: xr.Dataset, omitted: list[str]) -> dict:
    """Global attributes of the results."""
    counts = {part: {split: len(select(data, split, part)) for split in SPLITS} for part in ("train", "test")}
    ended = int((~data["reached"].values.all(axis=1)).sum())
    return {
        "scene": scene.name, "title": scene.title, "question": scene.question, "gate": scene.gate,
        "partial_output": "contact quantities", "quantity_definitions": json.dumps(DEFINITIONS),
        "error_definition": "A case is a whole load path. Error of a case: the largest over its positions of the "
                            "length of the difference over the length of the true displacement, over all nodes.",
        "scene_needs": json.dumps(scene.needs), "scene_leaves_out": json.dumps(scene.leaves_out),
        "method_summaries": json.dumps({name: metamodel_class(name, scene.name).summary for name in curves}),
        "not_applicable": json.dumps(NOT_APPLICABLE[scene.name]), "omitted": json.dumps(omitted), "machine": machine(),
        "threads": threads_in_use(), "backend": "Newton's method along the path, every step converged to 1e-8",
        "n_free": 2 * (scene.n_nodes - scene.mesh.rays) + 2, "n_nodes": scene.n_nodes, "n_paths_ended": ended,
        "n_train": json.dumps(counts["train"]), "n_test": json.dumps(counts["test"]),
        "scene_parameters": scene.to_json(), "scene_hash": scene.content_hash}
