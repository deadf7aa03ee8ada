"""How far the answer of a direct solve can be trusted: condition number, and the error that rounding leaves.

The condition number belongs to the matrix alone and is usually far too pessimistic, since finite-element matrices of
unequal elements and tissues are badly scaled. What rounding does to one answer u is judged entry by entry instead:
stored entries and products carry errors of about eps (|A| |u| + |b|), of no common sign, and A^-1 carries them on
(Skeel 1979; Higham, Accuracy and Stability of Numerical Algorithms, sections 7.2 and 15.1). One solve with such a
right-hand side, signs drawn at random, shows their size.
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from rom.errors import SolverError
from rom.fullorder.factorization import Factorization, factorize, random_signs
from rom.fullorder.refinement import refined_solution
from rom.fullorder.symmetric import symmetric_matrix

log = logging.getLogger(__name__)

#: Unit roundoff of double precision.
EPS = 2.0**-53

#: Relative error by rounding below which an answer is returned as it is.
SUSPICION = 1e-7

#: Relative error by rounding above which an answer comes with a warning.
DOUBT = 1e-6

#: Right-hand sides refined together: their products stay in the processor's cache.
COLUMNS = 8

#: Relative error by rounding above which there is no answer.
HOPELESS = 1e-2


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
    return float(matrix.absolute_product(np.ones(matrix.n)).max() * inverse_norm(factor))


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


def rounding_error(factor: Factorization, u: NDArray, b: NDArray) -> NDArray[np.float64]:
    """Estimate of the relative error that rounding of entries and products leaves in each column of u.

    Parameters
    ----------
    factor : Factorization
        Of A.
    u, b : (n,) or (n, k) ndarray
        Computed solution and right-hand side.

    Returns
    -------
    error : () or (k,) ndarray [1]
        In the 2-norm; one draw of random signs, so good for the order of magnitude.
    """
    size = factor.matrix.absolute_product(u) + np.abs(b)
    # other signs than the gain's, so that a mode which those happen to miss is met here
    moved = factor.solve(EPS * (random_signs(factor.n)[::-1] * size.T).T)
    scale = np.linalg.norm(u, axis=0)
    return np.divide(np.linalg.norm(moved, axis=0), scale, out=np.zeros_like(scale), where=scale > 0)


def trusted_solution(factor: Factorization, terms: Sequence[tuple[complex, Any]], u: NDArray, b: NDArray) -> NDArray:
    """The computed solution where rounding cannot have harmed it, else the refined one, with a warning if need be.

    One solve a factorization (kept with it) tells cheaply whether to look closer.

    Parameters
    ----------
    factor : Factorization
        Of A.
    terms : sequence of (number, matrix)
        A as a sum, see `refined_solution`.
    u, b : (n,) or (n, k) ndarray
        Computed solution and right-hand side.

    Returns
    -------
    u : (n,) or (n, k) ndarray

    Warns
    -----
    IllConditionedWarning
        Where rounding of the matrix' entries alone moves the answer by more than `DOUBT`.

    Raises
    ------
    SolverError
        Where it moves the answer by more than `HOPELESS`.
    """
    scale = np.linalg.norm(u, axis=0)
    peak = np.divide(np.max(np.abs(u), axis=0), scale, out=np.zeros_like(scale), where=scale > 0)
    if EPS * factor.rounding_gain * np.max(peak, initial=0.0) <= SUSPICION:
        return u
    error = rounding_error(factor, u, b)
    worst = float(np.max(error, initial=0.0))
    log.debug("rounding moves the answer by a relative %.1e", worst)
    if worst <= SUSPICION:
        return u
    if worst <= HOPELESS:  # NaN is hopeless too
        doubtful = np.flatnonzero(np.atleast_1d(error) > SUSPICION)
        u, columns = u.copy(order="K"), np.reshape(b, (factor.n, -1))
        for start in range(0, len(doubtful), COLUMNS):
            part = doubtful[start : start + COLUMNS]
            refined, own = refined_solution(terms, columns[:, part], factor)
            u.reshape(factor.n, -1, order="A")[:, part] = refined
            worst = max(worst, float(np.max(own)))
    if not worst <= HOPELESS:
        raise SolverError(
            f"rounding alone moves the solution by a relative {worst:.1e}, allowed {HOPELESS:.0e}: the matrix is "
            "singular to working precision (a rigid motion, or an undamped resonance); hold the body, move the "
            "frequency, or give a loss factor"
        )
    if worst > DOUBT:
        warnings.warn(
            f"rounding of the matrix alone moves the solution by a relative {worst:.1e}, as near a resonance without "
            "damping: move the frequency, or give a loss factor",
            IllConditionedWarning,
            stacklevel=4,
        )
    return u


__all__ = ["IllConditionedWarning", "condition_estimate", "rounding_error", "trusted_solution"]
