"""Superposition of unit-load responses, exact for linear statics: u = sum of forces times K^-1 of their unit loads."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.metamodels.basis import Basis, check_precision, room
from rom.metamodels.metamodel import Metamodel
from rom.scenes import CaseArrays, Scene, StaticPointForces


class Superposition(Metamodel):
    """Add the stored responses of the loaded nodes. Setting: ``precision`` ("float64", "float32")."""

    name: ClassVar[str] = "superposition"
    summary: ClassVar[str] = "adds up stored unit-load responses, exact because statics are linear"
    scenes: ClassVar[tuple[str, ...]] = (StaticPointForces.name,)
    _basis: Basis

    def __init__(self, scene: Scene, precision: str = "float64") -> None:
        super().__init__(scene, precision=check_precision(precision))

    @property
    def model_bytes(self) -> int:
        return self._basis.nbytes

    @property
    def online_bytes(self) -> int:
        row = self._basis.field[0].nbytes
        return (self.scene.max_forces + 1) * row

    def _fit(self, train: xr.Dataset) -> None:
        responses = self.scene.full_order.solve_static(self.scene.unit_loads)
        self._basis = Basis(responses.T, self.scene.pad_rows, self.settings["precision"])

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        rows = self._basis.rows(outputs)
        force = cases.force.astype(rows.dtype, copy=False)
        out = room(out, len(cases), rows.shape[1], rows.dtype)
        for i in range(len(cases)):
            # reads the loaded nodes' rows alone, not all 239
            np.matmul(force[i], rows[cases.node[i]], out=out[i])
        return out

    def _state(self) -> xr.Dataset:
        return xr.Dataset({"unit_response": (("load", "dof"), self._basis.field, {
            "long_name": "displacement under a unit normal force", "units": "m N-1"})})

    def _restore(self, data: xr.Dataset) -> None:
        self._basis = Basis(data["unit_response"].values, self.scene.pad_rows, self.settings["precision"])
