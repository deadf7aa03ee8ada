"""How errors grow with fewer snapshots: every learner on parts of the same training cases, judged on the same ones."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.entries import Entry, Truth
from rom.comparison.errors import relative_errors
from rom.comparison.settings import constructor_settings
from rom.datasets import SPLITS, read_dataset, select
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.metamodels import Metamodel, create, metamodel_class
from rom.provenance import source_digest
from rom.scenes import CaseArrays, Scene, get_scene

log = logging.getLogger(__name__)

SHARES = (0.125, 0.35, 1.0)


def study(entries: list[Entry], scene: Scene, truth: Truth, progress: Callable) -> xr.Dataset:
    """Largest and median error of each learner's headline over held-out cases, and training time, by snapshots."""
    learners = [_fitted_to_snapshots(entry, entries) for entry in entries
                if entry.headline and metamodel_class(entry.method).learns]
    training, tested = (select(truth.index, SPLITS[0], part) for part in ("train", "test"))
    counts = [round(share * len(training)) for share in SHARES]
    order = np.random.default_rng([truth.seed, 41]).permutation(training)
    tests = read_dataset(truth.path, tested)
    arrays, values = scene.case_arrays(tests), scene.values(tests)
    found = np.full((3, len(learners), len(counts)), np.nan)
    for k in progress(range(len(counts)), "fewer snapshots"):
        data = read_dataset(truth.path, np.sort(order[:counts[k]]))
        for i, entry in enumerate(learners):
            found[:, i, k] = _errors(entry, scene, truth, data, counts[k] == len(training), arrays, values)
    names = {"error_max": ("largest relative error over held-out cases", "1"),
             "error_median": ("median relative error", "1"), "fit_seconds": ("fitting", "s")}
    return xr.Dataset({f"fewer_{name}": (("learner", "snapshots"), found[k], {"long_name": words, "units": unit})
                       for k, (name, (words, unit)) in enumerate(names.items())},
                      coords={"learner": [entry.method for entry in learners], "snapshots": counts})


def _fitted_to_snapshots(headline: Entry, entries: list[Entry]) -> Entry:
    """The entry of the same method that learned from the comparison's own snapshots with the headline's settings."""
    settings = constructor_settings(headline.method, headline.settings)
    return next((entry for entry in entries if entry.method == headline.method and not entry.trained
                 and entry.settings == settings), headline)


def _errors(entry: Entry, scene: Scene, truth: Truth, data: xr.Dataset, every: bool, arrays: CaseArrays,
            values: np.ndarray) -> np.ndarray:
    """(3,) ndarray: largest and median error, seconds; NaN where so few snapshots cannot be learned from."""
    count = data.sizes["case"]
    path = cached_path("errors", {"fewer": count, "model": entry.keys[SPLITS[0]], "truth": truth.key,
                                  "source": source_digest("comparison/errors.py", "comparison/full_scale")})
    if not path.exists():
        model = entry.model if every and not entry.trained else _fit(entry, scene, data)
        row = [np.nan] * 3
        if model is not None:
            error = relative_errors(model.evaluate(arrays, "field"), values)
            row = [error.max(), np.median(error), model.offline_seconds]
        write_netcdf(xr.Dataset({"row": ("value", np.array(row))}), path)
    return read_netcdf(path)["row"].values


def _fit(entry: Entry, scene: Scene, data: xr.Dataset) -> Metamodel | None:
    """A model fitted to few snapshots; of all the rank that they span where they do not span the one asked for."""
    settings = constructor_settings(entry.method, entry.settings)
    own = get_scene(scene.name, scene.fingertip, scene.outputs)
    for chosen in (settings, {name: value for name, value in settings.items() if name != "rank"}):
        try:
            return create(entry.method, own, **chosen).fit(data)
        except ValueError as problem:
            log.info("%s cannot learn from %d snapshots: %s", entry.method, data.sizes["case"], problem)
    return None
