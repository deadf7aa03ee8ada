"""Reference solutions: iterative refinement with residuals in twice the working precision.

Residuals are summed by compensated dot products, as if in 106 bits (Ogita, Rump, Oishi, SIAM J. Sci. Comput. 26, 2005,
1955: algorithm Dot2), and the solution is kept as an unevaluated sum of two doubles. The correction then contracts by
about condition times eps a step until the solution of the stored matrices is exact to the last digit
(Higham, Accuracy and Stability of Numerical Algorithms, chapter 12).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from rom.fullorder.factorization import Factorization
from rom.fullorder.symmetric import SymmetricMatrix

Pair = tuple[NDArray[np.float64], NDArray[np.float64]]

_STEPS = 40
_SPLITTER = 2.0**27 + 1
_DONE = 2.0**-60


def refined_solution(
    matrix: Any, rhs: ArrayLike, factorization: Factorization
) -> tuple[NDArray, NDArray[np.float64]]:
    """Solve A x = b to full double precision with the help of an approximate factor.

    Parameters
    ----------
    matrix : (n, n) scipy sparse matrix or SymmetricMatrix, or a sequence of (number, matrix)
        A; a sequence stands for the sum of its products, which is then never rounded:
        ``[(1 + 1j * eta, K), (-omega**2, M)]``.
    rhs : (n,) or (n, k) array
    factorization : Factorization
        Of A or of something near it.

    Returns
    -------
    solution : (n,) or (n, k) ndarray
        Complex if anything is.
    error : () or (k,) ndarray [1]
        Estimate of each column's relative error in the 2-norm: what the next corrections would still add, at least
        2^-53; infinite where the corrections do not shrink.

    Raises
    ------
    ValueError
        If sizes differ.
    """
    terms = [(complex(c), _Rows(part)) for c, a in _terms(matrix) for c, part in _real_parts(complex(c), a)]
    b = np.asarray(rhs)
    if b.ndim not in (1, 2) or any(rows.n != len(b) for _, rows in terms) or factorization.n != len(b):
        raise ValueError(
            f"the right-hand side has shape {b.shape} and the factorization {factorization.n} rows: matrix, "
            "factorization and right-hand side must have the same size"
        )
    kind = complex if b.dtype.kind == "c" or factorization.dtype.kind == "c" or any(c.imag for c, _ in terms) else float
    columns = b.reshape(len(b), -1).astype(kind)
    high, low = np.zeros_like(columns), np.zeros_like(columns)
    k = columns.shape[1]
    error, before = np.full(k, np.inf), np.full(k, np.inf)
    active = np.ones(k, dtype=bool)
    for index in range(_STEPS):
        part = np.flatnonzero(active)
        left = _residual(terms, columns[:, part], high[:, part], low[:, part])
        step = factorization.solve(left).reshape(len(b), -1)
        step = step if kind is complex else step.real
        size = np.linalg.norm(step, axis=0)
        scale = np.linalg.norm(high[:, part] + step, axis=0)
        shrinks = size < 0.5 * before[part]
        taken = part[shrinks]
        high[:, taken], low[:, taken] = _add(high[:, taken], low[:, taken], step[:, shrinks])
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.where(np.isfinite(before[part]), size / before[part], 0.5)
            remaining = np.where(scale > 0, size * ratio / (1 - ratio) / scale, 0.0)
            stuck = np.where(scale > 0, before[part] / scale, 0.0) if index > 1 else np.inf  # not one step has shrunk
        error[part] = np.where(shrinks, remaining, stuck)
        before[part] = size
        active[part] = shrinks & (size > _DONE * scale)
        if not active.any():
            break
    error = np.where(error < 0.5, np.maximum(error, 2.0**-53), np.inf)
    return (high + low).reshape(b.shape), error.reshape(b.shape[1:])


def _terms(matrix: Any) -> Sequence[tuple[complex, Any]]:
    return matrix if isinstance(matrix, (list, tuple)) else [(1.0, matrix)]


def _real_parts(coefficient: complex, matrix: Any) -> list[tuple[complex, sp.csr_array]]:
    rows = sp.csr_array(matrix.to_csc() if isinstance(matrix, SymmetricMatrix) else matrix)
    if rows.dtype.kind != "c":
        return [(coefficient, rows)]
    return [(coefficient, sp.csr_array(rows.real)), (1j * coefficient, sp.csr_array(rows.imag))]


class _Rows:
    """A real sparse matrix with its rows padded to one length, so that a product runs over the entries of all rows."""

    def __init__(self, matrix: sp.csr_array) -> None:
        matrix = sp.csr_array(matrix, dtype=np.float64)
        matrix.sum_duplicates()
        self.n, self.matrix = matrix.shape[0], matrix
        count = np.diff(matrix.indptr)
        width = int(count.max(initial=0))
        rows = np.repeat(np.arange(self.n), count)
        slot = np.arange(matrix.nnz) - np.repeat(matrix.indptr[:-1], count)
        self.columns, self.values = np.zeros((width, self.n), dtype=np.intp), np.zeros((width, self.n))
        self.columns[slot, rows], self.values[slot, rows] = matrix.indices, matrix.data

    def product(self, x: NDArray[np.float64]) -> Pair:
        """A x for x : (n, k), as a sum of two doubles."""
        total, rest = np.zeros_like(x), np.zeros_like(x)
        for columns, values in zip(self.columns, self.values, strict=True):
            product, error = _two_product(values[:, None], x[columns])
            total, carried = _two_sum(total, product)
            rest += carried + error
        return total, rest


def _residual(terms: list[tuple[complex, _Rows]], b: NDArray, high: NDArray, low: NDArray) -> NDArray:
    """b - A (high + low), rounded once at the end."""
    if b.dtype.kind != "c":
        total: Pair = (b.copy(), np.zeros_like(b))
        for coefficient, rows in terms:
            product = rows.product(high)
            total = _plus(total, _times(-coefficient.real, (product[0], product[1] + rows.matrix @ low)))
        return total[0] + total[1]
    k = b.shape[1]
    flat = np.concatenate([high.real, high.imag], axis=1), np.concatenate([low.real, low.imag], axis=1)
    real, imaginary = (b.real.copy(), np.zeros_like(b.real)), (b.imag.copy(), np.zeros_like(b.real))
    for c, rows in terms:
        first, second = rows.product(flat[0])
        second = second + rows.matrix @ flat[1]
        x, y = (first[:, :k], second[:, :k]), (first[:, k:], second[:, k:])
        real = _plus(_plus(real, _times(-c.real, x)), _times(c.imag, y))
        imaginary = _plus(_plus(imaginary, _times(-c.real, y)), _times(-c.imag, x))
    return (real[0] + real[1]) + 1j * (imaginary[0] + imaginary[1])


def _two_sum(a: NDArray, b: NDArray) -> Pair:
    """a + b exactly, as rounded sum and error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _split(a: Any) -> tuple[Any, Any]:
    spread = _SPLITTER * a
    high = spread - (spread - a)
    return high, a - high


def _two_product(a: Any, b: Any) -> Pair:
    """a b exactly, as rounded product and error (Dekker, Veltkamp)."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _split(a), _split(b)
    return product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


def _times(factor: float, x: Pair) -> Pair:
    product, error = _two_product(factor, x[0])
    return product, error + factor * x[1]


def _plus(a: Pair, b: Pair) -> Pair:
    total, error = _two_sum(a[0], b[0])
    return total, error + a[1] + b[1]


def _add(high: NDArray, low: NDArray, step: NDArray) -> tuple[NDArray, NDArray]:
    """(high + low) + step, renormalised; complex arrays part by part."""
    if high.dtype.kind == "c":
        real, imaginary = _add(high.real, low.real, step.real), _add(high.imag, low.imag, step.imag)
        return real[0] + 1j * imaginary[0], real[1] + 1j * imaginary[1]
    total, error = _two_sum(high, step)
    return _two_sum(total, error + low)
