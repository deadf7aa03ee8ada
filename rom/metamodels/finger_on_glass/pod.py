"""Reduced coordinates of a variant's states: POD of displacement, pressure and shear, and the scalars beside them.

Each snapshot counts by its relative error, so that light presses weigh as much as heavy ones. Pressures are taken over
c and forces over the normal force, as in :mod:`rom.metamodels.finger_on_glass.features`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from rom.metamodels.finger_on_glass.interpolation import finish
from rom.metamodels.pod_space import pod
from rom.scenes import Answers
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.paths import PathArrays

SCALARS = ("stretch_z", "normal_displacement", "tangential_force", "contact_left", "contact_right")
FIELDS = ("displacement", "pressure", "shear")
PROFILE_RANK = 30
"""Most POD modes of a profile over the skin."""


def leading_modes(snapshots: np.ndarray, rank: int | None) -> np.ndarray:
    """(r, n) ndarray: orthonormal POD modes of snapshots (m, n), each of weight one; none where all vanish."""
    if not snapshots.any():
        return np.zeros((0, snapshots.shape[1]))
    return np.ascontiguousarray(pod(snapshots, rank or len(snapshots)).vectors.T)


@dataclass(eq=False)
class PathSpace:
    """POD modes of one variant.

    Parameters
    ----------
    scene : FingerOnGlass
    modes : dict of (r, n) ndarray
        Orthonormal rows for each of :data:`FIELDS`.
    """

    scene: FingerOnGlass
    modes: dict[str, np.ndarray]
    start: dict[str, slice] = field(init=False)
    """Where the coordinates of each field lie; the scalars come first."""

    def __post_init__(self) -> None:
        self.start, at = {}, len(SCALARS)
        for name in FIELDS:
            self.start[name] = slice(at, at + len(self.modes[name]))
            at += len(self.modes[name])

    @property
    def size(self) -> int:
        """Number of coordinates of a state."""
        return len(SCALARS) + sum(len(modes) for modes in self.modes.values())

    @property
    def nbytes(self) -> int:
        return sum(modes.nbytes for modes in self.modes.values())

    @classmethod
    def of(cls, scene: FingerOnGlass, answers: Answers, rank: int | None) -> Self:
        """Modes of some paths' answers; ``rank`` None keeps all that the displacements span."""
        modes = {}
        for name in FIELDS:
            values = answers[name]
            most = rank if name == "displacement" else PROFILE_RANK
            modes[name] = leading_modes(values.reshape(values.shape[0] * values.shape[1], -1), most)
        return cls(scene, modes)

    def encode(self, paths: PathArrays, answers: Answers) -> np.ndarray:
        """(n_path, n_position, size) ndarray: coordinates of the states."""
        n, k = answers["displacement"].shape[:2]
        state = np.empty((n, k, self.size))
        for j, name in enumerate(SCALARS):
            state[..., j] = answers[name]
        state[..., SCALARS.index("stretch_z")] -= 1.0
        state[..., SCALARS.index("tangential_force")] /= paths.normal_force[:, None]
        for name in FIELDS:
            over = 1.0 if name == "displacement" else paths.c[:, None, None]
            state[..., self.start[name]] = answers[name].reshape(n, k, -1) / over @ self.modes[name].T
        return state

    def decode(self, paths: PathArrays, state: np.ndarray, outputs: str) -> Answers:
        """The inverse of :meth:`encode`, as far as the modes reach."""
        found: Answers = {name: state[..., j].copy() for j, name in enumerate(SCALARS)}
        found["stretch_z"] += 1.0
        found["tangential_force"] *= paths.normal_force[:, None]
        for name in FIELDS:
            if name == "displacement" and outputs == "contact":
                continue
            flat = state[..., self.start[name]] @ self.modes[name]
            found[name] = flat.reshape(*state.shape[:2], *self.scene.shape_of(name))
            if name != "displacement":
                found[name] *= paths.c[:, None, None]
        return finish(found, outputs)

    def project(self, displacement: np.ndarray) -> np.ndarray:
        """The best that the modes can do to displacements (n_path, n_position, n_node, 2)."""
        flat = displacement.reshape(*displacement.shape[:2], -1)
        return (flat @ self.modes["displacement"].T @ self.modes["displacement"]).reshape(displacement.shape)
