"""SuperLU in its symmetric mode, behind the same small interface as `rom.fullorder.pardiso.Pardiso`.

The options are those of the SuperLU Users' Guide for symmetric patterns: minimum degree on A + A^T and pivots on
the diagonal. With no rows exchanged U = D L^T, so that the signs of its diagonal show the inertia.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from rom.errors import SolverError
from rom.fullorder.symmetric import SymmetricMatrix


class Superlu:
    """One SuperLU factor of a symmetric matrix given by its upper triangle.

    Parameters
    ----------
    indptr, indices : (n + 1,), (nnz,) ndarray of int32
        Pattern of the upper triangle, columns sorted in each row.
    dtype : float64 or complex128
    """

    def __init__(self, indptr: NDArray[np.int32], indices: NDArray[np.int32], dtype: np.dtype) -> None:
        self.indptr, self.indices, self.dtype = indptr, indices, np.dtype(dtype)
        self._lu: spla.SuperLU | None = None

    def __reduce__(self) -> tuple:
        raise TypeError("a SuperLU factor lives in the library's own memory: it can be neither copied nor pickled")

    def analyse(self, values: NDArray) -> None:
        """Nothing: SciPy offers no symbolic phase of its own."""

    def factorize(self, values: NDArray) -> None:
        """LU of the matrix with these values."""
        self._lu = None
        matrix = SymmetricMatrix(self.indptr, self.indices, values).to_csc()
        try:
            self._lu = spla.splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise SolverError(
                f"SuperLU met a zero pivot: the matrix of size {matrix.shape[0]} is singular; fix the rigid "
                "motions, or move away from the eigenvalue"
            ) from error

    def solve(self, b: NDArray) -> NDArray:
        """Solve for ``b`` : (n,) or (n, k), of the factor's dtype."""
        return np.asfortranarray(self._factor().solve(b))

    @property
    def doubtful(self) -> bool:
        """Whether the factor should be tested: always, as SuperLU tells nothing of its pivots."""
        return True

    @property
    def negative_eigenvalues(self) -> int:
        """Negative diagonal entries of U."""
        factor = self._factor()
        if not np.array_equal(factor.perm_r, factor.perm_c):
            raise SolverError(
                "SuperLU exchanged rows, so its pivots do not show the inertia: use the 'pardiso' backend, "
                "or move the shift"
            )
        return int(np.count_nonzero(factor.U.diagonal() < 0))

    @property
    def memory_bytes(self) -> int:
        """Memory of the entries of L and U with their row indices."""
        return int(self._factor().nnz) * (self.dtype.itemsize + np.dtype(np.int32).itemsize)

    def release(self) -> None:
        """Free the factor."""
        self._lu = None

    def _factor(self) -> spla.SuperLU:
        if self._lu is None:
            raise SolverError("this factorization has been released: factorize the matrix again")
        return self._lu
