"""Products of sparse matrices with fields, and what is read off them."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


def real_times(matrix: sp.csr_array, u: NDArray) -> NDArray:
    """Product with a real matrix that does not make a complex copy of it."""
    if u.dtype.kind != "c":
        return matrix @ u
    columns = np.ascontiguousarray(u, dtype=np.complex128).reshape(len(u), -1)
    return (matrix @ columns.view(np.float64)).view(np.complex128).reshape(u.shape)


def relative_size(remainder: NDArray, force: NDArray) -> NDArray[np.float64]:
    """Norm of each column over that of the force; 0 where both vanish, infinite where the force alone does."""
    size, scale = np.linalg.norm(remainder, axis=0), np.linalg.norm(force, axis=0)
    return np.where(size == 0, 0.0, np.divide(size, scale, out=np.full_like(size, np.inf), where=scale > 0))
