"""Eight-node hexahedra of linear elasticity: stiffness, mass, volume, and their assembly.

Isotropic stiffness splits into shear and dilatation, with g_ia = dN_i/dx_a and H = int g (x) g dV:

    K_iajb = mu (delta_ab H_icjc + H_ibja - 2/3 H_iajb) + kappa D_iajb .

Full integration takes D = H.  B-bar takes the mean dilatation, D = V gbar (x) gbar with gbar the element's
volume average of g, and does not lock as nu -> 1/2 (Hughes, Int. J. Numer. Meth. Eng. 15, 1980, 1413).
Everything is integrated with 2 x 2 x 2 Gauss points; mass is consistent.  Neither formulation mends
bending: slender parts need elements short against their thickness.
"""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from rom.checks import shown

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Formulation = Literal["b-bar", "full"]

_TO_SKFEM = [0, 4, 3, 1, 7, 5, 2, 6]  # scikit-fem's local vertex k is this vertex of the VTK order


def check_formulation(formulation: str) -> None:
    """Raise ValueError unless the formulation is known."""
    known = get_args(Formulation)
    if not isinstance(formulation, str) or formulation not in known:
        raise ValueError(f"Formulation is {shown(formulation)}, but only {' and '.join(known)} exist: choose one.")


def _basis(nodes: Floats, hexahedra: Ints) -> Any:
    from skfem import Basis, ElementHex1, MeshHex

    mesh = MeshHex(np.ascontiguousarray(nodes.T), np.ascontiguousarray(hexahedra[:, _TO_SKFEM].T))
    return Basis(mesh, ElementHex1(), intorder=3)


def element_stiffness(
    nodes: Floats,
    hexahedra: Ints,
    shear_modulus: ArrayLike,
    bulk_modulus: ArrayLike,
    formulation: Formulation = "b-bar",
) -> Floats:
    """Stiffness matrix of each element.

    Parameters
    ----------
    nodes : (n, 3) ndarray [m]
    hexahedra : (e, 8) ndarray
        VTK order.
    shear_modulus, bulk_modulus : float or (e,) ndarray [Pa]
    formulation : {"b-bar", "full"}

    Returns
    -------
    stiffness : (e, 24, 24) ndarray [N/m]
        Local dof = 3 x local node + component.
    """
    check_formulation(formulation)
    basis = _basis(nodes, hexahedra)
    n_elements, n_points = basis.dx.shape
    gradient = np.empty((n_elements, n_points, 8, 3))
    for local, (function,) in zip(_TO_SKFEM, basis.basis, strict=True):
        gradient[:, :, local] = function.grad.transpose(1, 2, 0)
    gradient = gradient.reshape(n_elements, n_points, 24)

    gram = (gradient * basis.dx[:, :, None]).transpose(0, 2, 1) @ gradient
    if formulation == "full":
        dilatation = gram
    else:
        total = np.einsum("eq,eqm->em", basis.dx, gradient)
        dilatation = total[:, :, None] * total[:, None, :] / basis.dx.sum(axis=1)[:, None, None]

    blocks = gram.reshape(n_elements, 8, 3, 8, 3)
    shear = blocks.transpose(0, 1, 4, 3, 2) - 2 / 3 * blocks
    trace = np.einsum("eicjc->eij", blocks)
    for component in range(3):
        shear[:, :, component, :, component] += trace
    mu, kappa = (np.broadcast_to(value, n_elements)[:, None, None] for value in (shear_modulus, bulk_modulus))
    return mu * shear.reshape(n_elements, 24, 24) + kappa * dilatation


def element_mass(nodes: Floats, hexahedra: Ints, density: ArrayLike) -> Floats:
    """Consistent mass matrix of each element for one displacement component.

    Parameters
    ----------
    nodes : (n, 3) ndarray [m]
    hexahedra : (e, 8) ndarray
        VTK order.
    density : float or (e,) ndarray [kg/m3]

    Returns
    -------
    mass : (e, 8, 8) ndarray [kg]
    """
    basis = _basis(nodes, hexahedra)
    values = np.empty((basis.dx.shape[1], 8))
    for local, (function,) in zip(_TO_SKFEM, basis.basis, strict=True):
        values[:, local] = np.broadcast_to(np.asarray(function), basis.dx.shape)[0]
    unit = np.einsum("eq,qi,qj->eij", basis.dx, values, values, optimize=True)
    return np.broadcast_to(density, len(hexahedra))[:, None, None] * unit


def element_volumes(nodes: Floats, hexahedra: Ints) -> Floats:
    """Volume of each element: (e,) ndarray [m3]."""
    return _basis(nodes, hexahedra).dx.sum(axis=1)


def assemble(hexahedra: Ints, matrices: Floats, n_nodes: int) -> sparse.csr_matrix:
    """Sum element matrices into a sparse matrix.

    Parameters
    ----------
    hexahedra : (e, 8) ndarray
    matrices : (e, 8 c, 8 c) ndarray
        c components a node; dof = c x node + component.
    n_nodes : int

    Returns
    -------
    matrix : (c n_nodes, c n_nodes) csr_matrix
    """
    size = matrices.shape[1]
    components = size // 8
    dofs = (components * hexahedra[:, :, None] + np.arange(components)).reshape(-1, size)
    rows, columns = np.repeat(dofs, size, axis=1).ravel(), np.tile(dofs, (1, size)).ravel()
    order = components * n_nodes
    return sparse.coo_matrix((matrices.ravel(), (rows, columns)), shape=(order, order)).tocsr()
