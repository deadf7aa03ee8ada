"""Natural modes K phi = lambda M phi by shift-invert Lanczos, proved complete by a Sturm count.

By Sylvester's law of inertia the number of negative pivots of K - sigma M = L D L^T is the number of eigenvalues
below sigma (the Sturm count; Bathe, Finite Element Procedures, chapter 11). Taken in a gap between computed
eigenvalues it shows that none was missed, which a Krylov method alone cannot promise for repeated or close modes.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import ArrayLike, NDArray

from rom.errors import SolverError
from rom.fullorder.blas import blas_threads
from rom.fullorder.dynamic_stiffness import DynamicStiffness, check_not_negative
from rom.fullorder.factorization import Factorization, factorize
from rom.fullorder.inertia import count_negative

log = logging.getLogger(__name__)

#: Relative distance of neighbouring eigenvalues that counts as a gap, wide enough to put a shift in.
GAP = 1e-3

#: Models below this size are solved densely; Lanczos needs more unknowns than modes.
DENSE_SIZE = 200

#: Relative residual ||K phi - lambda M phi|| / ||K phi|| above which inverse iteration polishes the modes.
RESIDUAL = 1e-9

#: Allowance for rounding in an eigenvalue, relative.
ROUNDING = 1e-9

_ATTEMPTS = 3
_POLISHES = 2
_WORST_RESIDUAL = 1e-6


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest natural modes, mass-orthonormal and sorted by eigenvalue.

    Parameters
    ----------
    eigenvalue : (m,) ndarray [rad^2/s^2]
    shape : (n, m) ndarray [kg^-1/2]
        phi_i^T M phi_j = delta_ij and phi_i^T K phi_j = lambda_i delta_ij.
    residual : (m,) ndarray [1]
        ||K phi - lambda M phi|| / ||K phi||.
    sturm_count : int
        Number of eigenvalues below the shift; more than m if the last kept stands in a cluster with the next.
    sturm_shift : float [rad^2/s^2]
        Where the count was taken, in a gap of the spectrum.
    next_eigenvalue_bound : float [rad^2/s^2]
        No eigenvalue below this is missing from `eigenvalue`: the shift, or, where the request cuts a
        cluster, the next computed eigenvalue less its error. Infinite if all n modes are kept.
    left_out : (n, sturm_count - m) ndarray [kg^-1/2], optional
        Shapes of the rest of a cluster that the request cuts: with them all that the count counted is there.
    """

    eigenvalue: NDArray[np.float64]
    shape: NDArray[np.float64]
    residual: NDArray[np.float64]
    sturm_count: int
    sturm_shift: float
    next_eigenvalue_bound: float
    left_out: NDArray[np.float64] | None = None

    @property
    def count(self) -> int:
        """Number of modes kept."""
        return len(self.eigenvalue)

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Natural frequencies [Hz]."""
        return np.sqrt(np.maximum(self.eigenvalue, 0.0)) / (2 * math.pi)

    @property
    def sturm_shift_hz(self) -> float:
        """The shift as a frequency [Hz]."""
        return math.sqrt(self.sturm_shift) / (2 * math.pi)


def natural_modes(
    stiffness: Any,
    mass: Any,
    *,
    count: int | None = None,
    below_hz: float | None = None,
    factorization: Factorization | None = None,
    backend: str = "auto",
    seed: int = 0,
) -> Modes:
    """The lowest modes of a body that is held, none missed.

    Parameters
    ----------
    stiffness, mass : (n, n) scipy sparse matrix [N/m], [kg]
        Real symmetric, positive definite.
    count : int, optional
        How many modes; or
    below_hz : float [Hz], optional
        all modes below this frequency. Exactly one of the two.
    factorization : Factorization, optional
        Of `stiffness`, if it exists already.
    backend : {"auto", "pardiso", "superlu"}
        For factorizations made here; that of `factorization` where one is given.
    seed : int
        Of the start vector; the same seed gives the same modes.

    Raises
    ------
    ValueError
        If neither or both of `count` and `below_hz` are given or out of range, or K is not positive definite.
    SolverError
        If K is singular, or modes are still missing after three searches.
    """
    pencil = DynamicStiffness(stiffness, mass)
    n = pencil.n
    if (count is None) == (below_hz is None):
        raise ValueError(f"count is {count!r} and below_hz is {below_hz!r}: give exactly one of the two")
    if count is not None and not (int(count) == count and 1 <= count <= n):
        raise ValueError(
            f"the count of modes is {count!r}: it must be a whole number from 1 to {n}, the number of dofs"
        )
    factor = factorize(stiffness, backend=backend) if factorization is None else factorization
    backend, alive = factor.backend, True
    if factor.n != n or factor.dtype.kind == "c":
        raise ValueError(
            f"the factorization ({factor.n} dofs, {factor.dtype}) is not that of the real {n}-dof stiffness"
        )
    if factor.negative_eigenvalues:
        raise ValueError(
            f"the stiffness matrix has {factor.negative_eigenvalues} negative eigenvalues: it must be "
            "positive definite; look for inverted elements"
        )
    stiffness, mass = sp.csr_array(stiffness), sp.csr_array(mass)
    limit = math.inf
    if below_hz is not None:
        check_not_negative(below_hz, "frequency", "Hz")
        limit = (2 * math.pi * below_hz) ** 2
        expected = _estimate_count(pencil, limit, backend)
    else:
        expected = int(count or 0)

    size = min(n, expected + max(4, expected // 10))
    for attempt in range(_ATTEMPTS):
        if not alive:
            factor, alive = factorize(stiffness, backend=backend), True
        eigenvalue, shape = _search(stiffness, mass, factor, size, seed + attempt)
        wanted = int(np.searchsorted(eigenvalue, limit)) if count is None else int(count)
        top = _gap_above(eigenvalue, wanted, n)
        if top is None:
            log.debug("no gap above mode %d among %d: searching more", wanted, len(eigenvalue))
            size = min(n, 2 * size)
            continue
        below, shift = top
        if factorization is None and wanted == below:  # one factor in memory at a time
            factor.release()
            alive = False
        sturm = _count_below(pencil, shift, backend)
        if sturm == below:
            break
        log.warning("Sturm count %d, modes found %d below %.6g rad^2/s^2: searching again", sturm, below, shift)
        size = min(n, max(size, sturm) + 2 * abs(sturm - below) + 4)
    else:
        raise SolverError(
            f"the natural modes could not be proved complete in {_ATTEMPTS} searches (last: {size} vectors): "
            "ask for more modes, or another band limit"
        )
    bound = shift if below < n else math.inf
    if wanted < below:  # the request cuts a cluster, whose remaining modes lie below the shift
        bound = (
            (1 - ROUNDING)
            * eigenvalue[wanted]
            / (1 + eigenvalue[wanted] * _error(mass, factor, eigenvalue[:below], shape[:, :below]))
        )
    left_out = shape[:, wanted:below]
    eigenvalue, shape = _polished(stiffness, mass, shape[:, :wanted])
    residual = _residuals(stiffness, mass, eigenvalue, shape)
    if np.max(residual, initial=0.0) > _WORST_RESIDUAL:
        raise SolverError(
            f"a natural mode has a relative residual of {np.max(residual):.1e}, allowed "
            f"{_WORST_RESIDUAL:.0e}: the stiffness matrix is too ill-conditioned"
        )
    return Modes(eigenvalue, shape, residual, sturm, shift, float(bound), left_out)


def sturm_count(stiffness: Any, mass: Any, frequency_hz: float, *, backend: str = "auto") -> int:
    """Number of natural modes below a frequency, without computing any.

    Parameters
    ----------
    stiffness, mass : (n, n) scipy sparse matrix [N/m], [kg]
        Real symmetric, the mass positive definite.
    frequency_hz : float [Hz]
    backend : {"auto", "pardiso", "superlu"}

    Raises
    ------
    ValueError
        If the matrices or the frequency cannot be used.
    SolverError
        If the frequency is that of a mode to working precision.
    """
    check_not_negative(frequency_hz, "frequency", "Hz")
    return _count_below(DynamicStiffness(stiffness, mass), (2 * math.pi * frequency_hz) ** 2, backend)


def modal_assurance_criterion(a: ArrayLike, b: ArrayLike, weight: Any = None) -> NDArray[np.float64]:
    """MAC |a^H W b|^2 / ((a^H W a)(b^H W b)) of every pair of columns (Allemang 2003).

    Parameters
    ----------
    a, b : (n, p), (n, q) array
        Shapes, of any scale and sign.
    weight : (n, n) scipy sparse matrix, optional
        Symmetric positive definite, such as the mass; None for the identity.

    Returns
    -------
    mac : (p, q) ndarray [1]
        0 for orthogonal, 1 for parallel shapes.

    Raises
    ------
    ValueError
        If lengths differ or a shape is zero.
    """
    a, b = np.asarray(a), np.asarray(b)
    if a.ndim != 2 or b.ndim != 2 or len(a) != len(b):
        raise ValueError(f"the shapes are {a.shape} and {b.shape}: give (n, p) and (n, q) with the same n")
    wa, wb = (a, b) if weight is None else (weight @ a, weight @ b)
    scale_a, scale_b = (np.sum(x.conj() * wx, axis=0).real for x, wx in ((a, wa), (b, wb)))
    if not (np.all(scale_a > 0) and np.all(scale_b > 0)):
        raise ValueError("a shape has no positive norm: every column must be finite and not zero")
    return np.abs(a.conj().T @ wb) ** 2 / np.outer(scale_a, scale_b)


def _search(
    stiffness: sp.csr_array, mass: sp.csr_array, factor: Factorization, size: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """At least `size` lowest eigenpairs, as far as a Krylov method finds them."""
    n = factor.n
    if n <= DENSE_SIZE or size > n // 3:
        return _rayleigh_ritz(stiffness, mass, np.eye(n))
    eigenvalue, shape = _rayleigh_ritz(stiffness, mass, _lanczos(stiffness, mass, factor, size, seed))
    for _ in range(_POLISHES):
        if np.max(_residuals(stiffness, mass, eigenvalue, shape)) <= RESIDUAL:
            break
        eigenvalue, shape = _rayleigh_ritz(stiffness, mass, factor.solve(mass @ shape))
    return eigenvalue, shape


def _lanczos(
    stiffness: sp.csr_array, mass: sp.csr_array, factor: Factorization, size: int, seed: int
) -> NDArray[np.float64]:
    n = factor.n
    inverse = spla.LinearOperator((n, n), matvec=factor.solve, dtype=np.float64)
    start = np.random.default_rng(seed).standard_normal(n)
    try:
        # ARPACK's thin products gain nothing from threads, and waiting ones would take the solver's cores
        with blas_threads(1):
            _, shape = spla.eigsh(stiffness, k=size, M=mass, sigma=0.0, OPinv=inverse, v0=start)
    except (spla.ArpackError, spla.ArpackNoConvergence) as error:
        raise SolverError(f"the Lanczos search for {size} of {n} modes failed: {error}") from error
    return shape


def _rayleigh_ritz(
    stiffness: sp.csr_array, mass: sp.csr_array, basis: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Best approximations in the span of a basis, mass-orthonormal."""
    basis = basis / np.linalg.norm(basis, axis=0)
    k, m = basis.T @ (stiffness @ basis), basis.T @ (mass @ basis)
    eigenvalue, turn = sla.eigh((k + k.T) / 2, (m + m.T) / 2)
    shape = basis @ turn
    # A sign that does not hang on rounding: positive along one fixed vector that no symmetry knows.
    side = np.random.default_rng(0).standard_normal(len(shape)) @ shape
    return eigenvalue, shape * np.where(side < 0, -1.0, 1.0)


