"""Load-dependent vectors: Lanczos on K^-1 M in the K inner product, deflated of the kept modes.

Started from the static response of what the modes leave of a load, v = K^-1 f - sum phi_k (phi_k^T f) / lambda_k, the
vectors Q satisfy Q^T K Q = I and Q^T M Q = T (tridiagonal), and Q^T f = beta_0 e_1. Galerkin's reduced system is thus
((1 + i eta) I - omega^2 T) y = beta_0 e_1, and its residual r is known without a solve:

    K^-1 r = omega^2 beta_p y_p q_(p+1),    ||r||_(K^-1) = omega^2 beta_p |y_p|,

which costs one scalar a load. With T = S diag(theta) S^T the answer is a sum of poles, like the modes' own.
(Wilson, Yuan, Dickens 1982 for load-dependent Ritz vectors; Nour-Omid and Clough 1984 for their Lanczos form.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from rom.fullorder.modes import Modes
from rom.fullorder.second_order import SecondOrderModel

BREAKDOWN = 1e-12
"""Share of a new vector outside the space so far below which that space is exhausted."""
KEPT_BY_SECOND_PASS = 0.5
"""A vector that a second orthogonalisation shortens further lies in the space already (Parlett, section 6.9)."""


@dataclass(frozen=True)
class LoadVectors:
    """Ritz vectors of each load in the space that the modes leave.

    vectors : (n_load, p, n) ndarray [m J^-1/2]
        ``vectors[l] K vectors[l]^T = I``, all K-orthogonal to the modes.
    theta : (n_load, p) ndarray [s^2]
        Eigenvalues of T: reciprocals of the Ritz values.
    first, last : (n_load, p) ndarray
        First row of S times beta_0 [J^1/2]; last row of S.
    beta : (n_load,) ndarray [s^2]
        Norm of the vector that would come next.
    following : (n_load, n) ndarray [m J^-1/2]
        That vector, K-normalised; zero where the space is exhausted.
    """

    vectors: np.ndarray
    theta: np.ndarray
    first: np.ndarray
    last: np.ndarray
    beta: np.ndarray
    following: np.ndarray


def load_vectors(model: SecondOrderModel, modes: Modes, loads: np.ndarray, count: int) -> LoadVectors:
    """``count`` load-dependent vectors for each column of ``loads``.

    Parameters
    ----------
    model : SecondOrderModel
    modes : Modes
        Kept modes, mass-orthonormal.
    loads : (n, n_load) ndarray [N]
    count : int
        At least one; one vector is the residual flexibility.

    Raises
    ------
    ValueError
        For a count below one.
    """
    if count < 1:
        raise ValueError(f"{count} load-dependent vectors are too few: ask for one or more, or use the method `modal`")
    n, n_load = loads.shape
    stiffness, mass = sp.csr_matrix(model.stiffness), sp.csr_matrix(model.mass)
    shape = modes.shape
    mass_shape = mass @ shape

    def deflate(block: np.ndarray) -> np.ndarray:
        return block - shape @ (mass_shape.T @ block)

    # loads of any size, without squares that overflow or vanish; powers of two, so that no digit changes
    size = np.abs(loads).max(axis=0, initial=0.0)
    unit = np.ldexp(1.0, -np.frexp(np.where(size > 0, size, 1.0))[1])
    krylov, image = np.zeros((count + 1, n, n_load)), np.zeros((count + 1, n, n_load))  # q_j and K q_j
    alpha, beta = np.zeros((count, n_load)), np.zeros((count + 1, n_load))

    def keep(j: int, block: np.ndarray, stiff: np.ndarray, smallest: np.ndarray | float) -> None:
        norm = _norm(block, stiff)
        beta[j] = np.where(norm > smallest, norm, 0.0)
        scale = np.divide(1.0, norm, out=np.zeros(n_load), where=beta[j] > 0)
        np.multiply(block, scale, out=krylov[j])
        np.multiply(stiff, scale, out=image[j])

    start = model.solve_static(loads * unit)
    whole = _norm(start, stiffness @ start)
    start = deflate(start)
    once = _norm(start, stiffness @ start)
    start = deflate(start)
    keep(0, start, stiffness @ start, np.maximum(BREAKDOWN * whole, KEPT_BY_SECOND_PASS * once))
    for j in range(count):
        weighted = mass @ krylov[j]
        alpha[j] = np.einsum("ij,ij->j", krylov[j], weighted)
        block = deflate(model.solve_static(weighted))
        stiff = stiffness @ block
        norms = [_norm(block, stiff)]
        for _ in range(2):  # full re-orthogonalisation in the K inner product; twice is enough
            for i in range(j + 1):
                share = np.einsum("ij,ij->j", krylov[i], stiff)
                block -= krylov[i] * share
                stiff -= image[i] * share
            # deflated again, since a block that shrinks shows what the first time left of the modes; and its image
            # afresh, since differences of images lose what is left of an exhausted space
            block = deflate(block)
            stiff = stiffness @ block
            norms.append(_norm(block, stiff))
        keep(j + 1, block, stiff, np.maximum(BREAKDOWN * norms[0], KEPT_BY_SECOND_PASS * norms[1]))
    tridiagonal = np.zeros((n_load, count, count))
    row = np.arange(count)
    tridiagonal[:, row, row] = alpha.T
    tridiagonal[:, row[1:], row[:-1]] = tridiagonal[:, row[:-1], row[1:]] = beta[1:count].T
    theta, s = np.linalg.eigh(tridiagonal)
    vectors = np.einsum("lij,inl->ljn", s, krylov[:count], optimize=True)
    return LoadVectors(vectors, theta, (beta[0] / unit)[:, None] * s[:, 0, :], s[:, -1, :].copy(), beta[count],
                       krylov[count].T.copy())


def _norm(block: np.ndarray, stiff: np.ndarray) -> np.ndarray:
    """(n_load,) ndarray: K norm of each column, given its product with K."""
    return np.sqrt(np.maximum(np.einsum("ij,ij->j", block, stiff), 0.0))
