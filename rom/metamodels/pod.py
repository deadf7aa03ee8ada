"""Proper orthogonal decomposition: a basis from snapshots, and Galerkin projection of the full model on it.

Snapshots enter with unit norm, since errors are judged relative to each answer; a complex one gives its real and its
imaginary part, which keeps the basis and the reduced matrices real. (Sirovich 1987; Benner, Gugercin, Willcox 2015.)
"""

from __future__ import annotations

import time
import weakref
import zlib
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.linalg as sla
import xarray as xr

from rom.metamodels.basis import Basis, check_precision, combine
from rom.metamodels.metamodel import Metamodel
from rom.scenes import CaseArrays, HarmonicPatchForces, HarmonicPointForce, Scene, StaticPointForces

MAX_RANK = 800
"""POD modes kept at most: more would cost memory and nobody could afford them online."""
NOISE = 1e-12
"""Share of the largest Gram eigenvalue below which a POD mode is rounding noise: 1e-6 of the singular value, since the
Gram matrix squares the snapshots and keeps half of their digits."""


@dataclass(frozen=True)
class PodSpace:
    """POD modes above rounding noise of one set of snapshots, :data:`MAX_RANK` of them at most.

    vectors : (n, r) ndarray
        Orthonormal columns, by falling singular value.
    singular_values : (r,) ndarray
    seconds : float
        What the decomposition took [s].
    """

    vectors: np.ndarray
    singular_values: np.ndarray
    seconds: float

    def truncated(self, rank: int | None) -> np.ndarray:
        """(n, rank) ndarray: the first modes, or all.

        Raises
        ------
        ValueError
            Where the snapshots do not span that many dimensions.
        """
        if rank is None:
            return self.vectors
        if not 1 <= rank <= self.vectors.shape[1]:
            raise ValueError(f"rank {rank} is out of reach: these snapshots give {self.vectors.shape[1]} POD modes "
                             f"above rounding noise, of at most {MAX_RANK}; ask for less or make more cases")
        return self.vectors[:, :rank]


def pod(snapshots: np.ndarray) -> PodSpace:
    """POD of ``snapshots`` (n_case, n), real or complex, by the Gram matrix of the smaller side.

    Snapshots of any size count alike, and those that vanish not at all.

    Raises
    ------
    ValueError
        Where a snapshot is not finite, or all vanish.
    """
    start = time.perf_counter()
    rows = _unit_rows(np.asarray(snapshots))
    if np.iscomplexobj(rows):
        rows = np.concatenate([rows.real, rows.imag])
    if rows.shape[0] > rows.shape[1]:
        value, vectors = sla.eigh(rows.T @ rows)
        keep = _worth_keeping(value)
        vectors = vectors[:, keep][:, ::-1]
    else:
        value, weights = sla.eigh(rows @ rows.T)
        keep = _worth_keeping(value)
        vectors = rows.T @ (weights[:, keep] / np.sqrt(value[keep]))[:, ::-1]
        vectors = np.linalg.qr(vectors)[0]  # the Gram matrix halves the digits of the small modes' orthogonality
    singular = np.sqrt(value[keep][::-1])
    return PodSpace(vectors, singular, time.perf_counter() - start)


def _unit_rows(snapshots: np.ndarray) -> np.ndarray:
    """Snapshots with unit norm; first by their largest entry, whose square may lie outside double precision."""
    # |a + ib| itself may overflow or lose a denormal's digits: the larger part serves
    largest = np.maximum(np.abs(snapshots.real), np.abs(snapshots.imag)).max(axis=1, initial=0.0)
    if not np.isfinite(largest).all():
        raise ValueError(f"{np.count_nonzero(~np.isfinite(largest))} of {len(snapshots)} snapshots hold NaN or "
                         "infinity: leave them out, or find out why")
    acting = largest > 0
    if not acting.any():
        raise ValueError(f"all {len(snapshots)} snapshots vanish: a POD basis needs one displacement that does not")
    # by a power of two that its own size cannot overflow: twice half of the way
    half = -np.frexp(largest[acting])[1][:, None] // 2
    rest = -np.frexp(largest[acting])[1][:, None] - half
    rows = (snapshots[acting] * np.ldexp(1.0, half)) * np.ldexp(1.0, rest)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _worth_keeping(value: np.ndarray) -> np.ndarray:
    keep = value > NOISE * value[-1]
    keep[:-MAX_RANK] = False
    return keep


_SPACES: dict[int, tuple[weakref.ref, int, PodSpace]] = {}


def pod_of(scene: Scene, train: xr.Dataset) -> tuple[PodSpace, float]:
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
    scenes: ClassVar[tuple[str, ...]] = (
        StaticPointForces.name, HarmonicPointForce.name, HarmonicPatchForces.name)
    learns: ClassVar[bool] = True
    _basis: Basis

    def __init__(self, scene: Scene, rank: int | None = None, precision: str = "float64") -> None:
        if rank is not None and rank < 1:
            raise ValueError(f"rank={rank} is too low: keep at least one POD mode")
        super().__init__(scene, rank=rank, precision=check_precision(precision))

    @property
    def model_bytes(self) -> int:
        return self._basis.nbytes + self.participation.nbytes

    @property
    def online_bytes(self) -> int:
        return self._basis.field.nbytes + (2 if self.scene.harmonic else 1) * self._basis.field[0].nbytes

    def _fit(self, train: xr.Dataset) -> None:
        space, self.borrowed_seconds = pod_of(self.scene, train)
        vectors = space.truncated(self.settings["rank"])
        model = self.scene.full_order
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
        self._basis = Basis(shapes.T, self.scene.pad_rows, self.settings["precision"])

    def coordinates(self, cases: CaseArrays) -> np.ndarray:
        """(n_case, rank) ndarray: coordinates in the diagonalised reduced basis."""
        load = np.einsum("cf,cfk->ck", cases.force, self.participation[cases.node])
        if not self.scene.harmonic:
            return load
        omega = 2.0 * np.pi * cases.frequency
        return load / ((1.0 + 1j * cases.loss_factor)[:, None] * self.eigenvalue - (omega * omega)[:, None])

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        return combine(self.coordinates(cases), self._basis.rows(outputs), out)

    def best_approximation(self, values: np.ndarray) -> np.ndarray:
        rows = self._basis.field / np.linalg.norm(self._basis.field, axis=1, keepdims=True)
        return sla.solve(rows @ rows.T, rows @ values.T, assume_a="pos").T @ rows

    def _state(self) -> xr.Dataset:
        return xr.Dataset({
            "shape": (("pole", "dof"), self._basis.field, {"long_name": "Ritz shape in the POD basis"}),
            "eigenvalue": ("pole", self.eigenvalue, {"long_name": "Ritz value", "units": "rad2 s-2"}),
            "participation": (("load", "pole"), self.participation, {"long_name": "Ritz shape times unit load"})})

    def _restore(self, data: xr.Dataset) -> None:
        self.eigenvalue = data["eigenvalue"].values
        self.participation = data["participation"].values
        self._basis = Basis(data["shape"].values, self.scene.pad_rows, self.settings["precision"])
