"""A basis stored for reading: the online stage of every method that answers with a sum of fixed fields.

The floor of one answer is reading the basis once from memory, the floor of a block its matrix product. Both ask for
contiguous rows, one vector a row, in the precision that the answer needs.
"""

from __future__ import annotations

import numpy as np

PRECISIONS: dict[str, np.dtype] = {"float64": np.dtype(np.float64), "float32": np.dtype(np.float32)}
BLOCK = 64
"""Cases combined at once: their planes of real and imaginary parts stay in the processor's cache."""


def check_precision(precision: str) -> str:
    """Return ``precision`` if it is known; ValueError otherwise."""
    if precision not in PRECISIONS:
        raise ValueError(f"precision={precision!r} is unknown: choose one of {', '.join(PRECISIONS)}")
    return precision


class Basis:
    """Fields as rows, for the full field and for the scene's part alone.

    Parameters
    ----------
    vectors : (r, n_free) ndarray
    part_rows : (n_part,) ndarray of int
    precision : {"float64", "float32"}
    """

    def __init__(self, vectors: np.ndarray, part_rows: np.ndarray, precision: str = "float64") -> None:
        kind = PRECISIONS[check_precision(precision)]
        self.field = np.ascontiguousarray(vectors, dtype=kind)
        self.part = np.ascontiguousarray(self.field[..., part_rows])

    def rows(self, outputs: str) -> np.ndarray:
        return self.field if outputs == "field" else self.part

    @property
    def nbytes(self) -> int:
        return self.field.nbytes + self.part.nbytes


def combine(coefficients: np.ndarray, rows: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """Sum of ``rows`` weighted by real or complex ``coefficients``.

    Parameters
    ----------
    coefficients : (n_case, r) ndarray
    rows : (r, n) ndarray, real
    out : (n_case, n) ndarray, optional
        See :func:`room`.

    Returns
    -------
    (n_case, n) ndarray
        Complex where the coefficients are; in the precision of ``rows``.
    """
    kind, n_case = rows.dtype, len(coefficients)
    if not np.iscomplexobj(coefficients):
        out = room(out, n_case, rows.shape[1], kind)
        coefficients = coefficients.astype(kind, copy=False)
        if n_case == 1:  # a matrix-vector product reads the basis faster than a matrix product of one row
            np.matmul(coefficients[0], rows, out=out[0])
        else:
            np.matmul(coefficients, rows, out=out)
        return out
    out = room(out, n_case, rows.shape[1], np.result_type(kind, np.complex64))
    if n_case == 1:
        out.real[0] = coefficients[0].real.astype(kind) @ rows
        out.imag[0] = coefficients[0].imag.astype(kind) @ rows
        return out
    for start in range(0, n_case, BLOCK):
        part = coefficients[start:start + BLOCK]
        plane = planes(part, kind) @ rows
        out.real[start:start + BLOCK] = plane[:len(part)]
        out.imag[start:start + BLOCK] = plane[len(part):]
    return out


def room(out: np.ndarray | None, n_case: int, n_output: int, kind: np.dtype) -> np.ndarray:
    """``out`` where it is given and fits, a new array otherwise.

    Raises
    ------
    ValueError
        Where it does not fit.
    """
    if out is None:
        return np.empty((n_case, n_output), dtype=kind)
    if out.shape != (n_case, n_output) or out.dtype != kind or not out.flags.c_contiguous:
        raise ValueError(f"out has shape {out.shape} and type {out.dtype}: it must be a contiguous "
                         f"({n_case}, {n_output}) array of {np.dtype(kind)}, or be left out")
    return out


def planes(coefficients: np.ndarray, kind: np.dtype) -> np.ndarray:
    """(2 n_case, r) ndarray: real parts, then imaginary parts, so that real matrix products serve complex answers."""
    n_case, r = coefficients.shape
    stacked = np.empty((2 * n_case, r), dtype=kind)
    stacked[:n_case] = coefficients.real
    stacked[n_case:] = coefficients.imag
    return stacked
