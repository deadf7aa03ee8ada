"""The same full-order model on another mesh of the family, carried to the scene's mesh by interpolation.

Coarser, it is the opponent that every metamodel has to beat; finer, it measures the mesh-convergence floor below which
a smaller reduction error means nothing. A nodal force f becomes P^T f, consistent with the interpolation u = P u'.
"""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar

import numpy as np
import xarray as xr

from rom.bodies import Coarser
from rom.checks import real_number
from rom.fullorder import SecondOrderModel
from rom.metamodels.basis import room
from rom.metamodels.direct import factor_bytes
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.linear import not_linear
from rom.metamodels.metamodel import Metamodel
from rom.scenes import CaseArrays, LinearScene, Scene


class CoarseFem(Metamodel):
    """Direct finite elements on a mesh with ``scale`` times as many elements along each edge."""

    name: ClassVar[str] = "coarse-fem"
    summary: ClassVar[str] = "solves the same finite-element model on a coarser mesh and interpolates"
    colour: ClassVar[str] = "#999933"
    slow: ClassVar[int] = 4
    _model: SecondOrderModel

    def __init__(self, scene: LinearScene, scale: float = 0.6) -> None:
        super().__init__(scene, scale=real_number("scale", scale, 0.1, 4.0))

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_linear(scene) or (None if scene.body.has_coarser else  # type: ignore[attr-defined]
                                     "the body has no other mesh")

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve(({"scale": 0.5}, {"scale": 0.75}))

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"scale": 0.7},))

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(solves=True, other_mesh=True)

    @cached_property
    def other(self) -> Coarser:
        """The same body on the other mesh, and the interpolation between the two."""
        return self.scene.body.coarser(self.settings["scale"])

    @property
    def model_bytes(self) -> int:
        return factor_bytes(self._model, self.scene.harmonic)

    def _fit(self, train: xr.Dataset | None) -> None:
        self._model = self.other.body.model.afresh()
        self._part_prolongation = self.other.prolongation[self.scene.part_rows]
        self._loads = self.other.prolongation.T @ self.scene.unit_loads
        if self.scene.harmonic:
            self._model.solve_harmonic(self._loads[:, :1], 1.0, 0.1)

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        carry = self.other.prolongation if outputs == "field" else self._part_prolongation
        out = room(out, len(cases), carry.shape[0], self.scene.dtype)
        for group in self.scene.groups(cases):
            block = cases.take(group)
            force = np.stack([self._loads[:, n] @ f for n, f in zip(block.node, block.force, strict=True)], axis=1)
            point = self.scene.point(block)
            answer = self._model.solve_harmonic(force, *point) if point else self._model.solve_static(force)
            out[group] = (carry @ answer).T
        return out

    def _restored(self, data: xr.Dataset) -> None:
        self._fit(None)
