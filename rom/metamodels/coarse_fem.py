"""The same full-order model on another mesh of the family, carried to the scene's mesh by interpolation.

Coarser, it is the opponent that every metamodel has to beat; finer, it measures the mesh-convergence floor below which
a smaller reduction error means nothing. A nodal force f becomes P^T f, consistent with the interpolation u = P u'.
"""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
import xarray as xr

from rom.fingertip import Fingertip, interpolation_from
from rom.fullorder import SecondOrderModel
from rom.metamodels.basis import room
from rom.metamodels.direct import factor_bytes
from rom.metamodels.metamodel import Metamodel
from rom.scenes import CaseArrays, HarmonicPatchForces, HarmonicPointForce, Scene, StaticPointForces


class CoarseFem(Metamodel):
    """Direct finite elements on a mesh with ``scale`` times as many elements along each edge."""

    name: ClassVar[str] = "coarse-fem"
    summary: ClassVar[str] = "solves the same finite-element model on a coarser mesh and interpolates"
    scenes: ClassVar[tuple[str, ...]] = (
        StaticPointForces.name, HarmonicPointForce.name, HarmonicPatchForces.name)
    _model: SecondOrderModel

    def __init__(self, scene: Scene, scale: float = 0.6) -> None:
        if not 0.1 <= scale <= 4.0:
            raise ValueError(f"scale={scale:g} is out of range: give 0.1 (very coarse) to 4 (very fine)")
        super().__init__(scene, scale=scale)

    @cached_property
    def other(self) -> Fingertip:
        """The same anatomy on the other mesh."""
        tip = self.scene.fingertip
        return Fingertip(tip.anatomy, tip.density.scaled(self.settings["scale"]), formulation=tip.formulation,
                         rear=tip.rear)

    @cached_property
    def _prolongation(self) -> sp.csr_matrix:
        """(n_free, n_free of the other mesh): interpolates displacement at free degrees of freedom."""
        nodal = interpolation_from(self.other.mesh, self.scene.fingertip.mesh)
        full = sp.kron(nodal, sp.identity(3), format="csr")
        return full[self.scene.fingertip.free_dofs][:, self.other.free_dofs].tocsr()

    @property
    def model_bytes(self) -> int:
        return factor_bytes(self._model, self.scene.harmonic)

    def _fit(self, train: xr.Dataset | None) -> None:
        harmonic = self.scene.harmonic
        self._model = SecondOrderModel(self.other.stiffness, self.other.mass if harmonic else None)
        self._pad_prolongation = self._prolongation[self.scene.pad_rows]
        self._loads = self._prolongation.T @ self.scene.unit_loads
        if harmonic:
            self._model.solve_harmonic(self._loads[:, :1], 1.0, 0.1)

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        carry = self._pad_prolongation if outputs == "pad" else self._prolongation
        out = room(out, len(cases), carry.shape[0], self.scene.dtype)
        for group in self.scene.groups(cases):
            block = cases.take(group)
            force = np.stack([self._loads[:, n] @ f for n, f in zip(block.node, block.force, strict=True)], axis=1)
            if self.scene.harmonic:
                answer = self._model.solve_harmonic(force, float(block.frequency[0]), float(block.loss_factor[0]))
            else:
                answer = self._model.solve_static(force)
            out[group] = (carry @ answer).T
        return out

    def _state(self) -> xr.Dataset:
        return xr.Dataset()

    def _restore(self, data: xr.Dataset) -> None:
        self._fit(None)
