"""How errors grow with fewer snapshots: every learner on parts of the same training cases, judged on the same ones."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from full_scale.contenders import Contenders
from rom.comparison.entries import Entry
from rom.comparison.truth import held_out_tests, take
from rom.datasets import SPLITS, read_dataset, select
from rom.metamodels import Metamodel, create
from rom.metamodels.networks.sizes import constructor_settings
from rom.relative import relative_errors
from rom.scenes import LinearScene

log = logging.getLogger(__name__)

SHARES = (0.125, 0.35, 1.0)


def study(contenders: Contenders, progress: Callable) -> xr.Dataset:
    """Largest and median error of each learner's headline over held-out cases, and training time, by snapshots."""
    scene, truth = contenders.scene, contenders.truth
    learners = [entry for entry in contenders.entries if entry.headline and entry.kind.learns]
    training = select(truth.index, SPLITS[0], "train")
    counts = [round(share * len(training)) for share in SHARES]
    order = np.random.default_rng([truth.seed, 41]).permutation(training)
    tests = held_out_tests(scene, truth)
    rows = np.flatnonzero(tests.tested[SPLITS[0]])
    arrays, values = tests.arrays.take(rows), take(tests.values, rows)
    found = np.full((3, len(learners), len(counts)), np.nan)
    for k in progress(range(len(counts)), "fewer snapshots"):
        data = read_dataset(truth.path, np.sort(order[:counts[k]]))
        for i, entry in enumerate(learners):
            model = _fit(entry, scene, data)
            if model is not None:
                error = relative_errors(model.evaluate(arrays, "field"), values)
                found[:, i, k] = error.max(), np.median(error), model.offline_seconds
    names = {"error_max": ("largest relative error over held-out cases", "1"),
             "error_median": ("median relative error", "1"), "fit_seconds": ("fitting", "s")}
    return xr.Dataset({f"fewer_{name}": (("learner", "snapshots"), found[k], {"long_name": words, "units": unit})
                       for k, (name, (words, unit)) in enumerate(names.items())},
                      coords={"learner": [entry.method for entry in learners], "snapshots": counts})


def _fit(entry: Entry, scene: LinearScene, data: xr.Dataset) -> Metamodel | None:
    """A model fitted to few snapshots; of all the rank that they span where they do not span the one asked for."""
    settings: dict[str, Any] = constructor_settings(entry.method, entry.settings)
    for chosen in (settings, {name: value for name, value in settings.items() if name != "rank"}):
        try:
            return create(entry.method, scene.afresh(), **chosen).fit(data)
        except ValueError as problem:
            log.info("%s cannot learn from %d snapshots: %s", entry.method, data.sizes["case"], problem)
    return None
