"""Binding of Intel oneMKL PARDISO: sparse LDL^T of symmetric matrices, real or complex, and LU of real unsymmetric ones.

The single dynamic library of oneMKL (``mkl_rt``) is called through ctypes, because ready-made wrappers offer
real matrices only, and the dynamic stiffness of a structurally damped body is complex *symmetric*, not Hermitian.

Numbers of parameters, phases and error codes follow the oneMKL Developer Reference, "oneMKL PARDISO -
Parallel Direct Sparse Solver Interface" and "pardiso iparm Parameter" (zero-based ``iparm`` as in C).
"""

from __future__ import annotations

import ctypes
import ctypes.util
import functools
import importlib.metadata
import logging
import os
import sys
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rom.errors import SolverError

log = logging.getLogger(__name__)

REAL_SYMMETRIC_INDEFINITE = -2
COMPLEX_SYMMETRIC = 6
REAL_UNSYMMETRIC = 11

_ANALYSE, _FACTORIZE, _SOLVE, _RELEASE = 11, 22, 33, -1
_FACTORIZE_AND_SOLVE = 23

#: By zero-based place in ``iparm``.
_SYMMETRIC_SETTINGS = {
    0: 1,  # these values, not the defaults
    1: 2,  # METIS: a third of minimum degree's time on 3D blocks; its parallel form (3) gains nothing
    7: 0,  # refine only where pivots were perturbed: the default's two steps double the solve time
    9: 8,  # pivots below 1e-8 of the scaled matrix are perturbed, and counted
    10: 1,  # scaling and
    12: 1,  # symmetric matching: 5 % of the time, and without them a rigid-body mode passes unnoticed
    20: 1,  # 1x1 and 2x2 Bunch-Kaufman pivots: K - sigma M is indefinite
    23: 0,  # one-level scheduling: two-level solves are slower, and forbid scaling and matching
    34: 1,  # zero-based indices
}
#: Sections of a body: minimum degree without scaling and matching is three to four times faster there than METIS with.
_UNSYMMETRIC_SETTINGS = {0: 1, 1: 0, 7: 2, 9: 13, 10: 0, 12: 0, 34: 1}  # refined twice; pivots below 1e-13 perturbed

_ERRORS = {
    -1: "the input is inconsistent",
    -2: "there is not enough memory",
    -3: "the reordering failed",
    -4: "a zero pivot stopped the factorization or the refinement",
    -5: "an internal error was met",
    -6: "the reordering failed (unsymmetric matching)",
    -7: "the diagonal matrix is singular",
    -8: "a 32-bit integer overflowed (the factor has too many entries)",
    -9: "there is not enough memory for the out-of-core mode",
    -10: "the out-of-core files could not be opened",
    -11: "the out-of-core files could not be read or written",
    -12: "the 64-bit interface was called from a 32-bit library",
    -13: "the run was interrupted",
    -15: "an internal error was met in the analysis",
}

_PATTERNS = {
    "linux": ("libmkl_rt.so", "libmkl_rt.so.*"),
    "darwin": ("libmkl_rt.dylib", "libmkl_rt.*.dylib"),
    "win32": ("mkl_rt.dll", "mkl_rt.*.dll"),
}


def _candidates() -> Iterator[str]:
    """Where the library may lie: the installed distribution's own list, this environment, then the system."""
    patterns = _PATTERNS.get(sys.platform, _PATTERNS["linux"])
    try:
        files = importlib.metadata.files("mkl") or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in files:
        if any(file.match(pattern) for pattern in patterns):
            yield str(Path(str(file.locate())).resolve())
    for prefix in dict.fromkeys((sys.prefix, sys.base_prefix)):
        for folder in ("lib", "Library/bin", "bin"):
            for pattern in patterns:
                yield from sorted(str(path) for path in Path(prefix, folder).glob(pattern))
    found = ctypes.util.find_library("mkl_rt")
    if found:
        yield found


_CBWR_AUTO = 2
"""MKL_CBWR_AUTO: this processor's best code path, and in it always the same order of operations."""


