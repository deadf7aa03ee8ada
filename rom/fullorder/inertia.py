"""How many eigenvalues of a symmetric matrix are negative, counted from a factor and checked against its rounding.

By Sylvester's law of inertia the pivots of A = L D L^T tell. What was factorised in floating point is a nearby matrix
B = A + E, and B has the inertia of A if ``||E B^-1|| < 1`` in any norm: then A = (I - t E B^-1) B is regular for
every t from 0 to 1, and no eigenvalue crosses zero on the way. With a vector g of independent standard normal
numbers,

    P(||E B^-1 g|| <= r) <= sqrt(2 / pi) r / ||E B^-1||,

since the part of E B^-1 g along the largest singular vector is normal with that deviation. A trial solve y = B^-1 g
shows ``E B^-1 g = g - A y``: where three trials leave residuals of at most r_1, r_2, r_3, the count is that of A but
for a probability of ``0.8^3 r_1 r_2 r_3`` over the draw (Dixon 1983 argues likewise for condition numbers). What the
trial solves themselves round is of the size of E or less, and is assumed not to hide it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rom.errors import SolverError
from rom.fullorder.factorization import factorize
from rom.fullorder.symmetric import SymmetricMatrix

TRIALS = 3
RISK = 1e-12
"""Probability, over the draw of the trials, up to which a count is believed to be wrong."""


def count_negative(matrix: SymmetricMatrix, scale: NDArray[np.float64], *, backend: str = "auto") -> int:
    """Number of negative eigenvalues of a real symmetric matrix.

    Parameters
    ----------
    matrix : SymmetricMatrix
    scale : (n,) ndarray
        Positive numbers in whose units residuals are measured, such as square roots of a diagonal.
    backend : {"auto", "pardiso", "superlu"}

    Raises
    ------
    SolverError
        If the matrix is singular to working precision, or rounding of its factor may have changed the count.
    """
    with factorize(matrix, backend=backend) as factor:
        count = factor.negative_eigenvalues
        trial = np.random.default_rng(0).standard_normal((matrix.n, TRIALS)) * scale[:, None]
        with np.errstate(all="ignore"):
            residual = np.linalg.norm((trial - matrix.product(factor.solve(trial))) / scale[:, None], axis=0)
    if not np.prod(0.8 * residual) <= RISK:
        raise SolverError(
            f"rounding of its factor may hide the signs of a matrix's eigenvalues (trial solves leave "
            f"{np.max(residual):.1e}): the matrix is too ill-conditioned, or the shift too near an eigenvalue"
        )
    return count
