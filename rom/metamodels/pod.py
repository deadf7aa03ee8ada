"""Galerkin projection of the full model on the principal directions of its own snapshots."""

from __future__ import annotations

import weakref
import zlib
from typing import ClassVar

import numpy as np
import scipy.linalg as sla
import xarray as xr

from rom.fullorder.poles import Poles, operating_points
from rom.metamodels.basis import Basis, check_precision, combine
from rom.metamodels.facts import Curve
from rom.metamodels.linear import not_linear, within
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.pod_space import PodSpace, pod
from rom.metamodels.stored import Stored
from rom.scenes import CaseArrays, LinearScene, Scene

_SPACES: dict[int, tuple[weakref.ref, int, PodSpace]] = {}


def pod_of(scene: LinearScene, train: xr.Dataset) -> tuple[PodSpace, float]:
    """POD of a training dataset's displacement, kept as long as the dataset lives: several ranks share one.

    Returns
    -------
    space : PodSpace
    borrowed_seconds : float
        What the decomposition took if an earlier call made it [s], else 0: whoever borrows it bills it too.
    """
    values = scene.values(train)
    # a dataset may be changed in place; its memory is read in the order in which it lies
    checksum = zlib.crc32((values.T if values.flags.f_contiguous else np.ascontiguousarray(values)).data)
    found = _SPACES.get(id(train))
    if found is not None and found[0]() is train and found[1] == checksum:
        return found[2], found[2].seconds
    key, space = id(train), pod(values)
    _SPACES[key] = weakref.ref(train, lambda _: _SPACES.pop(key, None)), checksum, space
    return space, 0.0


class PodGalerkin(Metamodel):
    """Galerkin projection on a POD basis, diagonalised so that an answer is a sum of poles.

    Parameters
    ----------
    rank : int, optional
        Number of POD modes; default: all that the snapshots span.
    precision : {"float64", "float32"}
    """

    name: ClassVar[str] = "pod-galerkin"
    summary: ClassVar[str] = "projects the full model on the principal directions of its own snapshots"
    colour: ClassVar[str] = "#117733"
    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("_basis", ("pole", "dof"), "Ritz shape in the POD basis"),
        Stored("eigenvalue", ("pole",), "Ritz value", "rad2 s-2"),
        Stored("participation", ("load", "pole"), "Ritz shape times unit load"))
    learns: ClassVar[bool] = True
    _basis: Basis

    def __init__(self, scene: LinearScene, rank: int | None = None, precision: str = "float64") -> None:
        if rank is not None and rank < 1:
            raise ValueError(f"rank={rank} is too low: keep at least one POD mode")
        super().__init__(scene, rank=rank, precision=check_precision(precision))

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_linear(scene)

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        if not scene.harmonic:
            return Curve(({"rank": 60}, {"rank": 120}, {"rank": 200}, {"rank": None}))
        ranks = [rank for rank in (100, 200, 300, 400, 500) if rank == within(scene, rank)]
        return Curve(tuple({"rank": rank, "precision": "float32"} for rank in ranks) or ({},))

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(tuple({"rank": rank} for rank in (20, 60) if rank == within(scene, rank)) or ({},)
                     if scene.harmonic else ({"rank": 10}, {"rank": None}))

    @property
    def model_bytes(self) -> int:
        return self._basis.nbytes + self.participation.nbytes

    @property
    def fields(self) -> tuple[int, int] | None:
        """Full fields that the online stage holds, and that an answer of one force reads; None where data decide."""
        rank = self.settings["rank"]
        return None if rank is None else (rank, rank)

    @property
    def online_bytes(self) -> int:
        return self._basis.field.nbytes + (2 if self.scene.harmonic else 1) * self._basis.field[0].nbytes

    def _fit(self, train: xr.Dataset) -> None:
        space, self.borrowed_seconds = pod_of(self.scene, train)
        vectors = space.truncated(self.settings["rank"])
        model = self.scene.model
        reduced_stiffness = vectors.T @ (model.stiffness @ vectors)
        if self.scene.harmonic:
            # K_r = S^-T diag(mu) S^-1, M_r = S^-T S^-1: the reduced system becomes a sum of poles
            self.eigenvalue, change = sla.eigh(reduced_stiffness, vectors.T @ (model.mass @ vectors))
        else:
            lower = np.linalg.cholesky(reduced_stiffness)
            change = sla.solve_triangular(lower, np.eye(len(lower)), lower=True).T
            self.eigenvalue = np.ones(len(lower))
        shapes = vectors @ change
        self.participation = self.scene.unit_loads.T @ shapes
        self._basis = Basis(shapes.T, self.scene.part_rows, self.settings["precision"])

    def coordinates(self, cases: CaseArrays) -> np.ndarray:
        """(n_case, rank) ndarray: coordinates in the diagonalised reduced basis."""
        load = np.einsum("cf,cfk->ck", cases.force, self.participation[cases.node])
        if not self.scene.harmonic:
            return load
        return Poles.of_modes(self.eigenvalue).at(load, *operating_points(cases.frequency, cases.loss_factor))

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        return combine(self.coordinates(cases), self._basis.rows(outputs), out)

    def best_approximation(self, cases: CaseArrays, values: np.ndarray) -> np.ndarray:
        rows = self._basis.field / np.linalg.norm(self._basis.field, axis=1, keepdims=True)
        return sla.solve(rows @ rows.T, rows @ values.T, assume_a="pos").T @ rows
