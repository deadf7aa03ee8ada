"""What is answered of a load path: the quantities, the full-order model's values of them in SI units, their errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rom.relative import relative, relative_errors
from rom.scenes.inputs import Quantity
from rom.scenes.paths import PathArrays

if TYPE_CHECKING:
    from rom.finger_on_glass.observation import Observation
    from rom.finger_on_glass.path import PathAnswer
    from rom.scenes.finger_on_glass import FingerOnGlass

METRE, PASCAL = 1e-3, 1e6
"""A mm and a MPa in SI units."""
QUANTITIES: dict[str, Quantity] = {
    "displacement": Quantity(("position", "node", "component"), "m", "displacement"),
    "stretch_z": Quantity(("position",), "1", "out-of-plane stretch"),
    "normal_displacement": Quantity(("position",), "m", "displacement of the plate since it touched"),
    "tangential_force": Quantity(("position",), "N", "force that moves the plate along"),
    "contact_left": Quantity(("position",), "m", "left end of the contact along the plate"),
    "contact_right": Quantity(("position",), "m", "right end of the contact along the plate"),
    "contact_area": Quantity(("position",), "m2", "area of a circle as wide as the contact"),
    "pressure": Quantity(("position", "skin"), "Pa", "contact pressure over the deformed skin"),
    "shear": Quantity(("position", "skin"), "Pa",
                      "shear with which the plate drags the skin, over the deformed skin"),
}
"""What every method of the scene answers."""
CONTACT = tuple(name for name in QUANTITIES if name not in ("displacement", "stretch_z"))
"""The contact quantities: what remains of an answer where the field is not wanted."""
RECORD = {
    "reached": Quantity(("position",), "1", "whether the full-order path converged up to here"),
    "viscosity": Quantity(("position",), "Pa", "viscous resistance that carried the skin over snaps"),
    "iterations": Quantity((), "1", "Newton iterations, failed steps included"),
    "reason": Quantity((), "", "where and why the path ends early"),
}
DEFINITIONS = {
    "tangential force": "difference over the normal force",
    "contact area": "difference over the true area",
    "pressure": "length of the difference over the length of the true profile, over the nodes of the skin",
    "approach": "difference of the plate's normal displacement over the true one"}
"""Errors that are told beside that of the displacement."""


def wanted(outputs: str) -> tuple[str, ...]:
    """Names of the quantities of ``outputs``: "field" or "contact"."""
    return CONTACT if outputs == "contact" else tuple(QUANTITIES)


def area_between(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """pi W^2 / 4 [m^2] of a contact W [m] wide: the publication's."""
    return 0.25 * np.pi * (right - left) ** 2


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
    values = {name: np.full((scene.n_positions, *scene.shape_of(name)), np.nan) for name in QUANTITIES}
    for k, one in enumerate(seen):
        for name, value in observed(one).items():
            values[name][k] = value
    return values


def path_errors(paths: PathArrays, answers: dict[str, np.ndarray], truth: dict[str, np.ndarray]
                ) -> dict[str, np.ndarray]:
    """Errors of each state: that of the displacement first, then as :data:`DEFINITIONS` say.

    Parameters
    ----------
    paths : PathArrays
    answers, truth : dict of (n_path, n_position, ...) ndarray
        By the names of :data:`QUANTITIES`; contact quantities may be missing from both.

    Returns
    -------
    dict of (n_path, n_position) ndarray
        Infinite where the method has no answer, NaN where there is no truth.
    """
    reached = np.isfinite(truth["displacement"]).all(axis=(2, 3))
    field, true = (values["displacement"].reshape(*reached.shape, -1) for values in (answers, truth))
    found = {"displacement": relative_errors(field, true)}
    if "pressure" in truth and "pressure" in answers:
        def missed(name: str, size: np.ndarray) -> np.ndarray:
            return relative(np.abs(answers[name] - truth[name]), np.broadcast_to(np.abs(size), reached.shape))

        found |= {"tangential force": missed("tangential_force", paths.normal_force[:, None]),
                  "contact area": missed("contact_area", truth["contact_area"]),
                  "pressure": relative_errors(answers["pressure"], truth["pressure"]),
                  "approach": missed("normal_displacement", truth["normal_displacement"])}
    return {name: np.where(reached, error, np.nan) for name, error in found.items()}
