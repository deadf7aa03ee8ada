"""The compiled loop of :mod:`rom.metamodels.field_sums`; a module of its own: the compiler takes a while to load."""

from __future__ import annotations

import numba
import numpy as np

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
def add_up(modal, shapes, own_coordinates, own, place, out):  # pragma: no cover - compiled
    """Fill ``out`` (2 n,), real and imaginary parts by turns, with the sum that `sum_of_one` describes.

    Coordinates come as real and imaginary parts along a last axis of length two.
    """
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
