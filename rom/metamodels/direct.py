"""The full-order model in the metamodels' row: the baseline that every speed-up is quoted against.

`direct` factorises and solves each case, with the symbolic phase reused; `direct-reused` also keeps the numeric
factor wherever the mathematics allows (one factor for all static cases, one for each frequency and loss factor) and
solves for all right-hand sides of a group together.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import ClassVar

import numpy as np
import xarray as xr

from rom.fullorder import IllConditionedWarning, SecondOrderModel
from rom.metamodels.basis import room
from rom.metamodels.facts import Needs
from rom.metamodels.linear import not_linear
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.residual_bound import residual_bound
from rom.metamodels.validity import Assessment
from rom.scenes import CaseArrays, LinearScene, Scene

DOUBTFUL = 1e-6
"""Estimated relative error above which `direct` does not stand behind an answer: rounding, greatly amplified."""


class Direct(Metamodel):
    """Factorise and solve each case. Setting: ``backend`` ("auto", "pardiso", "superlu")."""

    name: ClassVar[str] = "direct"
    summary: ClassVar[str] = "factorises and solves the full finite-element model for each case, symbolic phase reused"
    colour: ClassVar[str] = "#000000"
    full_order: ClassVar[bool] = True
    slow: ClassVar[int] = 32
    keeps_factor: ClassVar[bool] = False
    _model: SecondOrderModel

    def __init__(self, scene: LinearScene, backend: str = "auto") -> None:
        super().__init__(scene, backend=backend)

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_linear(scene, "the tangent changes in every iteration: there is no factor to keep")

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(solves=True)

    @property
    def backend(self) -> str:
        """The solver that ran."""
        return self._model.backend

    @property
    def model_bytes(self) -> int:
        return factor_bytes(self._model, self.scene.harmonic)

    def _fit(self, train: xr.Dataset | None) -> None:
        scene = self.scene
        self._model = scene.model.afresh(self.settings["backend"])
        # the symbolic phase, and with `direct-reused` the static factor, belong to the offline stage
        first = CaseArrays(np.zeros((1, 1), dtype=np.int64), np.ones((1, 1)),
                           *((np.ones(1), np.full(1, 0.1)) if scene.harmonic else ()))
        self._evaluate(first, "field", None)

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        scene = self.scene
        rows = slice(None) if outputs == "field" else scene.part_rows
        out = room(out, len(cases), scene.n_outputs(outputs), scene.dtype)
        for group in self._groups(cases):
            out[group] = self._solve(cases.take(group))[rows].T
        return out

    def _groups(self, cases: CaseArrays) -> Iterable[np.ndarray]:
        """Index arrays of cases that are solved together."""
        return self.scene.groups(cases) if self.keeps_factor else np.arange(len(cases))[:, None]

    def _solve(self, block: CaseArrays) -> np.ndarray:
        force = self.scene.force_vectors(block)
        if self.scene.harmonic:
            return self._model.solve_harmonic(force, float(block.frequency[0]), float(block.loss_factor[0]),
                                              reuse_factor=self.keeps_factor)
        return self._model.solve_static(force, reuse_factor=self.keeps_factor)

    # ---- how wrong it is: what one more step of refinement would change, the residual summed in extended precision

    def answer(self, cases: CaseArrays) -> tuple[np.ndarray, Assessment]:
        self._check_fitted()
        scene = self.scene
        rows = slice(None) if scene.outputs == "field" else scene.part_rows
        values = np.empty((len(cases), scene.n_outputs(scene.outputs)), scene.dtype)
        error, doubted = np.empty(len(cases)), np.zeros(len(cases), dtype=bool)
        for group in self._groups(cases):
            block = cases.take(group)
            # the full-order model's own doubts become the cases' reasons
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", IllConditionedWarning)
                field = self._solve(block)
            doubted[group] = any(issubclass(one.category, IllConditionedWarning) for one in caught)
            error[group] = self._correction(block, field)
            values[group] = field[rows].T
        return values, self._judged(error, doubted)

    def assess(self, cases: CaseArrays, values: np.ndarray | None = None) -> Assessment:
        """Relative size of the next correction, an estimate; each operating point costs a factorization."""
        error = np.empty(len(cases))
        for group in self.scene.groups(cases):
            block = cases.take(group)
            field = self._solve(block) if values is None else np.asarray(values[group], dtype=self.scene.dtype).T
            error[group] = self._correction(block, field)
        return self._judged(error)

    def _correction(self, block: CaseArrays, field: np.ndarray) -> np.ndarray:
        """(n_case,) ndarray: ``||Z^-1 r||_K / ||u||_K`` of answers (n_free, n_case) at one operating point."""
        residual = residual_bound(self.scene).residuals(block, field.T)
        factor = self._model.harmonic_factorization(float(block.frequency[0]), float(block.loss_factor[0])) \
            if self.scene.harmonic else self._model.static_factorization
        step = factor.solve(residual)
        energy = residual_bound(self.scene).energy
        miss, size = energy.norms(step.T)[1], energy.norms((field + step).T)[0]
        return np.divide(miss, size, out=np.where(miss == 0.0, 0.0, np.inf), where=size > 0)

    @staticmethod
    def _judged(error: np.ndarray, doubted: np.ndarray | bool = False) -> Assessment:
        error = np.maximum(np.where(np.isfinite(error), error, np.inf), 2.0 ** -53)
        doubt = "rounding errors are amplified, as near an undamped resonance or by an ill-conditioned stiffness"
        return Assessment(error, "estimate", np.where((error > DOUBTFUL) | doubted, doubt, ""))

    def _restored(self, data: xr.Dataset) -> None:
        self._fit(None)  # the scene in the attributes is all that it is


def factor_bytes(model: SecondOrderModel, harmonic: bool) -> int:
    """Memory of the factor that the online stage holds [byte]."""
    return (model.harmonic_factorization(1.0, 0.1) if harmonic else model.static_factorization).memory_bytes


class DirectReused(Direct):
    """Keep the factor wherever the mathematics allows."""

    colour: ClassVar[str] = "#777777"
    name: ClassVar[str] = "direct-reused"
    summary: ClassVar[str] = "direct, keeping the factor wherever the mathematics allows, many right-hand sides at once"
    keeps_factor: ClassVar[bool] = True


class DirectOnDemand(DirectReused):
    """`direct-reused` on the scene's own model and the factors that it has; nothing is made ahead."""

    def _fit(self, train: xr.Dataset | None) -> None:
        self._model = self.scene.model
