"""Solutions whose residual is looked at before they are given away."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rom.errors import SolverError
from rom.fullorder.conditioning import trusted_solution
from rom.fullorder.factorization import SINGULAR_RESIDUAL, Factorization
from rom.fullorder.products import relative_size

log = logging.getLogger(__name__)

#: Relative residual above which a solution is refined once.
REFINEMENT_RESIDUAL = 1e-11

#: Forces beyond this, or below its reciprocal, are scaled first [N]: their squares leave double precision.
LARGE_FORCE = 1e120


def checked_solution(
    factor: Factorization,
    f: NDArray,
    apply: Callable[[NDArray], NDArray],
    terms: list[tuple[complex, sp.csr_array]],
) -> NDArray:
    """Columns of f solved, refined where the residual asks for it, and judged.

    Parameters
    ----------
    factor : Factorization
    f : (n,) or (n, k) ndarray [N]
    apply : callable
        Product of the matrix with a field.
    terms : list of (factor, matrix)
        What adds up to the matrix.

    Raises
    ------
    SolverError
        Where the residual says that the matrix is singular.
    """
    size = np.maximum(np.abs(f.real), np.abs(f.imag)).max(axis=0, initial=0.0)
    if np.any((size > 0) & ((size < 1 / LARGE_FORCE) | (size > LARGE_FORCE))):
        unit = np.ldexp(1.0, np.clip(np.frexp(size)[1], -1000, 1000))  # powers of two change no digit
        return checked_solution(factor, f / unit, apply, terms) * unit
    u = factor.solve(f)
    remainder = f - apply(u)
    worst = np.max(relative_size(remainder, f), initial=0.0)
    if worst > REFINEMENT_RESIDUAL:
        refined = u + factor.solve(remainder)
        after = np.max(relative_size(f - apply(refined), f), initial=0.0)
        log.debug("refinement: relative residual %.1e -> %.1e", worst, after)
        if after < worst:
            u, worst = refined, after
    trusted = trusted_solution(factor, terms, u, f)
    if trusted is not u:  # refined until it stood still; a residual in working precision says no more
        return trusted
    if not worst <= SINGULAR_RESIDUAL:
        raise SolverError(
            f"the relative residual of the solution is {worst:.1e}, allowed {SINGULAR_RESIDUAL:.0e}: the "
            "matrix is singular to working precision (a rigid motion, or an undamped resonance)"
        )
    return u
