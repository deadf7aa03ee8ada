"""What real models' matrices hold, made fit to compute with: one triangle, stored zeros, held rows, rounding."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

PENALTY = 1e30
"""On the diagonal: how Abaqus (1e36) and others write a held degree of freedom."""
ROUNDING = 1e-8
"""Of an imaginary part against the real one, below which nobody meant it."""


def loss_part(matrix: sp.csr_array, name: str, notes: list[str]) -> list[sp.csr_array]:
    """The imaginary part of a complex stiffness, unless it is the rounding of whoever wrote it."""
    loss = sp.csr_array(matrix.imag)
    size = abs(loss).max() / max(abs(matrix.real).max(), np.finfo(float).tiny)
    if size <= ROUNDING:
        if size > 0:
            notes.append(f"{name}: the imaginary part is rounding, {size:.0e} of the real part, and is left out")
        return []
    real, imaginary = matrix.diagonal().real, matrix.diagonal().imag
    factor = imaginary[real != 0] / real[real != 0]
    notes.append(f"{name} is complex: its imaginary part, loss factors of {factor.min():.4g} to {factor.max():.4g} on "
                 "the diagonal, is kept as loss stiffness, so that cases take loss factor 0")
    return [loss]


def both_triangles(matrix: sp.csr_array, name: str, notes: list[str]) -> sp.csr_array:
    """Without stored zeros, and mirrored where one triangle alone is stored; integers as floats."""
    matrix = sp.csr_array(matrix, dtype=float if matrix.dtype.kind in "iub" else matrix.dtype, copy=True)
    matrix.sum_duplicates()
    matrix.eliminate_zeros()
    beside = matrix - sp.diags_array(matrix.diagonal())
    beside.eliminate_zeros()
    # whatever the order of the rows: of each pair of entries, one is stored
    if beside.nnz and not (beside != 0).multiply((beside != 0).T).nnz:
        notes.append(f"{name}: one triangle is stored, the other was added")
        matrix = sp.csr_array(matrix + beside.T)
    return matrix


def held_rows(stiffness: sp.csr_array, others: dict[str, sp.csr_array]) -> np.ndarray:
    """(n,) ndarray of bool: rows that stand for a held degree of freedom.

    They are coupled to no other in any matrix, and have no mass, or as much mass as stiffness (how assemblers set the
    row of a held degree of freedom in both), or a penalty on the diagonal. A penalty counts with coupling, too.
    """
    diagonal = stiffness.diagonal()
    coupled = np.zeros(len(diagonal), dtype=bool)
    for matrix in (stiffness, *others.values()):
        coupled |= np.asarray(abs(matrix).sum(axis=1)).ravel() > np.abs(matrix.diagonal())
    mass = others["mass"].diagonal() if "mass" in others else np.zeros(len(diagonal))
    held = ~coupled & ((mass == 0) | (mass == diagonal)) if coupled.any() else (diagonal == 0) & (mass == 0)
    return held | (np.abs(diagonal) >= PENALTY)
