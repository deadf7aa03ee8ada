"""Sparse LU of unsymmetric matrices that share one pattern: friction makes the tangent unsymmetric.

oneMKL PARDISO with its symbolic phase kept while the pattern stays; SuperLU where oneMKL does not exist.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rom.errors import SolverError
from rom.fullorder.pardiso import Pardiso, load_library


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
        self._engine = None if load_library() is None else Pardiso(
            self.indptr, self.indices, np.dtype(np.float64), symmetric=False)

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
        try:
            if self._engine is not None:
                return self._engine.solve(right, np.ascontiguousarray(values, dtype=np.float64))
            matrix = sp.csr_matrix((values, self.indices, self.indptr), shape=(self.n, self.n)).tocsc()
            return sp.linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=1e-3,
                                  options={"SymmetricMode": True}).solve(right)
        except (RuntimeError, SolverError) as error:
            raise SolverError(f"the tangent of the section cannot be factorised: {error}") from error