@functools.cache
def load_library() -> ctypes.CDLL | None:
    """The oneMKL runtime, or None where it cannot be loaded."""
    for candidate in dict.fromkeys(_candidates()):
        try:
            library = ctypes.CDLL(candidate)
            library.pardiso.restype = None
            library.pardisoinit.restype = None
            # the same bits wherever an array happens to lie in memory; what the environment asks for stays
            if "MKL_CBWR" not in os.environ:
                library.MKL_CBWR_Set(ctypes.c_int(_CBWR_AUTO))
        except (OSError, AttributeError) as error:
            log.debug("%s cannot serve as oneMKL runtime: %s", candidate, error)
            continue
        log.debug("oneMKL runtime: %s", candidate)
        return library
    return None


def set_threads(count: int) -> None:
    """Set the number of threads that PARDISO uses in the whole process for factorizations made from now on.

    A factorization keeps the number it was made with. Without oneMKL this does nothing:
    SuperLU runs on one thread whatever is asked.

    Parameters
    ----------
    count : int
        Threads, at least 1.
    """
    _check_threads(count)
    library = load_library()
    if library is not None:
        library.MKL_Set_Num_Threads(ctypes.c_int(count))


def get_threads() -> int:
    """Number of threads that PARDISO may use; 1 without oneMKL."""
    library = load_library()
    return 1 if library is None else int(library.MKL_Get_Max_Threads())


@contextmanager
def threads(count: int) -> Iterator[None]:
    """Context in which factorizations made from this Python thread get ``count`` threads, and keep them."""
    _check_threads(count)
    library = load_library()
    if library is None:
        yield
        return
    previous = library.MKL_Set_Num_Threads_Local(ctypes.c_int(count))
    try:
        yield
    finally:
        library.MKL_Set_Num_Threads_Local(ctypes.c_int(previous))


def _check_threads(count: int) -> None:
    if int(count) != count or count < 1:
        raise ValueError(f"the number of threads is {count!r}: it must be a whole number of at least 1")


