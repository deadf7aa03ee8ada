"""Strain from nodal displacement, as sparse matrices: at element centres, at Gauss points, at a depth below the skin.

A row of such a matrix is one strain component at one point, so the matrix serves any displacement: one answer, a
batch of them, real or complex, or the columns of a reduced basis, whose strain modes then give the strain of every
later answer for (number of modes) x (number of points) multiplications.

The strain is the one that the element's stiffness is made of.  In the B-bar formulation the element's mean dilatation
replaces the local one, eps_bar = dev(eps) + (1/V int div u dV) I / 3, and energy densities that are made of it add up
to u^T K u / 2 exactly; the local dilatation of a nearly incompressible B-bar element is noise that carries no energy.

Strain jumps across the border of two tissues (displacement and traction do not), and a little across every element
border; hence `side`.  Depth is measured as the mesh lays out its layers: the component along the skin's normal of
the straight lines from skin to bone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from rom.fingertip.anatomy import TISSUES
from rom.fingertip.elasticity import MEGAPASCAL
from rom.fingertip.elements import Formulation
from rom.fingertip.fingertip import Fingertip
from rom.fingertip.mesh import FingertipMesh
from rom.fingertip.shell import Floats, Ints

Side = Literal["deep", "shallow"]
VOIGT = ("xx", "yy", "zz", "yz", "xz", "xy")
"""Order of the six components; the last three are engineering shear strains, gamma_yz = 2 eps_yz."""

_CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
                     [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float)  # VTK order; the last is outward
_GAUSS = _CORNERS / np.sqrt(3)
_AT_BORDER = 1e-6  # of a layer's thickness: a depth that close to a border of elements lies on it


@dataclass(frozen=True, eq=False)
class StrainPoints:
    """Places inside elements.

    Parameters
    ----------
    element : (p,) ndarray
        Rows of ``mesh.hexahedra``.
    natural : (p, 3) ndarray [-]
        Natural coordinates in the element, -1 to 1; the third grows towards the skin.
    """

    element: Ints
    natural: Floats

    def __len__(self) -> int:
        """Number of points."""
        return len(self.element)

    def interpolation(self, mesh: FingertipMesh) -> sparse.csr_matrix:
        """(p, n) csr_matrix [-] : nodal values, such as (n, 3) displacements, at the points."""
        shares = np.prod(1 + self.natural[:, None, :] * _CORNERS, axis=2) / 8
        starts = 8 * np.arange(len(self) + 1)
        columns = mesh.hexahedra[self.element].ravel()
        return sparse.csr_matrix((shares.ravel(), columns, starts), shape=(len(self), mesh.n_nodes))

    def positions(self, mesh: FingertipMesh) -> Floats:
        """(p, 3) ndarray [m] : where the points lie."""
        return self.interpolation(mesh) @ mesh.nodes

    def moduli(self, fingertip: Fingertip) -> tuple[Floats, Floats]:
        """Shear and bulk modulus at the points: two (p,) ndarrays [Pa]."""
        tissues = [fingertip.anatomy.tissue(name) for name in TISSUES]
        ids = fingertip.mesh.tissue[self.element]
        mu, kappa = np.array([(one.shear_modulus, one.bulk_modulus) for one in tissues]).T * MEGAPASCAL
        return mu[ids], kappa[ids]


def element_centres(mesh: FingertipMesh) -> StrainPoints:
    """The centre of every element, where a trilinear element's strain is most accurate."""
    return StrainPoints(np.arange(len(mesh.hexahedra)), np.zeros((len(mesh.hexahedra), 3)))


def gauss_points(mesh: FingertipMesh) -> tuple[StrainPoints, Floats]:
    """The 2 x 2 x 2 Gauss points of every element, element by element, and their volumes, (8 e,) ndarray [m3].

    Their matrix has 48 rows an element: some 100 MB for the study preset.
    """
    count = len(mesh.hexahedra)
    points = StrainPoints(np.repeat(np.arange(count), 8), np.tile(_GAUSS, (count, 1)))
    return points, np.linalg.det(_jacobians(mesh, points)[1])


