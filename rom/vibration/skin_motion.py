"""The skin's part of a displacement field: areas, regions, and shares of motion that simple patterns hold.

Descriptions of mode shapes speak of what is seen, and seen is the skin. Its regions are named after where the skin
looks, by octants of the section (palmar, lower left and right, left and right, the rest dorsal), and after the side of
the fingerprint centroid on which they lie along the finger (distal, proximal). Every mean and every share is weighted
by area, so that the mesh's density does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rom.fingertip import FingertipMesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

OCTANT = np.pi / 4
ROUNDING = 1e-6
"""Motion below this part of the skin's own counts as rest."""


def on_all_nodes(mesh: FingertipMesh, free_dofs: Ints, shape: Floats) -> Floats:
    """Fields on free dofs as nodal vectors, zero where nodes are held.

    Parameters
    ----------
    mesh : FingertipMesh
    free_dofs : (n_free,) ndarray
    shape : (n_free, m) ndarray

    Returns
    -------
    field : (n_nodes, 3, m) ndarray
    """
    field = np.zeros((3 * mesh.n_nodes, shape.shape[1]))
    field[free_dofs] = shape
    return field.reshape(mesh.n_nodes, 3, -1)


def skin_areas(mesh: FingertipMesh) -> Floats:
    """A quarter of each quadrilateral's area to each of its corners: (n_skin,) ndarray [m2]."""
    corners = mesh.nodes[mesh.skin_quads]
    diagonals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    quarter = np.linalg.norm(diagonals, axis=1) / 8
    areas = np.zeros(mesh.nodes_per_shell)
    np.add.at(areas, mesh.skin_quads.ravel(), np.repeat(quarter, 4))
    return areas


