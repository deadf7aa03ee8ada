"""Superposition of unit-load responses, exact for linear statics: u = sum of forces times K^-1 of their unit loads."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.fullorder import SecondOrderModel
from rom.metamodels.basis import Basis, check_precision, room
from rom.metamodels.certificate import UNIT_ROUNDOFF, gram, quadratic, rounding_size
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.linear import not_linear
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.residual_bound import residual_bound
from rom.metamodels.stored import Stored
from rom.metamodels.validity import Assessment
from rom.scenes import CaseArrays, LinearScene, Scene


class Superposition(Metamodel):
    """Add the stored responses of the loaded nodes. Setting: ``precision`` ("float64", "float32")."""

    name: ClassVar[str] = "superposition"
    summary: ClassVar[str] = "adds up stored unit-load responses, exact because statics are linear"
    colour: ClassVar[str] = "#56B4E9"
    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("_basis", ("load", "dof"), "displacement under a unit force", "m N-1"),
        Stored("gram", ("load", "other_load"), "K products of the unit responses", "J N-2"),
        Stored("defect", ("load",), "energy norm of the error", "J0.5 N-1"),
        Stored("size", ("load",), "rounding size", "J0.5 N-1"))
    _basis: Basis
    gram: np.ndarray
    """(n_load, n_load) ndarray [J N^-2]: K products of the unit responses; energies of all answers."""
    defect: np.ndarray
    """(n_load,) ndarray [J^1/2 N^-1]: energy norm of each stored response's own error."""
    size: np.ndarray
    """(n_load,) ndarray [J^1/2 N^-1]: :func:`rounding_size` of each stored response."""

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_linear(scene) or (
            "unit-load responses differ at every frequency and loss factor; storing them all is a look-up table, not a "
            "model" if scene.harmonic else None)

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve(({}, {"precision": "float32"}), headline=0)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve()

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(responses=True)

    def __init__(self, scene: LinearScene, precision: str = "float64") -> None:
        super().__init__(scene, precision=check_precision(precision))

    @property
    def model_bytes(self) -> int:
        return self._basis.nbytes

    @property
    def online_bytes(self) -> int:
        row = self._basis.field[0].nbytes
        return (self.scene.max_forces + 1) * row

    def _fit(self, train: xr.Dataset) -> None:
        model = self.scene.model
        responses = model.solve_static(self.scene.unit_loads[:, self._loads()])
        self._basis = Basis(responses.T, self.scene.part_rows, self.settings["precision"])
        self._measure(model)

    def _loads(self) -> np.ndarray:
        """(n,) ndarray of int: the unit loads that cases may name."""
        return np.arange(self.scene.n_loads)

    def _measure(self, model: SecondOrderModel) -> None:
        stored = self._basis.field.astype(float)
        loads = self._loads()
        each = CaseArrays(loads[:, None], np.ones((len(loads), 1)))
        residual = residual_bound(self.scene).residuals(each, stored)
        error = model.static_factorization.solve(residual)
        self.defect = np.sqrt(np.maximum(np.einsum("nl,nl->l", residual, error), 0.0))
        self.gram = gram(stored + error.T, model.stiffness)
        self.size = rounding_size(model.stiffness, stored)

    def error_bound(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray [J^1/2]: bound of ``sqrt(e^H K e)``: the stored responses' errors, and all rounding."""
        force = np.abs(cases.force)
        unit = UNIT_ROUNDOFF[self.settings["precision"]]
        # forces are rounded to the precision of the rows, products and sums follow
        stored = self.defect + (cases.node.shape[1] + 2) * unit * self.size
        return np.einsum("cf,cf->c", force, stored[cases.node]) + residual_bound(self.scene).load_rounding(
            CaseArrays(self._loads()[cases.node], cases.force))

    def quick_assessment(self, cases: CaseArrays) -> Assessment:
        """A rigorous relative bound: nearly cancelling forces raise it."""
        bound = self.error_bound(cases)
        size = quadratic(self.gram, cases.node, cases.force, below=True)
        size = size - residual_bound(self.scene).load_rounding(CaseArrays(self._loads()[cases.node], cases.force))
        error = np.divide(bound, size, out=np.where(bound == 0.0, 0.0, np.inf), where=size > 0)
        return Assessment(error, "bound", np.full(len(cases), "")).with_large_errors_named()

    def assess(self, cases: CaseArrays, values: np.ndarray | None = None) -> Assessment:
        return self.quick_assessment(cases) if values is None else super().assess(cases, values)

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        rows = self._basis.rows(outputs)
        force = cases.force.astype(rows.dtype, copy=False)
        out = room(out, len(cases), rows.shape[1], rows.dtype)
        for i in range(len(cases)):
            # reads the loaded nodes' rows alone, not all 239
            np.matmul(force[i], rows[cases.node[i]], out=out[i])
        return out
