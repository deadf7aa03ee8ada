"""Full-order answers to load paths as plain arrays in SI units."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rom.datasets.contact_schema import QUANTITIES, area_between, shape_of
from rom.scenes import FingerOnGlass, PathArrays

if TYPE_CHECKING:
    from rom.finger_on_glass.observation import Observation
    from rom.finger_on_glass.path import PathAnswer

METRE, PASCAL = 1e-3, 1e6
"""A mm and a MPa in SI units."""


@cache
def warm_up() -> None:
    """Compile and load what every path needs, by a path on a coarse section, so that no measured time contains it."""
    scene = FingerOnGlass(rays=16, layers=2)
    solve_path(scene, scene.sample(1), 0)


def observed(seen: Observation) -> dict[str, Any]:
    """The quantities of one position, as in :data:`QUANTITIES`."""
    left, right = (METRE * edge for edge in seen.edges)
    return {
        "displacement": METRE * seen.state.displacement, "stretch_z": seen.state.stretch_z,
        "normal_displacement": METRE * seen.normal_displacement, "tangential_force": seen.tangential_force,
        "contact_left": left, "contact_right": right, "contact_area": area_between(np.asarray(left), np.asarray(right)),
        "pressure": PASCAL * seen.pressure, "shear": PASCAL * seen.shear}


def solve_path(scene: FingerOnGlass, paths: PathArrays, i: int,
               follow: Callable[..., PathAnswer] | None = None) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Follow path ``i`` with the full-order model.

    Parameters
    ----------
    scene : FingerOnGlass
    paths : PathArrays
    i : int
    follow : callable, optional
        Default: :func:`rom.finger_on_glass.path.follow`.

    Returns
    -------
    values : dict of (n_position, ...) ndarray
        By the names of QUANTITIES; NaN at positions that were not reached.
    record : dict
        ``reached`` and ``viscosity`` (n_position,) ndarrays; ``solve_seconds``, ``iterations``, ``reason``.
    """
    if follow is None:
        from rom.finger_on_glass.path import follow as full_order

        follow = full_order
    start = time.perf_counter()
    answer = follow(scene.finger(paths, i), scene.load_path(paths, i))
    seconds = time.perf_counter() - start
    values = stack(scene, answer.observations)
    reached = np.arange(scene.n_positions) < len(answer.observations)
    viscosity = np.full(scene.n_positions, np.nan)
    viscosity[reached] = [PASCAL * seen.viscosity for seen in answer.observations]
    return values, {"reached": reached, "viscosity": viscosity, "solve_seconds": seconds,
                    "iterations": answer.last.iterations if answer.last else 0, "reason": answer.reason}


def stack(scene: FingerOnGlass, seen: Sequence[Observation]) -> dict[str, np.ndarray]:
    """(n_position, ...) ndarrays of the observations of a path's first positions; NaN after."""
    values = {name: np.full((scene.n_positions, *shape_of(scene, name)), np.nan) for name in QUANTITIES}
    for k, one in enumerate(seen):
        for name, value in observed(one).items():
            values[name][k] = value
    return values
