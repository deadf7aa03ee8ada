"""Every held-out case of the whole harmonic grid, and what lies beyond it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from full_scale.contenders import Contenders
from full_scale.errors_by import Table, pad_places
from full_scale.network_errors import network_errors
from full_scale.peaks import Peaks
from rom.datasets import SPLITS
from rom.datasets.reduced import ReducedField
from rom.datasets.schema import SPLIT_FLAGS
from rom.datasets.whole import find_whole
from rom.metamodels import Metamodel
from rom.relative import relative_errors
from rom.scenes.harmonic_point_force import FREQUENCY, FREQUENCY_BEYOND, LOSS_FACTOR, LOSS_FACTOR_BEYOND

SAMPLE, BEYOND = 3072, 1024
"""Cases within and beyond the ranges, drawn at random, that stand for all where each answer has to be put together as a
whole field."""
BLOCK = 128
REGIONS = ("within training", "unseen node", "unseen frequency band", "301-400 Hz", "loss factor 0.05",
           "loss factor 0.6")


def study(contenders: Contenders, progress: Callable) -> xr.Dataset:
    """Error variables over the whole grid; networks answer every held-out case, others a random sample.

    Parameters
    ----------
    contenders : Contenders
        On the scene `harmonic-point-force`.
    progress : callable
        ``progress(items, title)`` shows a bar.
    """
    scene, entries = contenders.scene, contenders.entries
    path = find_whole(scene, beyond=True, seed=contenders.truth.seed,
                      progress=lambda items: progress(items, "whole grid"))
    field = ReducedField(path)
    by = {"full_scale_frequency": np.concatenate([FREQUENCY, FREQUENCY_BEYOND]),
          "full_scale_loss_factor": np.sort(np.concatenate([LOSS_FACTOR, LOSS_FACTOR_BEYOND])),
          "pad_node": np.arange(scene.n_loads), "full_scale_region": np.arange(len(REGIONS))}
    table = Table(len(entries), len(SPLITS), by)
    inputs, region = field.arrays(np.arange(len(field))), _regions(field)
    keys = {"full_scale_frequency": np.round(inputs.frequency), "full_scale_loss_factor": inputs.loss_factor,
            "pad_node": field.load}
    beyond = region >= 3
    tested = {split: field.data[f"split_{split}"].values == SPLIT_FLAGS["test"] for split in SPLITS}
    peaks = Peaks(scene, field, len(entries))
    for i, j in progress(contenders.judged(), "whole grid, errors"):
        entry, split, model = entries[i], SPLITS[j], contenders.model(i, j)
        if model is None:
            continue
        cases = np.flatnonzero(tested[split] | beyond if entry.headline else tested[split] & ~beyond)
        if not entry.trained:
            cases = _sample(cases, beyond)
        error = network_errors(model, field, cases) if entry.trained else _errors(model, field, cases)
        held_out = (tested[split] & ~beyond)[cases]
        table.put(i, j, error, held_out, {
            **{name: (held_out, key[cases[held_out]]) for name, key in keys.items()},
            "full_scale_region": (np.arange(len(cases)), region[cases])})
        if j == 0 and entry.headline:
            peaks.put(i, model)
    return xr.Dataset({**table.variables(), **peaks.variables(),
                       "full_scale_seconds": ((), float(field.data.attrs["offline_seconds"]), {
                           "long_name": "making and checking the whole grid", "units": "s"}),
                       "full_scale_residual": ((), float(field.data.attrs["residual_max"]), {
                           "long_name": "largest residual ||Z u - f|| / ||f|| of any case of the whole grid",
                           "units": "1"}),
                       "full_scale_confirmed": ((), float(field.data.attrs["confirmed_error_max"]), {
                           "long_name": "largest error of the whole grid against direct solves", "units": "1"})},
                      coords={**by, "full_scale_region": list(REGIONS), **pad_places(scene)})


def _regions(field: ReducedField) -> np.ndarray:
    """(n_case,) ndarray of int: positions in :data:`REGIONS`; what lies beyond the ranges counts before the rest."""
    region = field.data["hard_region"].values.astype(int)
    region[(region == 4) & (field.stiffness.imag > 0.5)] = 5
    return region


def _sample(cases: np.ndarray, beyond: np.ndarray) -> np.ndarray:
    """Some of the ``cases``, in order: at most :data:`SAMPLE` within the ranges and :data:`BEYOND` beyond them."""
    rng, outside = np.random.default_rng(7), beyond[cases]
    return np.sort(np.concatenate([rng.choice(part, min(most, len(part)), replace=False) for part, most in (
        (cases[~outside], SAMPLE), (cases[outside], BEYOND))]))


def _errors(model: Metamodel, field: ReducedField, cases: np.ndarray) -> np.ndarray:
    """Errors of cases, whose true fields are put together block by block."""
    order = np.argsort(field.load[cases], kind="stable")  # a load's shapes are read once
    error = np.empty(len(cases))
    for start in range(0, len(order), BLOCK):
        part = order[start:start + BLOCK]
        error[part] = relative_errors(model.evaluate(field.arrays(cases[part]), "field"), field.fields(cases[part]))
    return error