class Skin:
    """Places, areas and regions of a mesh's skin.

    Parameters
    ----------
    mesh : FingertipMesh
    """

    def __init__(self, mesh: FingertipMesh) -> None:
        self.mesh = mesh
        self.position = mesh.nodes[mesh.skin_nodes]
        self.normal = mesh.normals
        self.area = skin_areas(mesh)

    @cached_property
    def distal(self) -> Mask:
        """(n_skin,) ndarray : beyond the fingerprint centroid."""
        return self.position[:, 0] > self.position[self.mesh.fingerprint_centroid, 0]

    @cached_property
    def lower_half(self) -> Mask:
        """(n_skin,) ndarray : below the widest section, z < 0."""
        return self.position[:, 2] < 0

    @cached_property
    def _turn(self) -> Floats:
        """Angle of the normal from straight down, towards either side [rad]; NaN where it looks along the finger."""
        x, y, z = np.abs(self.normal.T)
        return np.where(x > np.hypot(y, z), np.nan, np.arctan2(y, -self.normal[:, 2]))

    @cached_property
    def lower_sides(self) -> Mask:
        """(n_skin,) ndarray : the octants that look half down, half aside."""
        return np.abs(self._turn - OCTANT) < OCTANT / 2

    @cached_property
    def sides(self) -> Mask:
        """(n_skin,) ndarray : the octants that look aside."""
        return np.abs(self._turn - 2 * OCTANT) < OCTANT / 2

    @cached_property
    def centroid_patch(self) -> Mask:
        """(n_skin,) ndarray : the fingerprint centroid and its neighbours."""
        inside = np.zeros(len(self.area), dtype=bool)
        inside[self.mesh.skin_patch(self.mesh.fingerprint_centroid)] = True
        return inside

    @cached_property
    def bone_axis(self) -> tuple[Floats, Floats]:
        """A point and the direction of the straight line through the bone's nodes, on the mid-plane: (3,), (3,)."""
        x, _, z = self.mesh.nodes[self.mesh.bone_nodes].T
        slope, height = np.polyfit(x, z, 1)
        return np.array([0.0, 0.0, height]), np.array([1.0, 0.0, slope]) / np.hypot(1.0, slope)

    def normal_motion(self, field: Floats) -> Floats:
        """Motion along the outward normal: (n_skin, 3, m) -> (n_skin, m)."""
        return np.einsum("ij,ijm->im", self.normal, field)

    def mean(self, values: Floats, where: Mask) -> Floats:
        """Mean over a region: (n_skin, m) -> (m,); 0 over a region without nodes."""
        total = self.area[where].sum()
        return self.area[where] @ values[where] / total if total > 0 else np.zeros(values.shape[1])

    def left_minus_right(self, values: Floats, where: Mask) -> Floats:
        """Half the difference of the means over a region's two sides of the mid-plane: (n_skin, m) -> (m,)."""
        y = self.position[:, 1]
        return (self.mean(values, where & (y > 0)) - self.mean(values, where & (y < 0))) / 2

    def share(self, patterns: Sequence[Floats], field: Floats, where: Mask | None = None) -> Floats:
        """Share of a region's mean square motion that the best combination of patterns holds.

        Parameters
        ----------
        patterns : sequence of (n_skin, 3) ndarray
        field : (n_skin, 3, m) ndarray
        where : (n_skin,) ndarray of bool, optional
            All of the skin by default.

        Returns
        -------
        share : (m,) ndarray [1]
            0 to 1; 0 where nothing moves.
        """
        return self._project(patterns, field, where)[0]

    def lateral_axis(self, field: Floats) -> tuple[Floats, Floats]:
        """Best rigid rotation about a line parallel to y, wherever that line lies.

        Parameters
        ----------
        field : (n_skin, 3, m) ndarray

        Returns
        -------
        share : (m,) ndarray [1]
        axis : (2, m) ndarray [m]
            x and z of the line; far away for a translation.
        """
        share, (along, up, turn) = self._project([self.translation(0), self.translation(2), self.rotation(1)], field)
        with np.errstate(divide="ignore", invalid="ignore"):
            return share, np.stack([up / turn, -along / turn])

    def translation(self, axis: int) -> Floats:
        """Unit translation along a coordinate axis: (n_skin, 3) ndarray."""
        return np.tile(np.eye(3)[axis], (len(self.area), 1))

    def rotation(self, axis: int) -> Floats:
        """Unit rotation about a coordinate axis: (n_skin, 3) ndarray [m]."""
        return np.cross(np.eye(3)[axis], self.position)

    def torsion(self) -> Floats:
        """Unit rotation about the bone's axis: (n_skin, 3) ndarray [m]."""
        point, direction = self.bone_axis
        return np.cross(direction, self.position - point)

    def _project(
        self, patterns: Sequence[Floats], field: Floats, where: Mask | None = None
    ) -> tuple[Floats, Floats]:
        """Shares (m,) and coefficients (patterns, m)."""
        area = self.area if where is None else np.where(where, self.area, 0.0)
        root = np.repeat(np.sqrt(area), 3)[:, None]
        basis = root * np.stack([pattern.ravel() for pattern in patterns], axis=1)
        scale = np.linalg.norm(basis, axis=0)
        scale[scale == 0] = 1.0
        values = root * field.reshape(len(root), -1)
        weights = np.linalg.lstsq(basis / scale, values, rcond=None)[0]
        held, all_of_it = (np.sum(v**2, axis=0) for v in (basis / scale @ weights, values))
        share = np.divide(held, all_of_it, out=np.zeros_like(held), where=all_of_it > 0)
        return np.clip(share, 0.0, 1.0), weights / scale[:, None]


def opposition(a: Floats, b: Floats, scale: Floats) -> Floats:
    """Signed measure of two motions: 1 equal and opposite, 0 where one rests, -1 equal: -2ab / (a^2 + b^2).

    Parameters
    ----------
    a, b : (m,) ndarray
    scale : (m,) ndarray
        Size of motion beside which rounding is told from motion: where both are below 1e-6 of it the answer is 0.

    Returns
    -------
    opposition : (m,) ndarray [1]
    """
    size = a**2 + b**2
    return np.divide(-2 * a * b, size, out=np.zeros_like(size), where=size > (ROUNDING * scale) ** 2)
