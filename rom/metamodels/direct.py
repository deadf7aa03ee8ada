"""The full-order model in the metamodels' row: the baseline that every speed-up is quoted against.

`direct` factorises and solves each case, with the symbolic phase reused; `direct-reused` also keeps the numeric
factor wherever the mathematics allows (one factor for all static cases, one for each frequency and loss factor) and
solves for all right-hand sides of a group together.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.fullorder import SecondOrderModel
from rom.metamodels.basis import room
from rom.metamodels.metamodel import Metamodel
from rom.scenes import CaseArrays, HarmonicPatchForces, HarmonicPointForce, Scene, StaticPointForces


class Direct(Metamodel):
    """Factorise and solve each case. Setting: ``backend`` ("auto", "pardiso", "superlu")."""

    name: ClassVar[str] = "direct"
    summary: ClassVar[str] = "factorises and solves the full finite-element model for each case, symbolic phase reused"
    scenes: ClassVar[tuple[str, ...]] = (
        StaticPointForces.name, HarmonicPointForce.name, HarmonicPatchForces.name)
    keeps_factor: ClassVar[bool] = False
    _model: SecondOrderModel

    def __init__(self, scene: Scene, backend: str = "auto") -> None:
        super().__init__(scene, backend=backend)

    @property
    def backend(self) -> str:
        """The solver that ran."""
        return self._model.backend

    @property
    def model_bytes(self) -> int:
        return factor_bytes(self._model, self.scene.harmonic)

    def _fit(self, train: xr.Dataset | None) -> None:
        scene = self.scene
        self._model = SecondOrderModel(scene.fingertip.stiffness, scene.fingertip.mass if scene.harmonic else None,
                                       backend=self.settings["backend"])
        # the symbolic phase, and with `direct-reused` the static factor, belong to the offline stage
        first = CaseArrays(np.zeros((1, 1), dtype=np.int64), np.ones((1, 1)),
                           *((np.ones(1), np.full(1, 0.1)) if scene.harmonic else ()))
        self._evaluate(first, "field", None)

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        scene = self.scene
        rows = scene.pad_rows if outputs == "pad" else slice(None)
        out = room(out, len(cases), len(scene.pad_rows) if outputs == "pad" else scene.n_free, scene.dtype)
        groups = scene.groups(cases) if self.keeps_factor else np.arange(len(cases))[:, None]
        for group in groups:
            out[group] = self._solve(cases.take(group))[rows].T
        return out

    def _solve(self, block: CaseArrays) -> np.ndarray:
        force = self.scene.force_vectors(block)
        if self.scene.harmonic:
            return self._model.solve_harmonic(force, float(block.frequency[0]), float(block.loss_factor[0]),
                                              reuse_factor=self.keeps_factor)
        return self._model.solve_static(force, reuse_factor=self.keeps_factor)

    def _state(self) -> xr.Dataset:
        return xr.Dataset()  # the scene in the attributes is all that it is

    def _restore(self, data: xr.Dataset) -> None:
        self._fit(None)


def factor_bytes(model: SecondOrderModel, harmonic: bool) -> int:
    """Memory of the factor that the online stage holds [byte]."""
    return (model.harmonic_factorization(1.0, 0.1) if harmonic else model.static_factorization).memory_bytes


class DirectReused(Direct):
    """Keep the factor wherever the mathematics allows."""

    name: ClassVar[str] = "direct-reused"
    summary: ClassVar[str] = "direct, keeping the factor wherever the mathematics allows, many right-hand sides at once"
    keeps_factor: ClassVar[bool] = True
