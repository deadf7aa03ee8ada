"""A hundred thousand held-out combinations of one to three static forces, and four and five forces beyond them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from full_scale.contenders import Contenders
from full_scale.errors_by import Table, pad_places
from rom.datasets import SPLITS, superposed, unit_responses
from rom.datasets.combinations import held_out_combinations
from rom.metamodels import Metamodel
from rom.relative import relative_errors
from rom.scenes import CaseArrays

SAMPLE = 4096
"""The first held-out combinations: those that methods without trained weights answer."""
BEYOND = 1024
"""Cases of four and five forces."""
REGIONS = ("every node in training", "unseen node", "four or five forces")


def study(contenders: Contenders, progress: Callable) -> xr.Dataset:
    """Error variables over held-out combinations.

    Parameters
    ----------
    contenders : Contenders
        On the scene `static-point-forces`.
    progress : callable
        ``progress(items, title)`` shows a bar.
    """
    scene, entries, seed = contenders.scene, contenders.entries, contenders.truth.seed
    within = held_out_combinations(scene, seed)
    cases = within.joined(scene.sample_beyond(BEYOND, seed))
    forces = (cases.force != 0).sum(axis=1)
    # the hard split keeps nodes from training: any case that loads one is held out by it
    region = scene.hard_region(cases, seed)
    by = {"number_of_forces": np.arange(1, int(forces.max()) + 1), "pad_node": np.arange(scene.n_loads),
          "full_scale_region": np.arange(len(REGIONS))}
    table = Table(len(entries), len(SPLITS), by)
    responses = unit_responses(scene)
    for i, j in progress(contenders.judged(), "all combinations, errors"):
        entry, model = entries[i], contenders.model(i, j)
        if model is None:
            continue
        chosen = np.arange(len(cases))
        if not entry.trained:
            chosen = np.concatenate([chosen[:SAMPLE], chosen[len(within):]])
        error = (additive_errors if entry.trained else _errors)(model, cases.take(chosen), responses)
        inside = forces[chosen] <= scene.max_forces
        held_out = inside if j == 0 else inside & (region[chosen] == 1)
        counted = held_out | ~inside
        # a case counts at every node that it loads
        case, force = np.nonzero(cases.force[chosen] * held_out[:, None])
        table.put(i, j, error, held_out, {
            "number_of_forces": (counted, forces[chosen[counted]]), "pad_node": (case, cases.node[chosen[case], force]),
            "full_scale_region": (np.arange(len(chosen)), region[chosen])})
    return xr.Dataset(table.variables(), coords={**by, "full_scale_region": list(REGIONS), **pad_places(scene)})


def _errors(model: Metamodel, cases: CaseArrays, responses: np.ndarray) -> np.ndarray:
    error = np.empty(len(cases))
    for index, truth in superposed(responses, cases):
        error[index] = relative_errors(model.evaluate(cases.take(index), "field"), truth)
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
