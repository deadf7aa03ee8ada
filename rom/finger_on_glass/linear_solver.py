"""Sparse LU of unsymmetric matrices that share one pattern: friction makes the tangent unsymmetric.

oneMKL PARDISO with minimum-degree ordering, its symbolic phase kept while the pattern stays (three to four times faster
on these matrices than its own default with nested dissection and matching); SuperLU where oneMKL does not exist.
"""

from __future__ import annotations

import ctypes
import weakref

import numpy as np
import scipy.sparse as sp

from rom.errors import SolverError
from rom.fullorder.pardiso import load_library

UNSYMMETRIC = 11


class PatternedLU:
    """Factorises matrices of one pattern again and again.

    Parameters
    ----------
    indptr, indices : (n + 1,), (nnz,) ndarray of int32
        CSR pattern, columns sorted in each row, diagonal stored.
    """

    def __init__(self, indptr: np.ndarray, indices: np.ndarray) -> None:
        self.indptr = np.ascontiguousarray(indptr, dtype=np.int32)
        self.indices = np.ascontiguousarray(indices, dtype=np.int32)
        self.n = len(indptr) - 1
        self._library = load_library()
        self._analysed = False
        if self._library is not None:
            self._handle = np.zeros(64, dtype=np.int64)
            self._iparm = np.zeros(64, dtype=np.int32)
            # own values; minimum degree; refine twice; perturbed pivots; zero-based
            self._iparm[[0, 1, 7, 9, 34]] = 1, 0, 2, 13, 1
            self._release = weakref.finalize(self, _call, self._library, self._handle, self._iparm, -1, self.n,
                                             np.zeros(1), self.indptr, self.indices, np.zeros(1), np.zeros(1))

    def solve(self, values: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Factorise the matrix with these ``values`` and solve for ``right``.

        Parameters
        ----------
        values : (nnz,) ndarray
        right : (n,) ndarray

        Returns
        -------
        (n,) ndarray

        Raises
        ------
        SolverError
            Where the matrix cannot be factorised.
        """
        if self._library is None:
            matrix = sp.csr_matrix((values, self.indices, self.indptr), shape=(self.n, self.n)).tocsc()
            try:
                return sp.linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=1e-3,
                                      options={"SymmetricMode": True}).solve(right)
            except RuntimeError as error:
                raise SolverError("the tangent of the section is singular") from error
        answer = np.empty(self.n)
        right = np.ascontiguousarray(right, dtype=np.float64)
        phase = 23 if self._analysed else 13
        code = _call(self._library, self._handle, self._iparm, phase, self.n, values, self.indptr, self.indices, right,
                     answer)
        self._analysed = True
        if code:
            raise SolverError(f"the tangent of the section cannot be factorised (oneMKL PARDISO code {code})")
        return answer


def _call(library, handle, iparm, phase, n, values, indptr, indices, right, answer) -> int:
    def whole(value: int):
        return ctypes.byref(ctypes.c_int(value))

    def array(a: np.ndarray):
        return a.ctypes.data_as(ctypes.c_void_p)

    code = ctypes.c_int(0)
    library.pardiso(array(handle), whole(1), whole(1), whole(UNSYMMETRIC), whole(phase), whole(n), array(values),
                    array(indptr), array(indices), None, whole(1), array(iparm), whole(0), array(right), array(answer),
                    ctypes.byref(code))
    return code.value
