"""Parts of the certificate of a modal answer: how much a residual is amplified, and what finite precision adds.

A residual r makes an error ||e||_K <= max_k lambda_k / |lambda_k (1 + i eta) - omega^2| ||r||_(K^-1), the maximum taken
over the modes that r is not orthogonal to.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rom.fullorder import Modes, SecondOrderModel

UNIT_ROUNDOFF = {"float64": 2.0 ** -53, "float32": 2.0 ** -24}


def amplification_beyond(eigenvalue_bound: float, stiffness: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Largest amplification by modes whose eigenvalue is at least ``eigenvalue_bound``.

    Parameters
    ----------
    eigenvalue_bound : float [rad^2/s^2]
    stiffness : (n_case,) ndarray
        1 + i eta.
    inertia : (n_case,) ndarray [rad^2/s^2]
        omega^2.

    Returns
    -------
    (n_case,) ndarray
    """
    # the factor 1 / |1 + i eta - omega^2 / lambda| is largest where lambda comes closest to omega^2
    return 1.0 / np.abs(stiffness - np.minimum(inertia / eigenvalue_bound, 1.0))


def amplification_of(eigenvalue: np.ndarray, stiffness: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """(n_case,) ndarray: largest amplification by the modes ``eigenvalue`` (m,)."""
    return 1.0 / np.abs(stiffness[:, None] - inertia[:, None] / eigenvalue).min(axis=1)


def mode_defect(model: SecondOrderModel, modes: Modes) -> np.ndarray:
    """``||K phi - lambda M phi||_(K^-1)`` of each computed mode: what the eigensolve left over.

    Returns
    -------
    (m,) ndarray [J^1/2 kg^-1/2 m^-1]
    """
    left = model.stiffness @ modes.shape - (model.mass @ modes.shape) * modes.eigenvalue
    return np.sqrt(np.maximum(np.einsum("nm,nm->m", left, model.static_factorization.solve(left)), 0.0))


def rounding_size(stiffness: sp.sparray, fields: np.ndarray) -> np.ndarray:
    """Weighted 2-norm that turns a relative error of each entry into a bound of the energy norm.

    Where ``|e_i| <= c |v_i|``, ``e^H K e <= c^2 sum_i d_i v_i^2`` with ``d_i = sum_j |K_ij|`` (from
    ``2 |K_ij e_i e_j| <= |K_ij| (e_i^2 + e_j^2)``).

    Parameters
    ----------
    stiffness : (n, n) sparse array [N/m]
    fields : (..., n) ndarray [m]

    Returns
    -------
    (...,) ndarray [J^1/2]
    """
    weight = np.asarray(abs(stiffness).sum(axis=1)).ravel()
    return np.sqrt(np.einsum("...n,...n,n->...", fields, fields, weight, optimize=True))


def gram(rows: np.ndarray, stiffness: sp.sparray) -> np.ndarray:
    """(n_row, n_row) ndarray: products of rows in K."""
    product = rows @ (stiffness @ rows.T)
    return 0.5 * (product + product.T)


def quadratic(matrix: np.ndarray, node: np.ndarray, number: np.ndarray, *, below: bool = False) -> np.ndarray:
    """(n_case,) ndarray: ``sqrt(x^H A x)`` where case i has the numbers ``number[i]`` at the places ``node[i]``.

    What rounding may have cancelled stays in, as a numerator needs it; with ``below`` it is taken off, for a
    denominator.
    """
    if node.shape[1] == 1:
        return np.sqrt(np.maximum(matrix[node[:, 0], node[:, 0]], 0.0)) * np.abs(number[:, 0])
    pairs = matrix[node[:, :, None], node[:, None, :]]
    form = np.einsum("ci,cij,cj->c", number.conj(), pairs, number).real
    floor = 1e-15 * np.einsum("cij,ci,cj->c", np.abs(pairs), np.abs(number), np.abs(number))
    return np.sqrt(np.maximum(form - floor, 0.0) if below else np.maximum(form, floor))
