"""A hundred thousand held-out combinations of one to three static forces, and four and five forces beyond them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.entries import Entry
from rom.comparison.errors import relative_errors
from rom.comparison.full_scale.errors_by import Table, pad_places
from rom.comparison.held_out import SHARE
from rom.datasets import SPLITS, draw_combinations, superposed, unit_responses
from rom.datasets.snapshots import concatenate
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.metamodels import Metamodel
from rom.provenance import source_digest
from rom.scenes import CaseArrays, Scene

COUNT = 100_000
"""Held-out combinations that networks answer."""
SAMPLE = 4096
"""The first of them, that all other methods answer."""
BEYOND = 1024
"""Cases of four and five forces."""
REGIONS = ("every node in training", "unseen node", "four or five forces")


def study(entries: list[Entry], scene: Scene, seed: int, progress: Callable) -> xr.Dataset:
    """Error variables over held-out combinations.

    Parameters
    ----------
    entries : list of Entry
    scene : StaticPointForces
    seed : int
        Of the splits.
    progress : callable
        ``progress(items, title)`` shows a bar.
    """
    _, within = draw_combinations(scene, 0, seed, min(COUNT, round(0.2 * (scene.n_published or 0))))
    cases = concatenate(within, scene.sample_beyond(BEYOND, seed))
    forces = (cases.force != 0).sum(axis=1)
    # the hard split keeps nodes from training: any case that loads one is held out by it
    region = scene.hard_region(cases, seed)
    by = {"number_of_forces": np.arange(1, int(forces.max()) + 1), "pad_node": np.arange(scene.n_pad),
          "full_scale_region": np.arange(len(REGIONS))}
    table = Table(len(entries), len(SPLITS), by)
    responses = unit_responses(scene)
    rows = [(i, j) for i, entry in enumerate(entries) for j, split in enumerate(SPLITS)
            if (entry.trained or entry.headline) and split in entry.models and entry.method not in SHARE]
    for i, j in progress(rows, "all combinations, errors"):
        entry, split = entries[i], SPLITS[j]
        chosen = np.arange(len(cases))
        if not entry.trained:
            chosen = np.concatenate([chosen[:SAMPLE], chosen[len(within):]])
        error = _errors(entry, split, cases.take(chosen), responses)
        inside = forces[chosen] <= scene.max_forces
        held_out = inside if j == 0 else inside & (region[chosen] == 1)
        table.put(i, j, error, held_out, {"number_of_forces": forces[chosen], "full_scale_region": region[chosen]})
        table.largest["pad_node"][i, j] = _by_node(error[held_out], cases.take(chosen[held_out]), scene.n_pad)
        for n in by["number_of_forces"][scene.max_forces:]:
            table.largest["number_of_forces"][i, j, n - 1] = error[forces[chosen] == n].max()
    return xr.Dataset(table.variables(), coords={**by, "full_scale_region": list(REGIONS), **pad_places(scene)})


def _by_node(error: np.ndarray, cases: CaseArrays, n_pad: int) -> np.ndarray:
    """(n_pad,) ndarray: the largest error of any case that loads a node; NaN where none does."""
    out = np.full(n_pad, -np.inf)
    case, force = np.nonzero(cases.force)
    np.maximum.at(out, cases.node[case, force], error[case])
    return np.where(np.isfinite(out), out, np.nan)


def _errors(entry: Entry, split: str, cases: CaseArrays, responses: np.ndarray) -> np.ndarray:
    """Errors of the cases, found again where model and cases are the same."""
    path = cached_path("errors", {"model": entry.keys[split], "combinations": len(cases), "split": split,
                                  "force": float(cases.force.sum()), "scene": entry.model.scene.content_hash,
                                  "source": source_digest("comparison/errors.py", "comparison/full_scale",
                                                          "datasets", "scenes", "fullorder", "fingertip")})
    if path.exists():
        return read_netcdf(path)["error"].values
    model = entry.models[split]
    if entry.trained:
        error = additive_errors(model, cases, responses)
    else:
        error = np.empty(len(cases))
        for index, truth in superposed(responses, cases):
            error[index] = relative_errors(model.evaluate(cases.take(index), "field"), truth)
    write_netcdf(xr.Dataset({"error": ("case", error)}), path)
    return error


def additive_errors(model: Metamodel, cases: CaseArrays, responses: np.ndarray) -> np.ndarray:
    """(n_case,) ndarray: relative errors of a method whose answers add, from its answers to unit forces alone.

    Both norms are quadratic forms of the forces, so that a hundred thousand cases need no field.
    """
    n = len(responses)
    unit = model.evaluate(CaseArrays(np.arange(n)[:, None], np.ones((n, 1))), "field").astype(float)
    wrong = unit - responses
    size = []
    for fields in (wrong, responses):
        gram = fields @ fields.T
        square = [((weights @ gram) * weights).sum(1) for _, weights in superposed(np.eye(n), cases)]
        size.append(np.sqrt(np.maximum(np.concatenate(square), 0.0)))
    return size[0] / size[1]
