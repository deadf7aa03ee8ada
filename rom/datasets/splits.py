"""Which cases are learned from and which are held out.

``published``: a random 20 % of the cases within the published ranges is held out. Where a scene counts these cases, the
seed draws from all of them, so that a case is held out in every dataset of that seed or in none: what a network learned
from one of them it has not seen in another. ``hard``: whole load nodes, whole
frequency bands and everything beyond the published ranges are held out. A validation set is always carved from the
training part, never from the held-out one.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from rom.datasets.schema import SPLIT_FLAGS
from rom.scenes.scene import Cases, Scene

SPLITS = ("published", "hard")
HELD_OUT_FRACTION = 0.2


def split_variables(scene: Scene, arrays: Cases, n_within: int, seed: int) -> dict[str, tuple]:
    """Variables ``split_published``, ``split_hard`` and ``hard_region``.

    Parameters
    ----------
    arrays : Cases
        Cases within the published ranges first.
    n_within : int
        How many they are.
    seed : int
        Decides the random 20 % and the held-out nodes.
    """
    count = len(arrays)
    published = np.full(count, SPLIT_FLAGS["unused"], dtype=np.int8)
    published[:n_within] = SPLIT_FLAGS["train"]
    published[:n_within][_published_test(scene, arrays, n_within, seed)] = SPLIT_FLAGS["test"]
    region = scene.hard_region(arrays, seed).astype(np.int8)
    hard = np.where(region > 0, SPLIT_FLAGS["test"], SPLIT_FLAGS["train"]).astype(np.int8)
    flags = {"flag_values": np.array(list(SPLIT_FLAGS.values()), dtype=np.int8),
             "flag_meanings": " ".join(SPLIT_FLAGS), "units": "1"}
    names = ["within training"] + list(scene.regions)
    return {
        "split_published": ("case", published, {"long_name": "random 20 % held out", **flags}),
        "split_hard": ("case", hard, {"long_name": "whole nodes, bands and ranges held out", **flags}),
        "hard_region": ("case", region, {
            "long_name": "why a case is held out by the hard split", "units": "1",
            "flag_values": np.arange(len(names), dtype=np.int8),
            "flag_meanings": " ".join(name.replace(" ", "_") for name in names)}),
    }


def held_out_numbers(count: int, seed: int) -> np.ndarray:
    """(round(count / 5),) ndarray of int: which of ``count`` cases the published split holds out, in random order."""
    return np.random.default_rng([seed, 20]).permutation(count)[:round(HELD_OUT_FRACTION * count)]


def _published_test(scene: Scene, arrays: Cases, n_within: int, seed: int) -> np.ndarray:
    """(n_within,) ndarray of bool: the cases within the ranges that are held out."""
    held = np.zeros(n_within, dtype=bool)
    if scene.n_published is not None:
        whole = np.zeros(scene.n_published, dtype=bool)
        whole[held_out_numbers(scene.n_published, seed)] = True
        held = whole[scene.published_number(arrays.take(np.arange(n_within)))]
    if not held.any() or held.all():  # cases that nobody counts, or so few that all fell to one side
        held[:] = False
        held[held_out_numbers(n_within, seed)] = True
    return held


def select(data: xr.Dataset, split: str, part: str) -> np.ndarray:
    """Integer positions of the cases that are ``part`` (train or test) of ``split``.

    Raises
    ------
    ValueError
        For a split or part that does not exist.
    """
    if split not in SPLITS:
        raise ValueError(f"{split!r} is no split: choose one of {', '.join(SPLITS)}")
    if part not in SPLIT_FLAGS:
        raise ValueError(f"{part!r} is no part of a split: choose one of {', '.join(SPLIT_FLAGS)}")
    return np.flatnonzero(data[f"split_{split}"].values == SPLIT_FLAGS[part])


def carve_validation(count: int, fraction: float = 0.1, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Positions of training and validation cases among ``count`` training cases; ValueError for fewer than two."""
    if count < 2:
        raise ValueError(f"{count} training case cannot be both learned from and validated with: give two or more")
    order = np.random.default_rng([seed, 21]).permutation(count)
    held = max(1, round(fraction * count))
    return np.sort(order[held:]), np.sort(order[:held])
