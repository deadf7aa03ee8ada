"""A plane section through the hexahedra as triangles, with the weights that carry nodal fields onto it.

Each hexahedron is six tetrahedra about its diagonal, which fill it whatever its faces' twist; the plane meets a
tetrahedron in one triangle or two. Every vertex of the section lies on an edge between two nodes, so that a field on it
is one share of each: exact for linear fields.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rom.fingertip.mesh import MILLIMETRE, FingertipMesh

_AROUND = ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))
_TETRAHEDRA = np.array([[0, 6, a, b] for a, b in _AROUND])
"""Six tetrahedra of a hexahedron in VTK's order, about the diagonal from corner 0 to corner 6."""


@dataclass(frozen=True, eq=False)
class Section:
    """Triangles of a plane section.

    Parameters
    ----------
    vertices : (k, 3) ndarray [m]
    triangles : (l, 3) ndarray
    tissue : (l,) ndarray
        Of each triangle: index into `rom.fingertip.TISSUES`.
    ends : (k, 2) ndarray
        Mesh nodes between which each vertex lies.
    share : (k,) ndarray
        Share of the second of them, 0 to 1.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    tissue: np.ndarray
    ends: np.ndarray
    share: np.ndarray

    def field(self, nodal: np.ndarray) -> np.ndarray:
        """(k, ...) ndarray: a field given at all nodes, (n_node, ...), on the section's vertices."""
        share = self.share.reshape(-1, *[1] * (nodal.ndim - 1))
        return (1.0 - share) * nodal[self.ends[:, 0]] + share * nodal[self.ends[:, 1]]


def section(mesh: FingertipMesh, axis: str, position: float) -> Section:
    """The section of a mesh with a plane across one axis.

    Parameters
    ----------
    mesh : FingertipMesh
    axis : {"x", "y", "z"}
    position : float [mm]

    Returns
    -------
    Section
        Empty where the plane misses the tissue. A node on the plane counts as above it, so that a face that lies in
        the plane is there once.
    """
    return plane_section(mesh.nodes, mesh.hexahedra, mesh.tissue, "xyz".index(axis), position * MILLIMETRE)


def plane_section(nodes: np.ndarray, hexahedra: np.ndarray, tissue: np.ndarray, axis: int, position: float) -> Section:
    """The section of hexahedra (e, 8) with ids ``tissue`` (e,) and the plane ``x[axis] = position``."""
    height = nodes[:, axis] - position
    above = height >= 0.0
    corner_above = above[hexahedra]
    met = np.flatnonzero(corner_above.any(axis=1) & ~corner_above.all(axis=1))
    tetrahedra = hexahedra[met][:, _TETRAHEDRA].reshape(-1, 4)
    owner = np.repeat(tissue[met], len(_TETRAHEDRA))
    upper = above[tetrahedra]
    # corners above the plane first
    order = np.argsort(~upper, axis=1, kind="stable")
    tetrahedra = np.take_along_axis(tetrahedra, order, axis=1)
    count = upper.sum(axis=1)
    edges, ids = [], []
    for number, pairs in _TRIANGLES.items():
        chosen = tetrahedra[count == number]
        for corners in pairs:
            edges.append(chosen[:, np.array(corners)])
            ids.append(owner[count == number])
    edge = np.concatenate(edges).reshape(-1, 2)
    pair, inverse = np.unique(np.sort(edge, axis=1), axis=0, return_inverse=True)
    low, high = height[pair[:, 0]], height[pair[:, 1]]
    share = low / (low - high)
    vertices = (1.0 - share)[:, None] * nodes[pair[:, 0]] + share[:, None] * nodes[pair[:, 1]]
    return Section(vertices, inverse.reshape(-1, 3), np.concatenate(ids), pair, share)


_TRIANGLES = {
    1: (((0, 1), (0, 2), (0, 3)),),
    2: (((0, 2), (0, 3), (1, 3)), ((0, 2), (1, 3), (1, 2))),
    3: (((0, 3), (1, 3), (2, 3)),)}
"""By number of corners above: the edges, as places in a sorted tetrahedron, at which its triangles stand."""
