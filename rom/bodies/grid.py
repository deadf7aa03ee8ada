"""Where the degrees of freedom of a body lie: nodes, cells, regions. Needed for pictures and labelled fields alone."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

COMPONENTS = ("x", "y", "z")
FACES: dict[str, tuple[tuple[int, ...], ...]] = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
"""Corners of a cell's faces, counter-clockwise seen from outside, in VTK's order, by the cell's linear kind."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Nodes and cells behind the degrees of freedom of a body.

    Parameters
    ----------
    nodes : (n_node, 3) ndarray [m]
    free : (n,) ndarray of int
        Place of each degree of freedom of the model among ``len(components) * node + component``.
    cells : dict of (n_cell, n_corner) ndarray of int
        By the kind names of meshio ("tetra", "hexahedron20", "quad" ...); empty where only nodes are known.
    components : tuple of str
        Names of a node's degrees of freedom, such as x, y, z.
    region : dict of (n_cell,) ndarray of int, optional
        Index of each cell's region, by cell kind.
    region_names : tuple of str
    region_noun : str
        What a region is called, such as "tissue".
    names : (n_node,) ndarray, optional
        Labels of the nodes in the program that they come from; default: 0, 1, 2 ...
    sets : dict of ndarray of int
        Nodes of each named set of the mesh, such as a face.
    axes : tuple of str
        What each coordinate means, in words.
    noun : str
        What the grid is of, such as "fingertip mesh".
    known_hash : str, optional
        Digest that the mesh is known by already.
    outside : (n_face, 4) ndarray of int, optional
        What is drawn of it, outwards; default: every face that one cell alone has.

    Examples
    --------
    One tetrahedron held at three corners: the fourth has three degrees of freedom, and every face is skin.

    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> grid = Grid(corners, free=np.array([9, 10, 11]), cells={"tetra": np.array([[0, 1, 2, 3]])})
    >>> grid.on_all_nodes(np.array([[1.0, 2.0, 3.0]]))[0, 3]
    array([1., 2., 3.])
    >>> len(grid.skin)
    4
    """

    nodes: np.ndarray
    free: np.ndarray
    cells: dict[str, np.ndarray] = field(default_factory=dict)
    components: tuple[str, ...] = COMPONENTS
    region: dict[str, np.ndarray] = field(default_factory=dict)
    region_names: tuple[str, ...] = ()
    region_noun: str = "region"
    names: np.ndarray | None = None
    sets: dict[str, np.ndarray] = field(default_factory=dict)
    axes: tuple[str, ...] = ("position along x", "position along y", "position along z")
    noun: str = "mesh"
    known_hash: str | None = None
    outside: np.ndarray | None = None

    @property
    def n_node(self) -> int:
        return len(self.nodes)

    @property
    def node_names(self) -> np.ndarray:
        """(n_node,) ndarray: labels of the nodes."""
        return np.arange(self.n_node) if self.names is None else self.names

    @cached_property
    def mesh_hash(self) -> str:
        """sha256 over nodes, cells and free degrees of freedom."""
        if self.known_hash is not None:
            return self.known_hash
        digest = hashlib.sha256()
        for array in (self.nodes, self.free, *(self.cells[kind] for kind in sorted(self.cells))):
            digest.update(f"{array.shape} {array.dtype}".encode() + np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

    def on_all_nodes(self, values: np.ndarray) -> np.ndarray:
        """(n_case, n_node, n_component) ndarray from (n_case, n): held degrees of freedom are zero."""
        full = np.zeros((len(values), self.n_node * len(self.components)), dtype=values.dtype)
        full[:, self.free] = values
        return full.reshape(len(values), self.n_node, len(self.components))

    def at_free(self, fields: np.ndarray) -> np.ndarray:
        """(n_case, n) ndarray from (n_case, n_node, n_component): the inverse of :meth:`on_all_nodes`."""
        return fields.reshape(len(fields), -1)[:, self.free]

    def coordinates(self, node: np.ndarray) -> dict[str, tuple]:
        """Coordinates of labelled fields at the nodes (n,): labels, components, positions [m]."""
        return {
            "node": ("node", self.node_names[node], {"long_name": "mesh node", "units": "1"}),
            "component": ("component", list(self.components), {"long_name": "component of the displacement"}),
            **{f"node_{axis}": ("node", self.nodes[node, i], {"long_name": text, "units": "m"})
               for i, (axis, text) in enumerate(zip("xyz", self.axes, strict=False))}}

    @cached_property
    def skin(self) -> np.ndarray:
        """(n_face, 4) ndarray of int: what is drawn, outwards; triangles repeat their last corner."""
        if self.outside is not None:
            return self.outside
        faces: list[np.ndarray] = []
        for kind, cells in self.cells.items():
            linear = next((name for name in FACES if kind.startswith(name)), None)
            if linear is not None:
                for corners in FACES[linear]:
                    one = cells[:, list(corners)]
                    faces.append(one if one.shape[1] == 4 else np.column_stack([one, one[:, -1]]))
            elif kind in ("triangle", "quad"):  # a surface is its own skin
                one = cells[:, :4]
                faces.append(one if one.shape[1] == 4 else np.column_stack([one, one[:, -1]]))
        if not faces:
            return np.empty((0, 4), dtype=np.int64)
        every = np.concatenate(faces)
        key = every.copy()
        key[every[:, 3] == every[:, 2], 3] = -1  # the repeated one may be another in the next cell
        _, index, times = np.unique(np.sort(key, axis=1), axis=0, return_index=True, return_counts=True)
        return every[np.sort(index[times == 1])]
