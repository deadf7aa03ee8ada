"""The surface of a fingertip as triangles for a picture: everything that can be seen but the bone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rom.fingertip import Fingertip
from rom.fingertip.mesh import MILLIMETRE

_FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Faces of a hexahedron of VTK's order, counter-clockwise seen from outside."""


@dataclass(frozen=True)
class Surface:
    """Triangles with normals; where skin meets the rear section vertices stand twice, once with each normal.

    vertices : (n, 3) ndarray [mm]
    triangles : (m, 3) ndarray
        Counter-clockwise seen from outside.
    vertex_node : (n,) ndarray
        Mesh node of each vertex; the skin's nodes come first, in their own order.
    vertex_normal : (n, 3) ndarray [-]
        Outward.
    vertex_tissue : (n,) ndarray
        Index into `rom.fingertip.anatomy.TISSUES`.
    pad_vertex : (n_pad,) ndarray
        Vertex of each pad node.
    bone_vertices : (b, 3) ndarray [mm]
    bone_triangles : (t, 3) ndarray
    """

    vertices: np.ndarray
    triangles: np.ndarray
    vertex_node: np.ndarray
    vertex_normal: np.ndarray
    vertex_tissue: np.ndarray
    pad_vertex: np.ndarray
    bone_vertices: np.ndarray
    bone_triangles: np.ndarray


def surface_of(tip: Fingertip) -> Surface:
    """The surface of a fingertip.

    Parameters
    ----------
    tip : Fingertip

    Returns
    -------
    Surface
    """
    mesh = tip.mesh
    n_skin = len(mesh.skin_nodes)
    faces = mesh.hexahedra[:, _FACES].reshape(-1, 4)
    owner = np.repeat(np.arange(len(mesh.hexahedra)), len(_FACES))
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outer = np.sort(first[count == 1])
    on_bone = (faces[outer] >= mesh.bone_nodes[0]).all(axis=1)
    on_skin = (faces[outer] < n_skin).all(axis=1)
    rear = outer[~on_bone & ~on_skin]
    rear_nodes, rear_quads = np.unique(faces[rear], return_inverse=True)
    quads = np.concatenate([mesh.skin_quads, rear_quads.reshape(-1, 4) + n_skin])
    tissue = np.zeros(n_skin + len(rear_nodes), dtype=np.int64)
    skin = outer[on_skin]
    tissue[faces[skin].ravel()] = np.repeat(mesh.tissue[owner[skin]], 4)
    tissue[n_skin + rear_quads.ravel()] = np.repeat(mesh.tissue[owner[rear]], 4)
    backwards = np.tile([-1.0, 0.0, 0.0], (len(rear_nodes), 1))
    return Surface(
        vertices=np.concatenate([mesh.nodes[:n_skin], mesh.nodes[rear_nodes]]) / MILLIMETRE,
        triangles=_triangles(quads),
        vertex_node=np.concatenate([mesh.skin_nodes, rear_nodes]),
        vertex_normal=np.concatenate([mesh.normals, backwards]),
        vertex_tissue=tissue,
        pad_vertex=np.asarray(mesh.pad_nodes),
        bone_vertices=mesh.nodes[mesh.bone_nodes] / MILLIMETRE,
        bone_triangles=_triangles(mesh.skin_quads))


def _triangles(quads: np.ndarray) -> np.ndarray:
    """Two triangles a quadrilateral: (2 m, 3) ndarray."""
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