def _polished(
    stiffness: sp.csr_array, mass: sp.csr_array, shape: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rayleigh quotients in extended precision where the platform has it, sorted, with their shapes.

    Products with a badly scaled K lose digits (1e-12 on a fingertip), which an undamped answer within a relative
    distance d of a resonance multiplies by 1 / d; the quotient itself errs by the square of the shape's error only.
    """
    x = shape.astype(np.longdouble)
    quotient = [np.einsum("nm,nm->m", x, matrix.astype(np.longdouble) @ x) for matrix in (stiffness, mass)]
    eigenvalue = (quotient[0] / quotient[1]).astype(np.float64)
    order = np.argsort(eigenvalue, kind="stable")
    return eigenvalue[order], np.ascontiguousarray(shape[:, order] / np.sqrt(quotient[1][order].astype(np.float64)))


def _residuals(
    stiffness: sp.csr_array, mass: sp.csr_array, eigenvalue: NDArray[np.float64], shape: NDArray[np.float64]
) -> NDArray[np.float64]:
    elastic = stiffness @ shape
    return np.linalg.norm(elastic - mass @ shape * eigenvalue, axis=0) / np.linalg.norm(elastic, axis=0)


def _error(
    mass: sp.csr_array, factor: Factorization, eigenvalue: NDArray[np.float64], shape: NDArray[np.float64]
) -> float:
    """Bound of |1/lambda - 1/theta| for all pairs at once: the residual of K^-1 M in the mass norm.

    K^-1 M is self-adjoint in that norm (Kahan's theorem, Parlett, The Symmetric Eigenvalue Problem, section 11.5).
    """
    residual = factor.solve(mass @ shape) - shape / eigenvalue
    return float(np.sqrt(np.sum(residual * (mass @ residual))))


def _gap_above(eigenvalue: NDArray[np.float64], wanted: int, n: int) -> tuple[int, float] | None:
    """Number of eigenvalues below the first gap at or above mode `wanted`, and a shift in that gap."""
    for below in range(wanted, len(eigenvalue)):
        low, high = eigenvalue[below - 1] if below else 0.0, eigenvalue[below]
        if high - low > GAP * high:
            return below, float(low + 0.9 * (high - low))  # near the upper end: the bound it gives is sharper
    return (n, float(1.1 * eigenvalue[-1])) if len(eigenvalue) == n else None


def _count_below(pencil: DynamicStiffness, shift: float, backend: str) -> int:
    scale = np.sqrt(np.abs(pencil.shifted(0.0).diagonal))
    return count_negative(pencil.shifted(shift), np.where(scale > 0, scale, 1.0), backend=backend)


def _estimate_count(pencil: DynamicStiffness, shift: float, backend: str) -> int:
    try:
        return _count_below(pencil, shift, backend)
    except SolverError:  # the limit is an eigenvalue; an estimate may stand aside
        return _count_below(pencil, shift * (1 + 1e-6), backend)
