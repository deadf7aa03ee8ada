"""The same finite elements on a coarser section: a fair opponent, which learns nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from rom.checks import real_number
from rom.metamodels.facts import Curve
from rom.metamodels.finger_on_glass.direct import PathDirect
from rom.metamodels.metamodel import Metamodel
from rom.scenes import Scene
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.path_answers import solve_path
from rom.scenes.paths import PathArrays

LEAST_RAYS, LEAST_LAYERS = 16, 2


class PathCoarseFem(PathDirect):
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
    colour: ClassVar[str] = "#999933"
    full_order: ClassVar[bool] = False
    slow: ClassVar[int] = 4

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve(({"scale": 0.5}, {"scale": 0.75}))

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"scale": 0.75},))

    def __init__(self, scene: FingerOnGlass, scale: float = 0.5) -> None:
        Metamodel.__init__(self, scene, scale=real_number("scale", scale, 0.05, 4.0))
        scale = self.settings["scale"]
        self._coarse = replace(scene, rays=max(LEAST_RAYS, round(scale * scene.rays)),
                               layers=max(LEAST_LAYERS, round(scale * scene.layers)))
        self._around = _weights(np.arange(scene.rays) / scene.rays * self._coarse.rays, self._coarse.rays, True)
        depth = np.arange(scene.layers + 1) / scene.layers * self._coarse.layers
        self._inwards = _weights(depth, self._coarse.layers + 1, False)

    @property
    def model_bytes(self) -> int:
        return PathDirect(self._coarse).model_bytes + self._around.nbytes + self._inwards.nbytes

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