def pad_quads(mesh: FingertipMesh) -> Ints:
    """Rows of ``mesh.skin_quads`` whose four corners are pad nodes: (m,) ndarray."""
    return np.flatnonzero(np.isin(mesh.skin_quads, mesh.pad_nodes).all(axis=1))


def points_at_depth(
    mesh: FingertipMesh, depth: float, side: Side = "deep", quads: ArrayLike | None = None
) -> StrainPoints:
    """Points at one depth below the centres of skin quadrilaterals.

    Parameters
    ----------
    mesh : FingertipMesh
    depth : float [m]
        Below the skin, along its normal.
    side : {"deep", "shallow"}
        The element to take where the depth is a border of elements: below it or above it.
    quads : (m,) array_like, optional
        Rows of ``mesh.skin_quads``; `pad_quads` by default.

    Returns
    -------
    StrainPoints
        One a quadrilateral.

    Raises
    ------
    ValueError
        For another side, a depth that is negative or not finite, or one that lies in the bone somewhere.
    """
    if side not in get_args(Side):
        raise ValueError(f"The side is {side!r}, but a border only has {' and '.join(get_args(Side))}: choose one.")
    if not (np.isfinite(depth) and depth >= 0):
        raise ValueError(f"The depth is {depth} m, but it must be zero or more: give it in metre, below the skin.")
    chosen = pad_quads(mesh) if quads is None else np.asarray(quads, dtype=np.int64)
    levels = node_depths(mesh)[:, mesh.skin_quads[chosen]].mean(axis=2)  # linear between shells, as the element is
    shallowest = levels[-1].min(initial=np.inf)
    if depth > shallowest * (1 + _AT_BORDER):
        raise ValueError(f"The depth is {depth * 1e3:g} mm, but the bone lies at {shallowest * 1e3:.3g} mm below some "
                         "of these quadrilaterals: stay above it, or choose others.")
    tolerance = _AT_BORDER * np.diff(levels, axis=0).min(initial=np.inf)
    reached = levels[1:] <= depth + tolerance if side == "deep" else levels[1:] < depth - tolerance
    layer = np.minimum(reached.sum(axis=0), mesh.n_shells - 2)
    columns = np.arange(len(chosen))
    top, bottom = levels[layer, columns], levels[layer + 1, columns]
    natural = np.zeros((len(chosen), 3))
    natural[:, 2] = np.clip(1 - 2 * (depth - top) / (bottom - top), -1, 1)
    return StrainPoints(layer * len(mesh.skin_quads) + chosen, natural)


def node_depths(mesh: FingertipMesh) -> Floats:
    """Depth of every node below its skin node, along the skin's normal there: (n_shells, n_skin) ndarray [m]."""
    shells = mesh.nodes.reshape(mesh.n_shells, mesh.nodes_per_shell, 3)
    return np.einsum("sna,na->sn", shells[0] - shells, mesh.normals)


def strain_operator(
    fingertip: Fingertip, depth: float, side: Side = "deep", quads: ArrayLike | None = None
) -> sparse.csr_matrix:
    """Matrix from displacement to strain at a depth; see `points_at_depth` and `operator_at`."""
    return operator_at(fingertip, points_at_depth(fingertip.mesh, depth, side, quads))


def operator_at(fingertip: Fingertip, points: StrainPoints) -> sparse.csr_matrix:
    """Matrix from displacement at all nodes to strain at points.

    Parameters
    ----------
    fingertip : Fingertip
        Its formulation decides what dilatation is.
    points : StrainPoints

    Returns
    -------
    operator : (6 p, 3 n) csr_matrix [1/m]
        Row = 6 x point + component in the order of `VOIGT`; column = 3 x node + component.  For displacement at the
        free dofs take ``operator[:, fingertip.free_dofs]``: held nodes do not move.
    """
    mesh = fingertip.mesh
    rows = _local_rows(mesh, points, fingertip.formulation)
    dofs = (3 * mesh.hexahedra[points.element][:, :, None] + np.arange(3)).reshape(-1, 1, 24)
    columns = np.broadcast_to(dofs, rows.shape).ravel()
    starts = 24 * np.arange(6 * len(points) + 1)
    operator = sparse.csr_matrix((rows.ravel(), columns, starts), shape=(6 * len(points), 3 * mesh.n_nodes))
    operator.sum_duplicates()
    operator.eliminate_zeros()
    return operator


