"""Errors of networks in every case of the whole harmonic grid, a million of them, without a whole field in memory.

Truth and answer are both short sums of known shapes, so the norm of their difference is a quadratic form of the
coefficients in the shapes' Gram matrix, which each load needs once. In double precision that resolves relative errors
down to 1e-8.
"""

from __future__ import annotations

import numpy as np

from rom.datasets.reduced import ReducedField
from rom.metamodels.networks.separable import SeparableNetwork


def network_errors(model: SeparableNetwork, field: ReducedField, cases: np.ndarray) -> np.ndarray:
    """Relative errors ||u_hat - u|| / ||u|| over all free degrees of freedom.

    Parameters
    ----------
    model : SeparableNetwork
        Fitted, of the same mesh.
    field : ReducedField
        The stored grid.
    cases : (k,) ndarray of int
        Positions in it.

    Returns
    -------
    (k,) ndarray
    """
    shared = np.concatenate([model.shared_rows.astype(float), field.modes])
    gram = shared @ shared.T
    out = np.empty(len(cases))
    load = field.load[cases]
    for node in np.unique(load).tolist():
        here = np.flatnonzero(load == node)
        own = np.concatenate([model.own_rows(node).astype(float), field.own_shapes(node)])
        cross = own @ shared.T
        whole = np.block([[gram, cross.T], [cross, own @ own.T]])
        modal, vectors = field.coefficients(cases[here])
        answer, static = model.coefficients(field.arrays(cases[here]))
        error = np.concatenate([answer, -modal, static, -vectors], axis=1)
        widths = [part.shape[1] for part in (answer, modal, static, vectors)]
        true = np.repeat([False, True, False, True], widths)
        size = _quadratic(error[:, true], whole[np.ix_(true, true)])
        out[here] = np.sqrt(_quadratic(error, whole) / size)
    return out


def _quadratic(coefficients: np.ndarray, gram: np.ndarray) -> np.ndarray:
    """(k,) ndarray: c^H G c of each row; rounding below zero is zero."""
    return np.maximum(sum((part @ gram * part).sum(1) for part in (coefficients.real, coefficients.imag)), 0.0)
