"""Complex sums of real stored fields, added up in double precision whatever the fields are stored in.

Real and imaginary part share one pass over memory, which is what an answer costs. Fields in single precision halve
that memory, and their sum is rounded once, at the end: a sum in single precision would err by as many roundings as it
has terms.
"""

from __future__ import annotations

import numba
import numpy as np

from rom.metamodels.basis import BLOCK, planes

COLUMNS = 512
"""Entries added up at once: their sums stay in the processor's nearest cache."""


@numba.njit(cache=True, fastmath={"contract"})
def _add(coordinates, rows, start, width, real, imag):  # pragma: no cover - compiled
    """Add rows (r, n) times coordinates (r, 2) at some columns, four rows at a time."""
    r, k = rows.shape[0], 0
    while k + 4 <= r:
        a0, a1, a2, a3 = coordinates[k, 0], coordinates[k + 1, 0], coordinates[k + 2, 0], coordinates[k + 3, 0]
        b0, b1, b2, b3 = coordinates[k, 1], coordinates[k + 1, 1], coordinates[k + 2, 1], coordinates[k + 3, 1]
        row0, row1 = rows[k, start:start + width], rows[k + 1, start:start + width]
        row2, row3 = rows[k + 2, start:start + width], rows[k + 3, start:start + width]
        for i in range(width):
            x0, x1, x2, x3 = np.float64(row0[i]), np.float64(row1[i]), np.float64(row2[i]), np.float64(row3[i])
            real[i] += (a0 * x0 + a1 * x1) + (a2 * x2 + a3 * x3)
            imag[i] += (b0 * x0 + b1 * x1) + (b2 * x2 + b3 * x3)
        k += 4
    while k < r:
        a0, b0, row0 = coordinates[k, 0], coordinates[k, 1], rows[k, start:start + width]
        for i in range(width):
            x0 = np.float64(row0[i])
            real[i] += a0 * x0
            imag[i] += b0 * x0
        k += 1


@numba.njit(cache=True, fastmath={"contract"})
def _sum(modal, shapes, own_coordinates, own, place, out):  # pragma: no cover - compiled
    real, imag = np.empty(COLUMNS), np.empty(COLUMNS)
    n = shapes.shape[1]
    for start in range(0, n, COLUMNS):
        width = min(COLUMNS, n - start)
        real[:], imag[:] = 0.0, 0.0
        _add(modal, shapes, start, width, real, imag)
        for j in range(len(place)):
            _add(own_coordinates[j], own[place[j]], start, width, real, imag)
        for i in range(width):
            out[2 * (start + i)], out[2 * (start + i) + 1] = real[i], imag[i]


def sum_of_one(modal: np.ndarray, shapes: np.ndarray, own_coordinates: np.ndarray, own: np.ndarray, place: np.ndarray,
               out: np.ndarray) -> None:
    """The answer to one case: shapes that all loads share, and each force's own.

    Parameters
    ----------
    modal : (m,) ndarray, complex
    shapes : (m, n) ndarray
    own_coordinates : (n_force, p) ndarray, complex
    own : (n_load, p, n) ndarray
    place : (n_force,) ndarray of int
        Each force's load.
    out : (n,) ndarray, complex
        To be filled.
    """
    _sum(modal.view(np.float64).reshape(-1, 2), shapes,
         own_coordinates.view(np.float64).reshape(*own_coordinates.shape, 2), own, place, out.view(shapes.dtype))


def sum_of_many(coordinates: np.ndarray, rows: np.ndarray, where: np.ndarray, out: np.ndarray) -> None:
    """Answers of the same rows, by matrix products in double precision.

    Parameters
    ----------
    coordinates : (n_case, r) ndarray, complex
    rows : (r, n) ndarray
    where : (n_case,) ndarray of int
        Rows of ``out`` to be filled.
    out : (n_out, n) ndarray, complex
    """
    n = rows.shape[1]
    parts = out.view(rows.dtype).reshape(len(out), n, 2)
    for first in range(0, len(where), BLOCK):
        part = where[first:first + BLOCK]
        both = planes(coordinates[first:first + BLOCK], np.dtype(np.float64))
        for start in range(0, n, 4 * COLUMNS):
            columns = slice(start, start + 4 * COLUMNS)
            found = both @ rows[:, columns].astype(np.float64, copy=False)
            for i, row in enumerate(part):
                parts[row, columns, 0], parts[row, columns, 1] = found[i], found[len(part) + i]
