"""How far the answer of a direct solve can be trusted: condition number, and the error that rounding leaves.

The condition number belongs to the matrix alone and is usually far too pessimistic, since finite-element matrices of
unequal elements and tissues are badly scaled. What rounding does to one answer u is judged entry by entry instead:
stored entries and products carry errors of about eps (|A| |u| + |b|), of no common sign, and A^-1 carries them on
(Skeel 1979; Higham, Accuracy and Stability of Numerical Algorithms, sections 7.2 and 15.1). One solve with such a
right-hand side, signs drawn at random, shows their size.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from rom.fullorder.factorization import Factorization, factorize
from rom.fullorder.symmetric import SymmetricMatrix, symmetric_matrix

#: Unit roundoff of double precision.
EPS = 2.0**-53


class IllConditionedWarning(UserWarning):
    """An answer whose accuracy is in doubt, because rounding alone moves it too far."""


def condition_estimate(model_or_matrix: Any, factorization: Factorization | None = None) -> float:
    """Estimate of the condition number ||A||_1 ||A^-1||_1, seldom less than a third of it and never more.

    Block 1-norm estimation of the inverse from a handful of solves (Higham and Tisseur, SIAM J. Matrix Anal. Appl.
    21, 2000, 1185).

    Parameters
    ----------
    model_or_matrix : SecondOrderModel, SymmetricMatrix or (n, n) scipy sparse matrix
        A model stands for its stiffness.
    factorization : Factorization, optional
        Of that matrix; made here where it is missing.

    Returns
    -------
    condition : float [1]

    Raises
    ------
    ValueError
        If the matrix is not symmetric and finite, or of another size than the factorization.
    SolverError
        If it is singular.
    """
    stiffness = getattr(model_or_matrix, "stiffness", None)
    if stiffness is not None and factorization is None:
        factorization = model_or_matrix.static_factorization
    matrix = symmetric_matrix(model_or_matrix if stiffness is None else stiffness)
    factor = factorize(matrix) if factorization is None else factorization
    if factor.n != matrix.n:
        raise ValueError(f"the matrix has {matrix.n} rows and the factorization {factor.n}: give a matrix and its own")
    return float(row_sums(matrix).max() * inverse_norm(factor))


def inverse_norm(factor: Factorization) -> float:
    """Estimate of ||A^-1||_1, from below."""
    n, dtype = factor.n, factor.dtype
    if n < 5:  # the block method needs more columns than that
        return float(np.abs(factor.solve(np.eye(n))).sum(axis=0).max())

    def adjoint(b: NDArray) -> NDArray:
        return factor.solve(np.conj(b)).conj()  # A^-H = conj(A^-1), as A is symmetric

    inverse = spla.LinearOperator(
        (n, n), matvec=factor.solve, rmatvec=adjoint, matmat=factor.solve, rmatmat=adjoint, dtype=dtype
    )
    # the start of the method is drawn from numpy's global generator: fixed here, and given back as it was
    state = np.random.get_state()  # noqa: NPY002 - scipy draws from the legacy generator
    np.random.seed(0)  # noqa: NPY002 - as above
    try:
        return float(spla.onenormest(inverse))
    finally:
        np.random.set_state(state)  # noqa: NPY002 - as above


def row_sums(matrix: SymmetricMatrix) -> NDArray[np.float64]:
    """(n,) ndarray: sum of the entries' sizes in each row."""
    return absolute_product(matrix, np.ones(matrix.n))


def absolute_product(matrix: SymmetricMatrix, x: NDArray) -> NDArray[np.float64]:
    """|A| |x| for x : (n,) or (n, k)."""
    return SymmetricMatrix(matrix.indptr, matrix.indices, np.abs(matrix.values)).product(np.abs(x))


def rounding_probe(matrix: SymmetricMatrix) -> NDArray[np.float64]:
    """(n,) ndarray: right-hand side whose solution shows how far errors in the matrix' entries are carried."""
    return random_signs(matrix.n) * row_sums(matrix)


def rounding_error(factor: Factorization, matrix: Any, u: NDArray, b: NDArray) -> NDArray[np.float64]:
    """Estimate of the relative error that rounding of entries and products leaves in each column of u.

    Parameters
    ----------
    factor : Factorization
        Of `matrix`.
    matrix : SymmetricMatrix or (n, n) scipy sparse matrix
    u, b : (n,) or (n, k) ndarray
        Computed solution and right-hand side.

    Returns
    -------
    error : () or (k,) ndarray [1]
        In the 2-norm; one draw of random signs, so good for the order of magnitude.
    """
    size = absolute_product(symmetric_matrix(matrix), u) + np.abs(b)
    moved = factor.solve(EPS * (random_signs(factor.n) * size.T).T)
    scale = np.linalg.norm(u, axis=0)
    return np.divide(np.linalg.norm(moved, axis=0), scale, out=np.zeros_like(scale), where=scale > 0)


def random_signs(n: int) -> NDArray[np.float64]:
    """(n,) ndarray of +1 and -1, always the same."""
    return np.where(np.random.default_rng(7).random(n) < 0.5, -1.0, 1.0)


__all__ = ["IllConditionedWarning", "condition_estimate", "rounding_error"]
