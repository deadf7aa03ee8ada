"""Complex sums of real stored fields, added up in double precision whatever the fields are stored in.

Real and imaginary part share one pass over memory, which is what an answer costs. Fields in single precision halve
that memory, and their sum is rounded once, at the end: a sum in single precision would err by as many roundings as it
has terms.
"""

from __future__ import annotations

import numpy as np

from rom.metamodels.basis import BLOCK, planes

COLUMNS = 2048
"""Entries that a matrix product makes at once: rows in double precision that stay in the processor's cache."""
SMALL = 4096
"""Length of fields below which a matrix product is as fast as the compiled loop, which takes a second to load."""


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
    if len(out) < SMALL:
        rows = np.concatenate([shapes, *own[place]])
        sum_of_many(np.concatenate([modal, own_coordinates.ravel()])[None], rows, np.zeros(1, dtype=int), out[None])
        return
    from rom.metamodels.field_kernel import add_up

    add_up(modal.view(np.float64).reshape(-1, 2), shapes,
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
        for start in range(0, n, COLUMNS):
            columns = slice(start, start + COLUMNS)
            found = both @ rows[:, columns].astype(np.float64, copy=False)
            for i, row in enumerate(part):
                parts[row, columns, 0], parts[row, columns, 1] = found[i], found[len(part) + i]