def apply(operator: sparse.csr_matrix, displacement: ArrayLike) -> np.ndarray:
    """Strain of one displacement or of many.

    Parameters
    ----------
    operator : (6 p, k) csr_matrix [1/m]
        From `strain_operator` or `operator_at`, or its columns of the free dofs.
    displacement : (..., k) or (..., k / 3, 3) array_like [m]
        Real or complex.

    Returns
    -------
    strain : (..., p, 6) ndarray [-]

    Raises
    ------
    ValueError
        For another number of components.
    """
    u = np.asarray(displacement)
    count = operator.shape[1]
    if u.ndim >= 2 and u.shape[-1] == 3 and count != 3 and 3 * u.shape[-2] == count:
        u = u.reshape(*u.shape[:-2], count)
    if u.ndim == 0 or u.shape[-1] != count:
        raise ValueError(f"The displacement has the shape {u.shape}, but this operator takes (..., {count}) or "
                         f"(..., {count // 3}, 3): give all nodes, or take the operator's columns of the free dofs.")
    strain = (operator @ u.reshape(-1, count).T).T
    return np.ascontiguousarray(strain).reshape(*u.shape[:-1], -1, 6)


def _jacobians(mesh: FingertipMesh, points: StrainPoints) -> tuple[Floats, Floats]:
    """Derivatives of the eight shape functions (p, 8, 3), and of the position (p, 3, 3), by natural coordinates."""
    factors = 1 + points.natural[:, None, :] * _CORNERS
    slopes = np.stack([_CORNERS[:, a] * np.delete(factors, a, axis=2).prod(axis=2) for a in range(3)], axis=2) / 8
    return slopes, np.einsum("pia,pib->pab", slopes, mesh.nodes[mesh.hexahedra[points.element]])


def _gradients(mesh: FingertipMesh, points: StrainPoints) -> tuple[Floats, Floats]:
    """Derivatives of the shape functions by position, (p, 8, 3) ndarray [1/m], and Jacobian determinants [m3]."""
    slopes, jacobian = _jacobians(mesh, points)
    gradient = np.asarray(np.linalg.solve(jacobian, slopes.transpose(0, 2, 1)).transpose(0, 2, 1), dtype=np.float64)
    return gradient, np.linalg.det(jacobian)


def _local_rows(mesh: FingertipMesh, points: StrainPoints, formulation: Formulation) -> Floats:
    """Strain of the 24 displacements of each point's element: (p, 6, 24) ndarray [1/m]."""
    gradient, _ = _gradients(mesh, points)
    rows = np.zeros((len(points), 6, 8, 3))
    for a in range(3):
        rows[:, a, :, a] = gradient[:, :, a]
    for row, (a, b) in zip((3, 4, 5), ((1, 2), (0, 2), (0, 1)), strict=True):
        rows[:, row, :, a], rows[:, row, :, b] = gradient[:, :, b], gradient[:, :, a]
    if formulation == "b-bar":
        rows[:, :3] += ((_mean_gradients(mesh, points.element) - gradient) / 3)[:, None]
    return rows.reshape(len(points), 6, 24)


def _mean_gradients(mesh: FingertipMesh, elements: Ints) -> Floats:
    """Volume average over the element of the shape functions' gradients, as assembly takes it: (p, 8, 3) ndarray."""
    needed, back = np.unique(elements, return_inverse=True)
    total, volume = np.zeros((len(needed), 8, 3)), np.zeros(len(needed))
    for place in _GAUSS:
        gradient, weight = _gradients(mesh, StrainPoints(needed, np.broadcast_to(place, (len(needed), 3))))
        total += gradient * weight[:, None, None]
        volume += weight
    return (total / volume[:, None, None])[back]