class Pardiso:
    """One PARDISO handle: a matrix in zero-based CSR with every diagonal entry stored.

    Parameters
    ----------
    indptr, indices : (n + 1,), (nnz,) ndarray of int32
        Pattern, columns sorted in each row; of the upper triangle alone where the matrix is symmetric.
    dtype : float64 or complex128
        With the next decides the matrix type: real symmetric indefinite, complex symmetric, or real unsymmetric.
    symmetric : bool

    Raises
    ------
    SolverError
        If oneMKL is missing or PARDISO reports an error.
    """

    def __init__(
        self, indptr: NDArray[np.int32], indices: NDArray[np.int32], dtype: np.dtype, *, symmetric: bool = True
    ) -> None:
        library = load_library()
        if library is None:
            raise SolverError("PARDISO is not available: no oneMKL runtime was found; install `mkl` or use 'superlu'")
        self._library = library
        self.indptr, self.indices, self.dtype = indptr, indices, np.dtype(dtype)
        self.n = len(indptr) - 1
        self._values = np.zeros(len(indices), self.dtype)
        self._matrix_type = REAL_SYMMETRIC_INDEFINITE if symmetric else REAL_UNSYMMETRIC
        if self.dtype.kind == "c":
            self._matrix_type = COMPLEX_SYMMETRIC
        self._analysed = False
        self._handle = np.zeros(64, np.int64)
        self.iparm = np.zeros(64, np.int32)
        self._threads = get_threads()
        self._lock = threading.Lock()  # one handle is not thread-safe, and ctypes lets go of the GIL
        library.pardisoinit(
            _address(self._handle), ctypes.byref(ctypes.c_int32(self._matrix_type)), _address(self.iparm)
        )
        settings = _SYMMETRIC_SETTINGS if symmetric else _UNSYMMETRIC_SETTINGS
        self.iparm[list(settings)] = list(settings.values())
        # The finalizer may not know `self`. At exit the memory goes with the process, so nothing runs then.
        self._finalizer = weakref.finalize(self, _release, library, self._handle, self._matrix_type, self.n, self.iparm)
        self._finalizer.atexit = False

    def __reduce__(self) -> tuple:
        raise TypeError("a PARDISO factor lives in the library's own memory: it can be neither copied nor pickled")

    def analyse(self, values: NDArray) -> None:
        """Symbolic phase: ordering, matching and scaling from the pattern and these first values."""
        self._values = values
        self._call(_ANALYSE)
        self._analysed = True

    def factorize(self, values: NDArray) -> None:
        """Numeric phase: L D L^T of the matrix with these values on the analysed pattern."""
        self._values = values
        self._call(_FACTORIZE)

    def solve(self, b: NDArray, values: NDArray | None = None) -> NDArray:
        """Solve for ``b`` : (n,) or (n, k), of the factor's dtype; after the numeric phase with ``values`` if given."""
        b = np.asfortranarray(b, dtype=self.dtype)
        x = np.empty_like(b, order="F")
        if values is not None:
            if not self._analysed:
                self.analyse(values)
            self._values = values
        self._call(_SOLVE if values is None else _FACTORIZE_AND_SOLVE, b, x, 1 if b.ndim == 1 else b.shape[1])
        return x

    @property
    def perturbed_pivots(self) -> int:
        """Pivots too small to divide by, which the factorization replaced."""
        return int(self.iparm[13])

    @property
    def doubtful(self) -> bool:
        """Whether the factor should be tested."""
        return self.perturbed_pivots > 0

    @property
    def negative_eigenvalues(self) -> int:
        """Negative eigenvalues of D, hence of the (real) matrix by Sylvester's law of inertia."""
        self._check_alive()
        if self.perturbed_pivots:
            raise SolverError(
                f"{self.perturbed_pivots} pivots vanished to working precision, so the number of negative "
                "eigenvalues is uncertain: move the shift away from the eigenvalue"
            )
        return int(self.iparm[22])

    @property
    def memory_bytes(self) -> int:
        """Memory that symbolic and numeric factor hold together."""
        return 1024 * (int(self.iparm[15]) + int(self.iparm[16]))

    def release(self) -> None:
        """Free the factor; the handle is of no more use."""
        self._finalizer()

    def _call(self, phase: int, b: NDArray | None = None, x: NDArray | None = None, columns: int = 1) -> None:
        self._check_alive()
        if phase == _ANALYSE:
            self._threads = get_threads()
        # A thread count that changes between the phases of one handle makes oneMKL crash.
        with self._lock, threads(self._threads):
            code = _pardiso(
                self._library, self._handle, self._matrix_type, phase, self.n, self._values, self.indptr,
                self.indices, columns, self.iparm, b, x,
            )  # fmt: skip
        if code:
            words = _ERRORS.get(code, "an unknown error was met")
            raise SolverError(f"PARDISO stopped in phase {phase} on a matrix of size {self.n} (code {code}): {words}")

    def _check_alive(self) -> None:
        if not self._finalizer.alive:
            raise SolverError("this factorization has been released: factorize the matrix again")


def _address(array: NDArray | None) -> ctypes.c_void_p | None:
    return None if array is None else array.ctypes.data_as(ctypes.c_void_p)


def _pardiso(
    library: ctypes.CDLL,
    handle: NDArray[np.int64],
    matrix_type: int,
    phase: int,
    n: int,
    values: NDArray | None,
    indptr: NDArray[np.int32] | None,
    indices: NDArray[np.int32] | None,
    columns: int,
    iparm: NDArray[np.int32],
    b: NDArray | None = None,
    x: NDArray | None = None,
) -> int:
    def by_reference(number: int) -> object:
        return ctypes.byref(ctypes.c_int32(number))

    code = ctypes.c_int32(0)
    library.pardiso(
        _address(handle), by_reference(1), by_reference(1), by_reference(matrix_type), by_reference(phase),
        by_reference(n), _address(values), _address(indptr), _address(indices), None, by_reference(columns),
        _address(iparm), by_reference(0), _address(b), _address(x), ctypes.byref(code),
    )  # fmt: skip
    return code.value


def _release(
    library: ctypes.CDLL, handle: NDArray[np.int64], matrix_type: int, n: int, iparm: NDArray[np.int32]
) -> None:
    _pardiso(library, handle, matrix_type, _RELEASE, n, None, None, None, 1, iparm)
