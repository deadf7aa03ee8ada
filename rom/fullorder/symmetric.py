"""Symmetric sparse matrices as their upper triangle, the form in which direct solvers take them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

#: Largest asymmetry, relative to the matrix, that assembly in floating point may leave.
SYMMETRY_TOLERANCE = 1e-10


@dataclass(frozen=True, eq=False)
class SymmetricMatrix:
    """Upper triangle in CSR, columns sorted, every diagonal entry stored (as PARDISO wants it).

    Parameters
    ----------
    indptr, indices : (n + 1,), (nnz,) ndarray of int32
        Pattern of the upper triangle.
    values : (nnz,) ndarray of float64 or complex128
        Entries in that order.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    values: NDArray

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.indptr) - 1

    @property
    def diagonal(self) -> NDArray:
        """(n,) ndarray: the entries on the diagonal."""
        return self.values[self.indptr[:-1]]

    def same_pattern(self, other: SymmetricMatrix) -> bool:
        """Whether both store the same entries."""
        return (self.indptr is other.indptr and self.indices is other.indices) or (
            np.array_equal(self.indptr, other.indptr) and np.array_equal(self.indices, other.indices)
        )

    def to_csc(self) -> sp.csc_array:
        """Both triangles, as a scipy matrix."""
        upper = sp.csr_array((self.values, self.indices, self.indptr), shape=(self.n, self.n))
        return (upper + sp.triu(upper, 1).T).tocsc()

    def product(self, x: NDArray) -> NDArray:
        """A x for x : (n,) or (n, k), from the upper triangle alone."""
        upper = sp.csr_array((self.values, self.indices, self.indptr), shape=(self.n, self.n))
        diagonal = upper.diagonal()
        return upper @ x + upper.T @ x - (diagonal * x.T).T

    def absolute_product(self, x: NDArray) -> NDArray[np.float64]:
        """|A| |x| for x : (n,) or (n, k)."""
        return SymmetricMatrix(self.indptr, self.indices, np.abs(self.values)).product(np.abs(x))


def symmetric_matrix(matrix: Any, name: str = "matrix") -> SymmetricMatrix:
    """Check a sparse matrix and keep its upper triangle.

    Parameters
    ----------
    matrix : (n, n) scipy sparse matrix or SymmetricMatrix
        Real or complex *symmetric* (not Hermitian), both triangles stored.
    name : str
        How messages call it.

    Raises
    ------
    ValueError
        If it is not sparse, square, finite or symmetric, or too large for 32-bit indices.
    """
    if isinstance(matrix, SymmetricMatrix):
        check_finite(matrix.values, name)
        return matrix
    return merge_symmetric(matrix, names=(name,))[0]


def merge_symmetric(*matrices: Any, names: tuple[str, ...]) -> tuple[SymmetricMatrix, ...]:
    """The same for several matrices, all stored on the union of their patterns (shared index arrays).

    Raises
    ------
    ValueError
        As `symmetric_matrix`, or if sizes differ.
    """
    for matrix, name in zip(matrices, names, strict=True):
        check_symmetric(matrix, name)
    n = matrices[0].shape[0]
    for matrix, name in zip(matrices[1:], names[1:], strict=True):
        if matrix.shape != (n, n):
            raise ValueError(
                f"the {name} has shape {matrix.shape} and the {names[0]} {(n, n)}: both must describe the same dofs"
            )
    parts = [sp.triu(matrix, format="coo") for matrix in matrices]
    diagonal = np.arange(n)
    rows = np.concatenate([part.row for part in parts] + [diagonal])
    columns = np.concatenate([part.col for part in parts] + [diagonal])
    merged: list[SymmetricMatrix] = []
    for k, part in enumerate(parts):
        dtype = np.complex128 if part.dtype.kind == "c" else np.float64
        values = np.concatenate([other.data if j == k else np.zeros(other.nnz) for j, other in enumerate(parts)])
        values = np.concatenate([values, np.zeros(n)]).astype(dtype, copy=False)
        # Through the coordinate form, because sparse addition drops stored zeros.
        upper = sp.coo_array((values, (rows, columns)), shape=(n, n)).tocsr()
        upper.sort_indices()
        if upper.nnz > np.iinfo(np.int32).max:
            raise ValueError(f"the {names[k]} stores {upper.nnz} entries: 32-bit indices end at 2**31 - 1")
        if merged:
            indptr, indices = merged[0].indptr, merged[0].indices
        else:
            indptr, indices = upper.indptr.astype(np.int32), upper.indices.astype(np.int32)
        merged.append(SymmetricMatrix(indptr, indices, upper.data))
    return tuple(merged)


def check_symmetric(matrix: Any, name: str = "matrix") -> None:
    """Refuse what is not a finite, square, symmetric sparse matrix.

    Symmetry is tested on one fixed random vector, which costs two products and misses no practical asymmetry.

    Raises
    ------
    ValueError
        With the reason.
    """
    if not sp.issparse(matrix):
        raise ValueError(f"the {name} is a {type(matrix).__name__}: give a scipy sparse matrix, both triangles stored")
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.shape[0] == 0:
        raise ValueError(f"the {name} has shape {matrix.shape}: it must be square, with at least one row")
    matrix = matrix.tocsr()
    check_finite(matrix.data, name)
    probe = np.random.default_rng(0).uniform(0.5, 1.5, matrix.shape[0])
    size = np.max(abs(matrix) @ probe)
    asymmetry = np.max(np.abs(matrix @ probe - matrix.T @ probe))
    if asymmetry > SYMMETRY_TOLERANCE * size:
        raise ValueError(
            f"the {name} is not symmetric (relative asymmetry {asymmetry / size:.1e}, allowed "
            f"{SYMMETRY_TOLERANCE:.0e}): store both triangles; if it is rounding, symmetrise with (A + A.T) / 2"
        )


def check_finite(values: NDArray, name: str) -> None:
    """Refuse NaN and infinity.

    Raises
    ------
    ValueError
        With the number of bad entries.
    """
    if not np.isfinite(values).all():
        bad = int(np.size(values) - np.count_nonzero(np.isfinite(values)))
        raise ValueError(
            f"the {name} holds {bad} entries that are NaN or infinite: every entry must be a finite number"
        )
