"""Which load paths are drawn, and which of them the hard split holds out."""

from __future__ import annotations

import numpy as np

from rom.finger_on_glass.tissue import PUBLISHED_K1, VARIANTS
from rom.scenes.paths import RANGES, PathArrays

BEYOND = {"c": ((1500.0, 2000.0), (4500.0, 6000.0)), "k1": ((0.25, 0.5), (2.0, 4.0)),
          "friction": ((0.35, 0.5), (1.2, 1.5)), "normal_force": ((0.12, 0.2), (0.8, 1.2))}
"""Ranges below and above, for the extrapolation part of the hard split."""
HEAVY, SOFT, SLIPPERY = 0.65, 3000.0, 0.57
"""Normal force from which [N] on tissue up to which c [Pa], and friction up to which the hard split holds paths out."""
PASCAL = 1e6
"""In a MPa, in which the published stiffnesses are."""


def draw_paths(count: int, rng: np.random.Generator) -> PathArrays:
    """Paths within the ranges: variants in turn, a Latin hypercube of each."""
    from scipy.stats import qmc

    variant = np.arange(count) % len(VARIANTS)
    unit = np.empty((count, len(RANGES)))
    for v in range(len(VARIANTS)):
        mine = variant == v
        if mine.any():
            unit[mine] = qmc.LatinHypercube(len(RANGES), rng=rng).random(int(mine.sum()))
    drawn = {name: low + (high - low) * unit[:, j] for j, (name, (low, high)) in enumerate(RANGES.items())}
    low, high = RANGES["k1"]
    drawn["k1"] = published_k1(variant) * low * (high / low) ** unit[:, 1]
    return PathArrays(variant, **drawn)


def draw_beyond(count: int, rng: np.random.Generator) -> PathArrays:
    """Paths with one input outside its range, below and above in turn, the others within."""
    paths = draw_paths(count, rng)
    names = list(BEYOND)
    for i in range(count):
        name = names[i // len(VARIANTS) % len(names)]
        low, high = BEYOND[name][i // (len(VARIANTS) * len(names)) % 2]
        value = low * (high / low) ** rng.random()
        getattr(paths, name)[i] = value * (published_k1(paths.variant[i:i + 1])[0] if name == "k1" else 1.0)
    return paths


def why_held_out(paths: PathArrays) -> np.ndarray:
    """(n_path,) ndarray of int: why the hard split holds a path out, 0 where it does not."""
    found = np.where(paths.friction <= SLIPPERY, 2, 0)
    found = np.where((paths.normal_force >= HEAVY) & (paths.c <= SOFT), 1, found)
    return np.where(beyond(paths).any(axis=1), 3, found)


def beyond(paths: PathArrays) -> np.ndarray:
    """(n_path, 4) ndarray of bool: which of c, k1, friction and normal force lie outside the sampled ranges."""
    values = paths.numbers.copy()
    values[:, 1] /= published_k1(paths.variant)
    low, high = np.array(list(RANGES.values())).T
    return (values < low * (1 - 1e-9)) | (values > high * (1 + 1e-9))


def published_k1(variant: np.ndarray) -> np.ndarray:
    """Published fibre stiffness of each variant [Pa]."""
    return PASCAL * np.array([PUBLISHED_K1[name] for name in VARIANTS])[variant]
