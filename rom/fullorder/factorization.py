"""Sparse LDL^T factorization of real symmetric and complex symmetric matrices, by PARDISO or SuperLU.

PARDISO (oneMKL) is many times faster than SuperLU on three-dimensional bodies; SuperLU, in its symmetric mode,
is the fallback where oneMKL does not exist. Report `Factorization.backend` with every time.
"""

from __future__ import annotations

import functools
import logging
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import SolverError
from rom.fullorder.pardiso import Pardiso, load_library
from rom.fullorder.superlu import Superlu
from rom.fullorder.symmetric import SymmetricMatrix, check_finite, symmetric_matrix

log = logging.getLogger(__name__)

BACKENDS = ("pardiso", "superlu")

#: Relative residual of a random right-hand side above which a matrix counts as singular.
SINGULAR_RESIDUAL = 1e-6


def available_backends() -> tuple[str, ...]:
    """Names of the backends that work here, best first."""
    return BACKENDS if load_library() is not None else BACKENDS[1:]


def factorize(matrix: Any, *, backend: str = "auto", singular: float = SINGULAR_RESIDUAL) -> Factorization:
    """Factorize a symmetric matrix.

    Parameters
    ----------
    matrix : (n, n) scipy sparse matrix or SymmetricMatrix
        Real symmetric (definite or not) or complex symmetric, both triangles stored.
    backend : {"auto", "pardiso", "superlu"}
        "auto" takes PARDISO where the oneMKL runtime can be loaded, else SuperLU with one logged warning.
    singular : float [1]
        Relative residual of a random right-hand side above which the matrix counts as singular.

    Raises
    ------
    ValueError
        If the matrix is not square, finite and symmetric, or the backend has no such name.
    SolverError
        If the matrix is singular, or the backend is missing or fails.
    """
    factor = Factorization(symmetric_matrix(matrix), choose_backend(backend), singular)
    factor._factorize(symbolic=True)
    factor._probe()
    return factor


def choose_backend(backend: str) -> str:
    """Resolve "auto" and refuse unknown names (ValueError)."""
    if backend in BACKENDS:
        return backend
    if backend != "auto":
        raise ValueError(f"the backend {backend!r} is unknown: it must be one of 'auto', 'pardiso', 'superlu'")
    best = available_backends()[0]
    if best == "superlu":
        _announce_fallback()
    return best


@functools.cache
def _announce_fallback() -> None:
    log.warning("no oneMKL runtime was found: SuperLU factorizes, many times slower; install `mkl` for PARDISO")


