"""Isoparametric solid elements of linear elasticity on scikit-fem's shape functions and quadrature.

With g_ia = dN_i/dx_a and H = int g (x) g dV the isotropic stiffness is

    K_iajb = mu (delta_ab H_icjc + H_ibja - 2/3 H_iajb) + kappa D_iajb ;

full integration takes D = H, B-bar the mean dilatation D = V gbar (x) gbar, which keeps linear hexahedra from locking
as nu -> 1/2 (Hughes, Int. J. Numer. Meth. Eng. 15, 1980, 1413). Geometry and displacement share the shape functions,
so curved edges count.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

CHUNK = 10_000_000
"""Numbers of an element's largest array that are held at once."""
_CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
_CUBE_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_CUBE_MIDDLES = [(0, .5, .5), (1, .5, .5), (.5, 0, .5), (.5, 1, .5), (.5, .5, 0), (.5, .5, 1), (.5, .5, .5)]
_SIMPLEX = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_SIMPLEX_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
KINDS = {"tetra": ("ElementTetP1", 2), "tetra10": ("ElementTetP2", 5), "hexahedron": ("ElementHex1", 3),
         "hexahedron20": ("ElementHexS2", 5), "hexahedron27": ("ElementHex2", 5)}
"""scikit-fem's element of each of meshio's kinds, and the order of its quadrature, whose weights are positive."""
MIRRORED = {"tetra": [0, 2, 1, 3], "tetra10": [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]}
"""Order of nodes that turns a tetrahedron inside out."""


class Shape(NamedTuple):
    """Shape functions at the points of the quadrature, in meshio's (VTK's) order of nodes."""

    value: np.ndarray
    """(q, m) [-]"""
    gradient: np.ndarray
    """(q, m, 3) by local coordinates [-]"""
    weight: np.ndarray
    """(q,)"""


def local_nodes(kind: str) -> np.ndarray:
    """(m, 3) ndarray: local coordinates of a kind's nodes in meshio's order."""
    corners, edges = (_SIMPLEX, _SIMPLEX_EDGES) if kind.startswith("tetra") else (_CUBE, _CUBE_EDGES)
    nodes = [*corners]
    if kind not in ("tetra", "hexahedron"):
        nodes += [tuple((np.array(corners[a]) + corners[b]) / 2) for a, b in edges]
    return np.array(nodes + (_CUBE_MIDDLES if kind == "hexahedron27" else []), dtype=float)


@cache
def shape(kind: str) -> Shape:
    """Shape functions of a kind of :data:`KINDS`."""
    import skfem
    from skfem.quadrature import get_quadrature

    name, order = KINDS[kind]
    element: Any = getattr(skfem, name)()
    points, weight = get_quadrature(element.refdom, order)
    distance = np.abs(local_nodes(kind)[:, None] - element.doflocs[None]).max(axis=2)
    functions = [element.lbasis(points, int(i)) for i in np.argmin(distance, axis=1)]
    return Shape(np.stack([np.broadcast_to(value, len(weight)) for value, _ in functions], axis=1),
                 np.stack([np.broadcast_to(slope, (3, len(weight))).T for _, slope in functions], axis=1), weight)


def geometry(kind: str, nodes: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients by position and volumes of the points of the quadrature; negative where a cell is inside out.

    Parameters
    ----------
    kind : str
    nodes : (n, 3) ndarray [m]
    cells : (e, m) ndarray of int

    Returns
    -------
    gradient : (e, q, m, 3) ndarray [1/m]
    volume : (e, q) ndarray [m3]
    """
    _, slope, weight = shape(kind)
    jacobian = np.einsum("qmk,ema->eqak", slope, nodes[cells], optimize=True)  # dx_a / dxi_k
    determinant = np.linalg.det(jacobian)
    with np.errstate(all="ignore"):
        inverse = np.linalg.inv(np.where(determinant[..., None, None] == 0, np.eye(3), jacobian))
    return np.einsum("qmk,eqka->eqma", slope, inverse, optimize=True), determinant * weight


def element_stiffness(kind: str, nodes: np.ndarray, cells: np.ndarray, shear_modulus: ArrayLike,
                      bulk_modulus: ArrayLike, formulation: str) -> np.ndarray:
    """Stiffness matrix of each element.

    Parameters
    ----------
    kind : str
        One of :data:`KINDS`.
    nodes : (n, 3) ndarray [m]
    cells : (e, m) ndarray of int
        In VTK's order.
    shear_modulus, bulk_modulus : float or (e,) ndarray [Pa]
    formulation : {"full", "b-bar"}

    Returns
    -------
    stiffness : (e, 3m, 3m) ndarray [N/m]
        Local degree of freedom = 3 x local node + component.
    """
    gradient, volume = geometry(kind, nodes, cells)
    volume = np.abs(volume)
    count, _, m, _ = gradient.shape
    flat = gradient.reshape(count, -1, 3 * m)
    gram = (flat * volume[..., None]).transpose(0, 2, 1) @ flat
    dilatation = gram
    if formulation == "b-bar":
        total = np.einsum("eq,eqm->em", volume, flat)
        dilatation = total[:, :, None] * total[:, None, :] / volume.sum(axis=1)[:, None, None]
    blocks = gram.reshape(count, m, 3, m, 3)
    shear = blocks.transpose(0, 1, 4, 3, 2) - 2 / 3 * blocks
    trace = np.einsum("eicjc->eij", blocks)
    for component in range(3):
        shear[:, :, component, :, component] += trace
    mu, kappa = (np.broadcast_to(value, count)[:, None, None] for value in (shear_modulus, bulk_modulus))
    return mu * shear.reshape(count, 3 * m, 3 * m) + kappa * dilatation


def element_mass(kind: str, nodes: np.ndarray, cells: np.ndarray, density: ArrayLike) -> np.ndarray:
    """Consistent mass of each element for one component of displacement.

    Parameters
    ----------
    kind, nodes, cells
        As for :func:`element_stiffness`.
    density : float or (e,) ndarray [kg/m3]

    Returns
    -------
    mass : (e, m, m) ndarray [kg]
    """
    volume, value = np.abs(geometry(kind, nodes, cells)[1]), shape(kind).value
    unit = np.einsum("eq,qi,qj->eij", volume, value, value, optimize=True)
    return np.broadcast_to(density, len(cells))[:, None, None] * unit


def assemble(cells: np.ndarray, matrices: np.ndarray, n_nodes: int) -> sp.csr_matrix:
    """Sum element matrices into a sparse matrix.

    Parameters
    ----------
    cells : (e, m) ndarray of int
    matrices : (e, c m, c m) ndarray
        c components a node; degree of freedom = c x node + component.
    n_nodes : int

    Returns
    -------
    matrix : (c n_nodes, c n_nodes) csr_matrix
    """
    size = matrices.shape[1]
    components = size // cells.shape[1]
    dofs = (components * cells[:, :, None] + np.arange(components)).reshape(-1, size)
    rows, columns = np.repeat(dofs, size, axis=1).ravel(), np.tile(dofs, (1, size)).ravel()
    order = components * n_nodes
    return sp.coo_matrix((matrices.ravel(), (rows, columns)), shape=(order, order)).tocsr()
