"""Reduced model of a fingertip whose tissues have loss factors of their own.

Z = K + i sum eta_t K_t - omega^2 M is projected tissue by tissue, once, onto real vectors W that hold

- natural modes and each load's Krylov vectors K^-1 f, K^-1 M K^-1 f, ..., as for one loss factor;
- for each set of loss factors that it is prepared for, with L = sum eta_t K_t: real and imaginary part of the Krylov
  vectors Z_0^-1 f, Z_0^-1 M Z_0^-1 f, ... of Z_0 = K + i L, which match the response at 0 Hz and its derivatives by
  omega^2; and K^-1 L phi_k, what the losses of a kept mode excite statically in the modes that are left out.

Modes alone would not do: unequal losses bend the shapes, and what bends them lies outside the modes. `galerkin`
solves a small dense system a case; it is exact within its space, so that more modes or vectors only make it better.
`uncoupled` keeps the diagonal of the projected losses only: the real-mode model, with modal loss factors as
`analysis.tissue_damping` has them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext

import numpy as np
import scipy.linalg as sla
from numpy.typing import ArrayLike, NDArray

from analysis.tissue_damping import loss_factors, loss_stiffness
from rom.fingertip import Fingertip
from rom.fingertip.anatomy import TISSUES
from rom.fullorder import Modes, SecondOrderModel, blas_threads
from rom.fullorder.load_vectors import load_vectors

Floats = NDArray[np.float64]

#: Vectors are dropped whose own part is below this share of their energy: the rest repeats the others to rounding.
DEPENDENT = 1e-10

#: Frequencies in one call up to which the BLAS keeps its threads.
FEW = 8


class TissueDampedModel:
    """Reduced model for a few loads, any frequency and any loss factors.

    Parameters
    ----------
    fingertip : Fingertip
    modes : Modes
        Natural modes of its stiffness and mass to keep.
    loads : (n_free, k) array [N]
        Unit loads.
    vectors : int
        Krylov vectors of each load; at least one.
    prepared_for : sequence of mapping of tissue to float [1]
        Sets of unequal loss factors; others are answered too, less accurately the further they lie away.
    model : SecondOrderModel, optional
        Of the fingertip, where it is factorized already.

    Attributes
    ----------
    basis : (n_free, r) ndarray [kg^-1/2]
        W: mass-orthonormal Ritz vectors, W^T K W = diag(eigenvalue); the first are the kept modes.
    eigenvalue : (r,) ndarray [rad^2/s^2]
    tissue_stiffness : (6, r, r) ndarray [rad^2/s^2]
        W^T K_t W.
    force : (r, k) ndarray [N kg^-1/2]
        W^T f.

    Raises
    ------
    ValueError
        For loads of another length, or fewer than one vector.
    """

    def __init__(
        self,
        fingertip: Fingertip,
        modes: Modes,
        loads: ArrayLike,
        vectors: int = 3,
        prepared_for: Sequence[Mapping[str, float]] = (),
        model: SecondOrderModel | None = None,
    ) -> None:
        loads = np.asarray(loads, dtype=np.float64)
        if loads.ndim != 2 or len(loads) != len(fingertip.free_dofs):
            rows = len(fingertip.free_dofs)
            raise ValueError(f"The loads have shape {loads.shape}, but they need ({rows}, k): one row a free dof.")
        if model is None:
            model = SecondOrderModel(fingertip.stiffness, fingertip.mass)
        own = load_vectors(model, modes, loads, vectors).vectors
        parts = [modes.shape, own.reshape(-1, model.n).T]
        for loss_factor in prepared_for:
            loss = loss_stiffness(fingertip, loss_factor)
            parts += [_complex_krylov(model, loss, loads, vectors), model.solve_static(loss @ modes.shape)]
        self.basis, self.eigenvalue = _ritz(model, np.concatenate(parts, axis=1))
        by_tissue = fingertip.stiffness_by_tissue
        self.tissue_stiffness = np.array([self.basis.T @ (by_tissue[name] @ self.basis) for name in TISSUES])
        self.force = self.basis.T @ loads

    @property
    def size(self) -> int:
        """int : number of vectors r."""
        return len(self.eigenvalue)

    def ritz_loss_factors(self, loss_factor: float | Mapping[str, float]) -> Floats:
        """(r,) ndarray [1] : w^T L w / lambda of each Ritz vector, for a natural mode its modal loss factor."""
        own = np.einsum("tkk->tk", self.tissue_stiffness)
        return loss_factors(loss_factor) @ own / self.eigenvalue

    def galerkin(self, frequency: ArrayLike, loss_factor: float | Mapping[str, float]) -> NDArray[np.complex128]:
        """Coordinates with every coupling between the vectors.

        Parameters
        ----------
        frequency : (f,) array [Hz]
        loss_factor : float or mapping of tissue to float [1]

        Returns
        -------
        coordinates : (f, r, k) ndarray
            See `field`.
        """
        loss = np.tensordot(loss_factors(loss_factor), self.tissue_stiffness, axes=1)
        points = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
        answer = np.empty((len(points), *self.force.shape), dtype=np.complex128)
        # systems of this size gain nothing from threads, but looking for them takes longer than a few solutions
        with blas_threads(1) if len(points) > FEW else nullcontext():
            for j, one in enumerate(points):
                matrix = np.diag(self.eigenvalue - (2 * np.pi * one) ** 2) + 1j * loss
                answer[j] = np.linalg.solve(matrix, self.force)
        return answer

    def uncoupled(self, frequency: ArrayLike, loss_factor: float | Mapping[str, float]) -> NDArray[np.complex128]:
        """Coordinates of each vector by itself, with its own loss factor; see `galerkin`."""
        stiffness = self.eigenvalue * (1 + 1j * self.ritz_loss_factors(loss_factor))
        inertia = (2 * np.pi * np.atleast_1d(np.asarray(frequency, dtype=np.float64))) ** 2
        return self.force / (stiffness - inertia[:, None])[:, :, None]

    def field(self, coordinates: NDArray) -> NDArray[np.complex128]:
        """Displacement (n_free, k) [m] from the coordinates (r, k) of one frequency."""
        parts = self.basis @ np.concatenate([coordinates.real, coordinates.imag], axis=1)  # the basis stays real
        return parts[:, : coordinates.shape[1]] + 1j * parts[:, coordinates.shape[1] :]

    def receptance(self, coordinates: NDArray) -> NDArray[np.complex128]:
        """Displacement at each load along it: (f, k) ndarray [m/N] from (f, r, k) coordinates of unit loads."""
        return np.einsum("rk,frk->fk", self.force, coordinates)


def _complex_krylov(model: SecondOrderModel, loss, loads: Floats, vectors: int) -> Floats:
    """Real and imaginary parts of Z_0^-1 f, Z_0^-1 M Z_0^-1 f, ... : (n, 2 k vectors) ndarray."""
    lossy = SecondOrderModel(model.stiffness, model.mass, loss_stiffness=loss)
    found: list[Floats] = []
    field: NDArray = loads
    for _ in range(vectors):
        field = lossy.solve_harmonic(field, 0.0, 0.0)
        field = field / np.linalg.norm(field, axis=0)
        found += [field.real, field.imag]
        field = model.mass @ field
    return np.concatenate(found, axis=1)


def _ritz(model: SecondOrderModel, vectors: Floats) -> tuple[Floats, Floats]:
    """Mass-orthonormal Ritz vectors of the pencil in the span of some vectors, and their eigenvalues."""
    energy = np.sum(vectors * (model.stiffness @ vectors), axis=0)
    some = vectors[:, energy > 0] / np.sqrt(energy[energy > 0])
    for _ in range(2):  # the second time because rounding is divided by the smallest that is kept
        gram = some.T @ (model.stiffness @ some)
        size, turn = sla.eigh((gram + gram.T) / 2)
        keep = size > DEPENDENT * size[-1]
        some = some @ (turn[:, keep] / np.sqrt(size[keep]))
    gram = some.T @ (model.mass @ some)
    flexibility, turn = sla.eigh((gram + gram.T) / 2)
    order = np.argsort(-flexibility)
    return some @ (turn[:, order] / np.sqrt(flexibility[order])), 1 / flexibility[order]
