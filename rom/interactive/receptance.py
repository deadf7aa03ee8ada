"""Frequency response at single points by `modal-krylov`, reading only the rows of the points from its vectors."""

from __future__ import annotations

import numpy as np

from rom.metamodels.modal import ModalKrylov
from rom.scenes import CaseArrays


def response_at(model: ModalKrylov, cases: CaseArrays, rows: np.ndarray) -> np.ndarray:
    """Displacement at some free degrees of freedom; equals the rows of the full answer up to rounding.

    Parameters
    ----------
    model : ModalKrylov
        Fitted.
    cases : CaseArrays
    rows : (r,) ndarray of int
        Positions among the free degrees of freedom.

    Returns
    -------
    (n_case, r) ndarray, complex [m]
    """
    stiffness = (1.0 + 1j * cases.loss_factor)[:, None]
    inertia = ((2.0 * np.pi * cases.frequency) ** 2)[:, None]
    found = model.coordinates(cases) @ model._shapes.field[:, rows]
    for j in range(cases.node.shape[1]):
        node = cases.node[:, j]
        own = model._own_coordinates(node, cases.force[:, j], stiffness, inertia)
        vectors = model._own.field[node[:, None, None], np.arange(own.shape[1])[:, None], rows]
        found += np.einsum("cp,cpr->cr", own, vectors)
    return found


def natural_frequencies(model: ModalKrylov, below: float) -> np.ndarray:
    """(k,) ndarray: natural frequencies of the kept modes below a frequency [Hz]."""
    frequency = np.sqrt(model.eigenvalue) / (2.0 * np.pi)
    return frequency[frequency <= below]
