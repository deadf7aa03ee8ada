"""Superposition of unit-load responses, exact for linear statics: u = sum of forces times K^-1 of their unit loads."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import numpy as np
import xarray as xr

from rom.fullorder.energy_norm import SUMS, gamma
from rom.metamodels.basis import PRECISIONS, Basis, check_precision, room
from rom.metamodels.bounds import rounding_size, underflow
from rom.metamodels.energy_form import EnergyForm, merged
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.known_loads import KnownLoads
from rom.metamodels.linear import not_linear
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.residual_bound import residual_bound
from rom.metamodels.stored import Stored
from rom.metamodels.validity import Assessment
from rom.relative import relative
from rom.scenes import CaseArrays, LinearScene, Scene


class Superposition(Metamodel):
    """Add the stored responses of the loads.

    Parameters
    ----------
    precision : {"float64", "float32"}
        Of the stored responses.
    loads : iterable of int, optional
        Columns of the scene's unit loads that cases will name; default: all.
    """

    name: ClassVar[str] = "superposition"
    summary: ClassVar[str] = "adds up stored unit-load responses, exact because statics are linear"
    colour: ClassVar[str] = "#56B4E9"
    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("_basis", ("load", "dof"), "displacement under a unit force", "m N-1"),
        Stored("energies", part=EnergyForm),
        Stored("defect", ("load",), "energy norm of the error", "J0.5 N-1"),
        Stored("size", ("load",), "rounding size", "J0.5 N-1"),
        Stored("load_size", ("load",), "bound of the load's K^-1 norm", "J0.5 N-1"),
        Stored("grain", (), "rounding size of a field of ones"))
    _basis: Basis
    energies: EnergyForm
    """Of the stored responses."""
    defect: np.ndarray
    """(n_load,) ndarray [J^1/2 N^-1]: bound of the energy norm of each stored response's own error."""
    size: np.ndarray
    """(n_load,) ndarray [J^1/2 N^-1]: :func:`rounding_size` of each stored response."""
    load_size: np.ndarray
    """(n_load,) ndarray [J^1/2 N^-1]: bound of ``||b||*`` of each unit load."""

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

    def __init__(self, scene: LinearScene, precision: str = "float64", loads: Iterable[int] | None = None) -> None:
        super().__init__(scene, precision=check_precision(precision))
        self.known = KnownLoads(scene, loads)
        if self.known.setting is not None:
            self.settings["loads"] = self.known.setting

    @property
    def model_bytes(self) -> int:
        return self._basis.nbytes

    @property
    def fields(self) -> tuple[int, int]:
        """Full fields that the online stage holds, and that an answer of one force reads."""
        return self.scene.n_loads, 1

    @property
    def online_bytes(self) -> int:
        row = self._basis.field[0].nbytes
        return (self.scene.max_forces + 1) * row

    def _fit(self, train: xr.Dataset | None) -> None:
        loads, bound = self.known.columns, residual_bound(self.scene)
        self._basis = Basis(self.scene.model.solve_static(loads).T, self.scene.part_rows, self.settings["precision"])
        index = self.known.index[:, None]
        each, stored = CaseArrays(index, np.ones(index.shape)), self._basis.field.astype(float)
        self.defect = bound.static_errors(each, stored)[0]
        self.load_size = bound.load_size[self.known.index]
        self.energies = EnergyForm.of(bound.energy, stored)
        self.size = rounding_size(self.scene.model.stiffness, stored)
        self.grain = float(np.sqrt(abs(self.scene.model.stiffness).sum()))

    # ---- the certificate: theorems 1 and 5 of rom.metamodels.bounds ------------------------------------------

    def error_bound(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray [J^1/2]: proven bound of ``sqrt(e^H K e)``: the stored responses' errors, and rounding."""
        return self._bounds(cases)[0]

    def _bounds(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
        """Bound of the error, and least energy norm of the true answer, both (n_case,) [J^1/2]."""
        cases = self.known.placed(cases)
        node, number = cases.node, merged(cases.node, cases.force)
        q = node.shape[1]
        own = np.einsum("cf,cf->c", np.abs(number), self.defect[node])
        load = (q + 3) * 2.0 ** -53 * np.einsum("cf,cf->c", np.abs(cases.force), self.load_size[node])
        # forces are rounded to the precision of the rows, products and sums follow
        rounding = gamma(q + 3, PRECISIONS[self.settings["precision"]].type)
        added = rounding * np.einsum("cf,cf->c", np.abs(cases.force), self.size[node])
        if self.settings["precision"] == "float32":
            added += underflow(self.size[node].sum(axis=1), self.grain, q)
        least = np.maximum(self.energies.norms(node, number)[0] - (own + load) * SUMS, 0.0)
        return (own + load + added) * SUMS, least

    def quick_assessment(self, cases: CaseArrays) -> Assessment:
        """A proven relative bound: nearly cancelling forces raise it."""
        error = relative(*self._bounds(cases))
        return Assessment(error, "bound", np.full(len(cases), "")).with_large_errors_named()

    def assess(self, cases: CaseArrays, values: np.ndarray | None = None) -> Assessment:
        return self.quick_assessment(cases) if values is None else super().assess(cases, values)

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        cases, rows = self.known.placed(cases), self._basis.rows(outputs)
        force = cases.force.astype(rows.dtype, copy=False)
        out = room(out, len(cases), rows.shape[1], rows.dtype)
        for i in range(len(cases)):
            # reads the loaded nodes' rows alone, not all 239
            np.matmul(force[i], rows[cases.node[i]], out=out[i])
        return out
