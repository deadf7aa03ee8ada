"""The same finite elements on a coarser section: a fair opponent, which learns nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from rom.datasets.path_solutions import solve_path
from rom.metamodels.contact.direct import ContactDirect
from rom.scenes import FingerOnGlass, PathArrays

LEAST_RAYS, LEAST_LAYERS = 16, 2


class ContactCoarseFem(ContactDirect):
    """Follow each path on a coarser mesh and interpolate to the nodes of the scene's.

    The random variant draws its fibre angles at the coarse mesh's own integration points: another finger of the
    same kind, which is part of this method's error.

    Parameters
    ----------
    scale : float
        Number of elements in each direction over that of the scene's mesh; below 1 is coarser.
    """

    name: ClassVar[str] = "coarse-fem"
    summary: ClassVar[str] = "follows the path with the same finite elements on a coarser section"

    def __init__(self, scene: FingerOnGlass, scale: float = 0.5) -> None:
        if isinstance(scale, bool) or not isinstance(scale, int | float) or not 0.05 <= scale <= 4:
            raise ValueError(f"scale={scale!r} cannot be: give the coarser mesh's elements over the scene's, .05 to 4")
        super(ContactDirect, self).__init__(scene, scale=float(scale))
        self._coarse = replace(scene, rays=max(LEAST_RAYS, round(scale * scene.rays)),
                               layers=max(LEAST_LAYERS, round(scale * scene.layers)))
        self._around = _weights(np.arange(scene.rays) / scene.rays * self._coarse.rays, self._coarse.rays, True)
        depth = np.arange(scene.layers + 1) / scene.layers * self._coarse.layers
        self._inwards = _weights(depth, self._coarse.layers + 1, False)

    @property
    def model_bytes(self) -> int:
        return ContactDirect(self._coarse).model_bytes + self._around.nbytes + self._inwards.nbytes

    def _one(self, paths: PathArrays, i: int) -> tuple[dict[str, np.ndarray], dict]:
        values, record = solve_path(self._coarse, paths, i)
        coarse, fine = self._coarse, self.scene
        field = values["displacement"].reshape(-1, coarse.rays, coarse.layers + 1, 2)
        field = np.einsum("ir,prlc,jl->pijc", self._around, field, self._inwards, optimize=True)
        values["displacement"] = field.reshape(-1, fine.n_nodes, 2)
        for name in ("pressure", "shear"):
            values[name] = values[name] @ self._around.T
        return values, record


def _weights(place: np.ndarray, count: int, periodic: bool) -> np.ndarray:
    """(n, count) ndarray: linear interpolation at ``place`` between points at 0, 1, ...

    Mesh lines of both meshes follow the same density, so that this is what the elements' own shape functions do.
    """
    left = np.floor(place + 1e-9).astype(int)
    if not periodic:
        left = np.minimum(left, count - 2)
    share = place - left
    weights = np.zeros((len(place), count))
    rows = np.arange(len(place))
    weights[rows, left % count] = 1 - share
    weights[rows, (left + 1) % count] += share
    return weights
