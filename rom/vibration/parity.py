"""Parity of mode shapes about the mid-plane y = 0.

The mesh is its own mirror image to the last bit, so the reflection R: u(x, y, z) -> S u(x, -y, z) with
S = diag(1, -1, 1) commutes with K and M. Every mode is then symmetric (R phi = phi) or antisymmetric (R phi = -phi),
unless modes of both kinds share one frequency: a solver may return any mixture of such a pair.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from rom.errors import SolverError
from rom.fingertip import FingertipMesh
from rom.fullorder import Modes

Floats = NDArray[np.float64]

SYMMETRIC, ANTISYMMETRIC, MIXED = "symmetric", "antisymmetric", "mixed"

#: Share of the other kind's kinetic energy above which a mode is mixed: an amplitude of a thousandth.
IMPURITY = 1e-6


def reflected(mesh: FingertipMesh, free_dofs: NDArray[np.int64], field: Floats) -> Floats:
    """Mirror images of displacement fields.

    Parameters
    ----------
    mesh : FingertipMesh
    free_dofs : (n_free,) ndarray
        Dofs, 3 x node + component, ascending; a mirror-symmetric set.
    field : (n_free,) or (n_free, m) ndarray

    Returns
    -------
    image : ndarray
        Like ``field``; twice reflected is the field itself.
    """
    node, component = np.divmod(free_dofs, 3)
    partner = np.searchsorted(free_dofs, 3 * mesh.mirror[node] + component)
    sign = np.where(component == 1, -1.0, 1.0)
    return sign.reshape((-1,) + (1,) * (field.ndim - 1)) * field[partner]


def symmetric_share(mesh: FingertipMesh, free_dofs: NDArray[np.int64], mass: Any, shape: Floats) -> Floats:
    """Share of a field's kinetic energy in its symmetric part.

    Parameters
    ----------
    mesh : FingertipMesh
    free_dofs : (n_free,) ndarray
    mass : (n_free, n_free) scipy sparse matrix [kg]
    shape : (n_free, m) ndarray

    Returns
    -------
    share : (m,) ndarray [1]
        From 0, antisymmetric, to 1, symmetric: ||(phi + R phi)/2||_M^2 / ||phi||_M^2.
    """
    symmetric = (shape + reflected(mesh, free_dofs, shape)) / 2
    return np.sum(symmetric * (mass @ symmetric), axis=0) / np.sum(shape * (mass @ shape), axis=0)


def parity(mesh: FingertipMesh, free_dofs: NDArray[np.int64], mass: Any, shape: Floats) -> NDArray[np.str_]:
    """Name the parity of each mode.

    Parameters
    ----------
    mesh : FingertipMesh
    free_dofs : (n_free,) ndarray
    mass : (n_free, n_free) scipy sparse matrix [kg]
    shape : (n_free, m) ndarray

    Returns
    -------
    parity : (m,) ndarray of str
        "symmetric" or "antisymmetric"; "mixed" where the other part holds more than `IMPURITY` of the energy, which
        `pure_parity` mends.
    """
    share = symmetric_share(mesh, free_dofs, mass, shape)
    return np.where(share >= 1 - IMPURITY, SYMMETRIC, np.where(share <= IMPURITY, ANTISYMMETRIC, MIXED))


def pure_parity(modes: Modes, mesh: FingertipMesh, free_dofs: NDArray[np.int64], stiffness: Any, mass: Any) -> Modes:
    """The same modes, each purely symmetric or antisymmetric, mass-orthonormal, sorted by eigenvalue.

    The span of the modes is split into its symmetric and its antisymmetric part, and K is diagonalised in each
    (Rayleigh-Ritz). Only modes that share a frequency turn noticeably.

    Parameters
    ----------
    modes : Modes
    mesh : FingertipMesh
    free_dofs : (n_free,) ndarray
    stiffness, mass : (n_free, n_free) scipy sparse matrix [N/m], [kg]

    Returns
    -------
    Modes
        With new eigenvalues, shapes and residuals; the Sturm count stays true, as the span does.

    Raises
    ------
    SolverError
        Where the modes' span is no mirror image of itself: the last one is half of a mixed pair.
    """
    shape = modes.shape
    image = shape.T @ (mass @ reflected(mesh, free_dofs, shape))
    value, turn = np.linalg.eigh((image + image.T) / 2)  # the reflection seen in the span: -1 and 1
    if np.any(1 - np.abs(value) > IMPURITY):
        raise SolverError(
            f"{modes.count} modes cut a pair of one frequency and both parities (reflection {np.abs(value).min():.6f} "
            "of 1 within their span): ask for one mode more or less"
        )
    eigenvalues, shapes = [], []
    for sign in (1.0, -1.0):
        part = shape @ turn[:, sign * value > 0]
        if not part.shape[1]:
            continue
        part = (part + sign * reflected(mesh, free_dofs, part)) / 2
        k, m = part.T @ (stiffness @ part), part.T @ (mass @ part)
        eigenvalue, within = sla.eigh((k + k.T) / 2, (m + m.T) / 2)
        eigenvalues.append(eigenvalue)
        shapes.append(part @ within)
    order = np.argsort(np.concatenate(eigenvalues), kind="stable")
    eigenvalue, new = np.concatenate(eigenvalues)[order], np.concatenate(shapes, axis=1)[:, order]
    new *= np.where(np.sum(new * (mass @ shape), axis=0) < 0, -1.0, 1.0)  # the sign that the mode had
    elastic = stiffness @ new
    residual = np.linalg.norm(elastic - mass @ new * eigenvalue, axis=0) / np.linalg.norm(elastic, axis=0)
    return replace(modes, eigenvalue=eigenvalue, shape=np.ascontiguousarray(new), residual=residual)
