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
    """Fields as rows, for the full field and for the pad alone.

    Parameters
    ----------
    vectors : (r, n_free) ndarray
    pad_rows : (3 n_pad,) ndarray of int
    precision : {"float64", "float32"}
    """

    def __init__(self, vectors: np.ndarray, pad_rows: np.ndarray, precision: str = "float64") -> None:
        kind = PRECISIONS[check_precision(precision)]
        self.field = np.ascontiguousarray(vectors, dtype=kind)
        self.pad = np.ascontiguousarray(self.field[..., pad_rows])

    def rows(self, outputs: str) -> np.ndarray:
        return self.pad if outputs == "pad" else self.field

    @property
    def nbytes(self) -> int:
        return self.field.nbytes + self.pad.nbytes


def combine(coefficients: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Sum of ``rows`` weighted by real or complex ``coefficients``.

    Parameters
    ----------
    coefficients : (n_case, r) ndarray
    rows : (r, n) ndarray, real

    Returns
    -------
    (n_case, n) ndarray
        Complex where the coefficients are; in the precision of ``rows``.
    """
    kind = rows.dtype
    if not np.iscomplexobj(coefficients):
        if len(coefficients) == 1:
            return (coefficients[0].astype(kind, copy=False) @ rows)[None]
        return coefficients.astype(kind, copy=False) @ rows
    out = np.empty((len(coefficients), rows.shape[1]), dtype=np.result_type(kind, np.complex64))
    if len(coefficients) == 1:
        out.real[0] = coefficients[0].real.astype(kind) @ rows
        out.imag[0] = coefficients[0].imag.astype(kind) @ rows
        return out
    for start in range(0, len(coefficients), BLOCK):
        part = coefficients[start:start + BLOCK]
        plane = planes(part, kind) @ rows
        out.real[start:start + BLOCK] = plane[:len(part)]
        out.imag[start:start + BLOCK] = plane[len(part):]
    return out


def planes(coefficients: np.ndarray, kind: np.dtype) -> np.ndarray:
    """(2 n_case, r) ndarray: real parts, then imaginary parts, so that real matrix products serve complex answers."""
    n_case, r = coefficients.shape
    stacked = np.empty((2 * n_case, r), dtype=kind)
    stacked[:n_case] = coefficients.real
    stacked[n_case:] = coefficients.imag
    return stacked
