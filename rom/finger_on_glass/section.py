"""The transverse section: an elliptic bone inside an elliptic skin, meshed by quadrilaterals along the bone's normals.

The publication shows the section in a figure without legible dimensions; those here are assumptions, and inputs. Mesh
lines run along the bone's normals, which are the straight lines along which the distance to the bone grows: the
radial fibres lie in the mesh lines.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from rom.checks import real_number, whole_number

FINE_SECTOR, FINE_BLEND, FINE_RATIO = 75.0, 6.0, 3.0
"""Rays stand FINE_RATIO times as dense within FINE_SECTOR degrees of the pad's middle; the change takes FINE_BLEND."""


@dataclass(frozen=True)
class Section:
    """Dimensions of the section [mm]; each is an assumption, as the published figure does not give them.

    Raises
    ------
    ValueError
        For a dimension that is not positive, or a bone that does not lie inside the skin.
    """

    width: float = 18.0
    height: float = 15.0
    bone_width: float = 8.6
    bone_height: float = 4.2
    bone_offset: float = 1.0
    """Of the bone's centre from the skin's, towards the nail."""

    def __post_init__(self) -> None:
        for entry in fields(self):
            limits = {} if entry.name == "bone_offset" else {"above": 0.0, "most": 1e3}
            value = real_number(entry.name, getattr(self, entry.name), unit="mm", **limits)
            object.__setattr__(self, entry.name, value)
        bone = self.bone_outline(np.linspace(0, 2 * np.pi, 721))
        level = (bone[:, 0] / (self.width / 2)) ** 2 + (bone[:, 1] / (self.height / 2)) ** 2
        if level.max() >= 0.98:
            raise ValueError(
                f"a bone of {self.bone_width:g} x {self.bone_height:g} mm, {self.bone_offset:g} mm off the middle, "
                f"reaches out of a skin of {self.width:g} x {self.height:g} mm: make it smaller or move it inwards")

    def bone_outline(self, angle: np.ndarray) -> np.ndarray:
        """(n, 2) ndarray [mm]: points of the bone's surface at parameter angles [rad]."""
        return np.column_stack([self.bone_width / 2 * np.cos(angle),
                                self.bone_offset + self.bone_height / 2 * np.sin(angle)])

    def bone_normals(self, angle: np.ndarray) -> np.ndarray:
        """(n, 2) ndarray: outward unit normals of the bone at parameter angles [rad]."""
        normal = np.column_stack([np.cos(angle) / self.bone_width, np.sin(angle) / self.bone_height])
        return normal / np.linalg.norm(normal, axis=1)[:, None]

    def skin_along(self, start: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """(n, 2) ndarray [mm]: where rays from inside meet the skin."""
        scale = np.array([self.width / 2, self.height / 2])
        s, d = start / scale, direction / scale
        a, b, c = (d * d).sum(axis=1), (s * d).sum(axis=1), (s * s).sum(axis=1) - 1
        return start + ((-b + np.sqrt(b * b - a * c)) / a)[:, None] * direction

    def radial_directions(self, points: np.ndarray) -> np.ndarray:
        """Gradient of the distance to the bone: unit vectors away from the nearest point of the bone.

        Parameters
        ----------
        points : (n, 2) ndarray [mm]
            Outside the bone.

        Returns
        -------
        (n, 2) ndarray
        """
        a, b = self.bone_width / 2, self.bone_height / 2
        x, y = np.abs(points[:, 0]), np.abs(points[:, 1] - self.bone_offset)
        angle = np.arctan2(y * a, x * b)
        for _ in range(60):  # Newton on the first quadrant: the nearest point's normal passes through the point
            cos, sin = np.cos(angle), np.sin(angle)
            value = (a * a - b * b) * cos * sin - x * a * sin + y * b * cos
            slope = (a * a - b * b) * (cos * cos - sin * sin) - x * a * cos - y * b * sin
            angle = np.clip(angle - value / slope, 0, np.pi / 2)
        normal = self.bone_normals(angle)
        normal[:, 0] *= np.where(points[:, 0] < 0, -1.0, 1.0)
        normal[:, 1] *= np.where(points[:, 1] < self.bone_offset, -1.0, 1.0)
        return normal


@dataclass(frozen=True, eq=False)
class SectionMesh:
    """A ring of quadrilaterals from bone to skin.

    Parameters
    ----------
    nodes : (n_node, 2) ndarray [mm]
        Ray by ray, each from bone to skin; ray 0 points down to the plate.
    quads : (n_quad, 4) ndarray of int
        Corners, counter-clockwise.
    bone_nodes, skin_nodes : (n_ray,) ndarray of int
        Counter-clockwise from the lowest.
    """

    nodes: np.ndarray
    quads: np.ndarray
    bone_nodes: np.ndarray
    skin_nodes: np.ndarray

    @property
    def rays(self) -> int:
        return len(self.skin_nodes)

    @property
    def layers(self) -> int:
        return len(self.nodes) // self.rays - 1

    def gauss_points(self) -> np.ndarray:
        """(n_quad, 4, 2) ndarray [mm]: positions of the 2 x 2 integration points."""
        xi, eta = CORNERS.T
        shape = 0.25 * (1 + GAUSS[:, :1] * xi) * (1 + GAUSS[:, 1:] * eta)
        return np.einsum("qa,eak->eqk", shape, self.nodes[self.quads])


CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
GAUSS = CORNERS / np.sqrt(3.0)


def mesh_section(section: Section, rays: int = 120, layers: int = 12) -> SectionMesh:
    """Mesh with ``rays`` lines around the bone, denser at the pad, and ``layers`` elements along each.

    Raises
    ------
    ValueError
        For too few or too many elements.
    """
    rays, layers = whole_number("rays", rays, 16, 4000), whole_number("layers", layers, 2, 4000)
    angle = np.linspace(-np.pi / 2, 1.5 * np.pi, 20001)
    bone, normal = section.bone_outline(angle), section.bone_normals(angle)
    skin = section.skin_along(bone, normal)
    middle = 0.5 * (skin[1:] + skin[:-1])
    off_pad = np.degrees(np.arctan2(middle[:, 0] / section.width, -middle[:, 1] / section.height))
    density = 1 + (FINE_RATIO - 1) / (1 + np.exp((np.abs(off_pad) - FINE_SECTOR) / FINE_BLEND))
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(skin, axis=0), axis=1) * density)])
    ray_angle = np.interp(np.arange(rays) / rays * along[-1], along, angle)
    inner, direction = section.bone_outline(ray_angle), section.bone_normals(ray_angle)
    outer = section.skin_along(inner, direction)
    depth = np.linspace(0, 1, layers + 1)[None, :, None]
    nodes = (inner[:, None] * (1 - depth) + outer[:, None] * depth).reshape(-1, 2)
    i, j = np.meshgrid(np.arange(rays), np.arange(layers), indexing="ij")
    here, after = i * (layers + 1) + j, (i + 1) % rays * (layers + 1) + j
    quads = np.stack([here, here + 1, after + 1, after], axis=-1).reshape(-1, 4)
    first = np.arange(rays) * (layers + 1)
    return SectionMesh(nodes, quads, first, first + layers)