class Factorization:
    """A factorized symmetric matrix; made by `factorize`.

    It frees its memory when it is collected, on `release`, and at the end of a ``with`` block.

    Parameters
    ----------
    matrix : SymmetricMatrix
    backend : {"pardiso", "superlu"}
    singular : float [1]
        See `factorize`.
    """

    def __init__(self, matrix: SymmetricMatrix, backend: str, singular: float = SINGULAR_RESIDUAL) -> None:
        engine = Pardiso if backend == "pardiso" else Superlu
        self.backend = backend
        self._matrix = matrix
        self._singular = singular
        self._gain: float | None = None
        self._engine: Pardiso | Superlu = engine(matrix.indptr, matrix.indices, matrix.values.dtype)

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self._matrix.n

    @property
    def dtype(self) -> np.dtype:
        """float64 or complex128."""
        return self._matrix.values.dtype

    @property
    def matrix(self) -> SymmetricMatrix:
        """What is factorized."""
        return self._matrix

    @property
    def rounding_gain(self) -> float:
        """||A^-1 p||_2 with p_i = +-sum_j |A_ij|: how far errors in the entries of A are carried; one solve, kept."""
        if self._gain is None:
            self._gain = float(np.linalg.norm(self.solve(
                random_signs(self.n) * self._matrix.absolute_product(np.ones(self.n)))))
        return self._gain

    def solve(self, b: ArrayLike) -> NDArray:
        """Solve A x = b for one or many right-hand sides.

        Parameters
        ----------
        b : (n,) or (n, k) array
            Real or complex; many columns in one call cost far less each than one by one.

        Returns
        -------
        x : (n,) or (n, k) ndarray, Fortran order
            complex128 if the matrix or `b` is complex, else float64.

        Raises
        ------
        ValueError
            If `b` has another length, or holds NaN or infinity.
        SolverError
            If the factor was released or the backend fails.
        """
        b = np.asarray(b)
        if b.ndim not in (1, 2) or b.shape[0] != self.n:
            raise ValueError(f"the right-hand side has shape {b.shape}: it must be ({self.n},) or ({self.n}, k)")
        check_finite(b, "right-hand side")
        if b.size == 0:
            return np.zeros(b.shape, np.result_type(self.dtype, b.dtype, np.float64), order="F")
        if b.dtype.kind == "c" and self.dtype.kind != "c":
            # Both parts in one call: a complex factor of the same matrix would cost four times as much.
            columns = b.reshape(self.n, -1)
            parts = self._solve(np.concatenate([columns.real, columns.imag], axis=1))
            k = columns.shape[1]
            return (parts[:, :k] + 1j * parts[:, k:]).reshape(b.shape, order="F")
        return self._solve(b.astype(self.dtype, copy=False))

    def refactorize(self, matrix: Any) -> Self:
        """Replace the values, keep the pattern and with it the symbolic phase.

        Parameters
        ----------
        matrix : (n, n) scipy sparse matrix or SymmetricMatrix
            Same stored entries and same dtype as the first one.

        Raises
        ------
        ValueError
            If pattern or dtype differ, or the matrix is not finite and symmetric.
        SolverError
            If it is singular, or the backend fails.
        """
        new = symmetric_matrix(matrix)
        if new.n != self.n or new.values.dtype != self.dtype or not new.same_pattern(self._matrix):
            raise ValueError(
                f"the matrix (n = {new.n}, {len(new.values)} entries in its upper triangle, {new.values.dtype}) is "
                f"not on the factorized pattern (n = {self.n}, {len(self._matrix.values)}, {self.dtype}): "
                "call factorize() for another pattern"
            )
        self._matrix = new
        self._factorize()
        if self._engine.doubtful:
            if self.backend == "pardiso":
                # Scaling stems from the values analysed first and may not suit these: analyse again, then judge.
                self._factorize(symbolic=True)
            self._probe()
        return self

    @property
    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues of a real matrix, from the inertia of its factor.

        Raises
        ------
        ValueError
            If the matrix is complex.
        SolverError
            If pivots had to be perturbed or exchanged, so that the count cannot be trusted.
        """
        if self.dtype.kind == "c":
            raise ValueError("a complex symmetric matrix has no inertia: ask for it with a real matrix")
        return self._engine.negative_eigenvalues

    @property
    def memory_bytes(self) -> int:
        """Memory held by the factor [B]."""
        return self._engine.memory_bytes

    def release(self) -> None:
        """Free the factor now; it can solve no more."""
        self._engine.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    def _probe(self) -> None:
        """Solve one random right-hand side, which no singular matrix can reach, and look at the residual."""
        b = np.random.default_rng(0).standard_normal(self.n).astype(self.dtype)
        with np.errstate(all="ignore"):
            residual = np.linalg.norm(self._matrix.product(self._solve(b)) - b) / np.linalg.norm(b)
        if not residual <= self._singular:
            self.release()
            raise SolverError(
                f"the matrix of size {self.n} is singular to working precision (relative residual {residual:.1e} "
                f"of a trial solve, allowed {self._singular:.0e}): fix the rigid motions, or move away from the "
                "eigenvalue"
            )

    def _factorize(self, *, symbolic: bool = False) -> None:
        if symbolic:
            self._engine.analyse(self._matrix.values)
        self._gain = None
        self._engine.factorize(self._matrix.values)

    def _solve(self, b: NDArray) -> NDArray:
        return self._engine.solve(b)


def random_signs(n: int) -> NDArray[np.float64]:
    """(n,) ndarray of +1 and -1, always the same."""
    return np.where(np.random.default_rng(7).random(n) < 0.5, -1.0, 1.0)
