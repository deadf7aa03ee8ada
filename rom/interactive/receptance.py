"""Frequency response at single points by `modal-krylov`, reading only the rows of the points from its vectors."""

from __future__ import annotations

import numpy as np

from rom.fullorder.poles import operating_points
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
    point = operating_points(cases.frequency, cases.loss_factor)
    found = model.coordinates(cases) @ model.shapes.field[:, rows]
    for j in range(cases.node.shape[1]):
        node = cases.node[:, j]
        own = model.own_coordinates(node, cases.force[:, j], *point)
        vectors = model.own_shapes.field[node[:, None, None], np.arange(own.shape[1])[:, None], rows]
        found += np.einsum("cp,cpr->cr", own, vectors)
    return found


def natural_frequencies(model: ModalKrylov, below: float) -> np.ndarray:
    """(k,) ndarray: natural frequencies of the kept modes below a frequency [Hz]."""
    frequency = np.sqrt(model.eigenvalue) / (2.0 * np.pi)
    return frequency[frequency <= below]
