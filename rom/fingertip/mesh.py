"""Nested-shell hexahedral mesh of the soft tissue between skin and bone.

Shell 0 is the skin, the last shell the bone; node = shell x nodes_per_shell + node in the shell.  The
layers of the skin lie at their published depths, measured along the skin's normal and laid out on the
straight lines from skin to bone; the hypodermis fills the rest, and keeps its least share where bone and
surface come close.  Under the nail (front surface, above the widest section, within the nail's width) the
stratum corneum's elements are nail plate, those of epidermis and dermis nail bed, whose depth is its own.
The nail's edge follows element edges, so it moves a little with the density.
"""

from __future__ import annotations

import hashlib
import logging
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from rom.errors import AnatomyError
from rom.fingertip.anatomy import TISSUES, Anatomy
from rom.fingertip.shell import Floats, Ints, MeshDensity, shell_grid, to_disk
from rom.fingertip.surfaces import bone, exterior

log = logging.getLogger(__name__)

MILLIMETRE = 1e-3
LEAST_SQUEEZE = 0.5  # a layer squeezed to less than half its thickness is no longer that layer
_CORNERS = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])


@dataclass(frozen=True, eq=False)
class FingertipMesh:
    """Eight-node hexahedra in shells, with the node sets that models need.

    Parameters
    ----------
    nodes : (n, 3) ndarray [m]
        x from joint to tip, y lateral, z positive on the dorsal side.
    hexahedra : (e, 8) ndarray
        Four nodes of the deeper shell, counter-clockwise seen from outside, then the four above them (VTK
        order).
    tissue : (e,) ndarray
        Tissue ids, indices into `rom.fingertip.anatomy.TISSUES`.
    density : MeshDensity
    logical : (n, 3) ndarray [-]
        Shell coordinates u, v and layer coordinate 0 (skin) ... 4 (bone); see `rom.fingertip.shell`.
    skin_quads : (m, 4) ndarray
        Quadrilaterals of the skin, counter-clockwise seen from outside.
    normals : (n_skin, 3) ndarray [-]
        Outward unit normals of the skin nodes.
    rear_nodes : (n_rear,) ndarray
        Nodes of the section at the joint, without the bone's.
    pad_nodes : (n_pad,) ndarray
        Skin nodes that normal loads may act on: palmar, in the region that `SurfaceShape` declares.
    fingerprint_centroid : int
        Skin node on the mid-plane nearest to the pad's centre.
    mirror : (n,) ndarray
        Node at the mirrored place, y -> -y, for each node; the coordinates agree to the last bit.

    Notes
    -----
    The arrays are read-only.
    """

    nodes: Floats
    hexahedra: Ints
    tissue: Ints
    density: MeshDensity
    logical: Floats
    skin_quads: Ints
    normals: Floats
    rear_nodes: Ints
    pad_nodes: Ints
    fingerprint_centroid: int
    mirror: Ints

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    @property
    def n_nodes(self) -> int:
        """int : all nodes, the bone's included."""
        return len(self.nodes)

    @property
    def nodes_per_shell(self) -> int:
        """int"""
        return self.density.nodes_per_shell

    @property
    def n_shells(self) -> int:
        """int : element layers + 1."""
        return sum(self.density.layers) + 1

    @property
    def skin_nodes(self) -> Ints:
        """(n_skin,) ndarray : shell 0."""
        return np.arange(self.nodes_per_shell)

    @property
    def bone_nodes(self) -> Ints:
        """(n_skin,) ndarray : the last shell."""
        return np.arange(self.n_nodes - self.nodes_per_shell, self.n_nodes)

    def check_skin_node(self, node: int) -> None:
        """Raise ValueError for a node that is not on the skin."""
        if not 0 <= node < self.nodes_per_shell:
            raise ValueError(
                f"Node {node} is not on the skin, whose nodes go from 0 to {self.nodes_per_shell - 1}: "
                "choose one of those, e.g. a pad node."
            )

    def skin_patch(self, node: int) -> Ints:
        """Skin nodes of the quadrilaterals around a skin node, itself included; usually nine.

        Raises
        ------
        ValueError
            For a node that is not on the skin.
        """
        self.check_skin_node(node)
        return np.unique(self.skin_quads[(self.skin_quads == node).any(axis=1)])

    @cached_property
    def element_volumes(self) -> Floats:
        """(e,) ndarray [m3]"""
        from rom.fingertip.elements import element_volumes

        return element_volumes(self.nodes, self.hexahedra)

    @property
    def volume(self) -> float:
        """float [m3] : deformable tissue, nail included."""
        return float(self.element_volumes.sum())

    @property
    def quality(self) -> dict[str, float]:
        """Worst element numbers.

        ``min_scaled_jacobian`` is the smallest corner Jacobian over the product of its three edges (1 for a
        brick), ``max_aspect_ratio`` the largest ratio of longest to shortest edge of one element.
        """
        edges = _corner_edges(self.nodes[self.hexahedra])
        lengths = np.linalg.norm(edges, axis=-1)
        scaled = np.linalg.det(edges) / lengths.prod(axis=-1)
        aspect = lengths.max(axis=(1, 2)) / lengths.min(axis=(1, 2))
        return {"min_scaled_jacobian": float(scaled.min()), "max_aspect_ratio": float(aspect.max())}

    @cached_property
    def mesh_hash(self) -> str:
        """str : sha256 over coordinates in whole nanometres, connectivity and tissue ids."""
        digest = hashlib.sha256()
        for array in (np.rint(self.nodes * 1e9), self.hexahedra, self.tissue):
            digest.update(np.ascontiguousarray(array, dtype="<i8").tobytes())
        return digest.hexdigest()


def build_mesh(anatomy: Anatomy, density: MeshDensity | None = None) -> FingertipMesh:
    """Mesh the soft tissue of an anatomy.

    Parameters
    ----------
    anatomy : Anatomy
    density : MeshDensity, optional
        The `study` preset's by default.

    Returns
    -------
    FingertipMesh

    Raises
    ------
    AnatomyError
        If the skin's layers find no room above the bone, an element is inverted, or the pad holds no node.
    """
    density = MeshDensity() if density is None else density
    grid = shell_grid(density)
    disk, rear = to_disk(grid.logical)
    skin, normals = exterior(anatomy, disk, rear)
    inward = bone(anatomy, disk, rear) - skin
    on_nail = _on_nail(anatomy, skin, grid.quads)
    fractions = _depth_fractions(anatomy, density, skin, inward, normals, np.unique(grid.quads[on_nail]))

    n, layers = len(skin), sum(density.layers)
    nodes = (skin + fractions[:, :, None] * inward).reshape(-1, 3) * MILLIMETRE
    offsets = n * np.arange(layers)[:, None, None]
    hexahedra = np.concatenate([grid.quads + offsets + n, grid.quads + offsets], axis=2).reshape(-1, 8)
    _check_jacobians(nodes, hexahedra)

    x, _, z = skin.T
    shape = anatomy.shape
    pad = np.flatnonzero(
        (x >= shape.pad_start * anatomy.fingertip_length) & (z <= -shape.pad_depth * anatomy.palmar_height)
    )
    if pad.size == 0:
        raise AnatomyError(
            f"No skin node lies beyond pad_start {shape.pad_start:g} and pad_depth {shape.pad_depth:g}: "
            "lower one of them or refine the mesh."
        )
    midline = np.flatnonzero((grid.logical[:, 0] == 0) & (z < 0))

    x_pad = shape.pad_centre * anatomy.fingertip_length
    shells = np.arange(layers + 1)[:, None]

    mesh = FingertipMesh(
        nodes=nodes,
        hexahedra=hexahedra,
        tissue=_tissue_ids(density, on_nail),
        density=density,
        logical=np.column_stack([np.tile(grid.logical, (layers + 1, 1)), np.repeat(density.layer_levels, n)]),
        skin_quads=grid.quads,
        normals=normals,
        rear_nodes=(grid.last_ring + n * shells[:-1]).ravel(),
        pad_nodes=pad,
        fingerprint_centroid=int(midline[np.argmin(np.abs(x[midline] - x_pad))]),
        mirror=(grid.mirror + n * shells).ravel(),
    )
    log.info("meshed %d nodes, %d hexahedra, %d pad nodes", len(nodes), len(hexahedra), pad.size)
    return mesh


def _on_nail(anatomy: Anatomy, skin: Floats, quads: Ints) -> np.ndarray:
    """Whether a skin quadrilateral, by its centre, is covered by the nail: (m,) ndarray of bool."""
    x, y, z = skin[quads].mean(axis=1).T
    return (z > 0) & (np.abs(y) < anatomy.nail_width / 2) & (x > anatomy.nail_root)


def _depth_fractions(
    anatomy: Anatomy, density: MeshDensity, skin: Floats, inward: Floats, normals: Floats, nail_nodes: Ints
) -> Floats:
    """Fraction of the way from skin to bone for each shell and column: (shells, n) ndarray [-]."""
    room = -np.einsum("ij,ij->i", inward, normals)
    outermost = np.full(len(skin), anatomy.stratum_corneum_thickness)
    outermost[nail_nodes] = anatomy.nail_plate_thickness
    bottoms = np.zeros((5, len(skin)))  # of stratum corneum, epidermis, dermis, as fractions; then the bone
    bottoms[1] = outermost
    bottoms[2] = bottoms[1] + anatomy.epidermis_thickness
    bottoms[3] = bottoms[2] + anatomy.dermis_thickness
    # epidermis and dermis share the nail bed's depth in their own ratio
    bed = anatomy.shape.nail_bed_thickness
    share = anatomy.epidermis_thickness / (anatomy.epidermis_thickness + anatomy.dermis_thickness)
    bottoms[2, nail_nodes] = bottoms[1, nail_nodes] + share * bed
    bottoms[3, nail_nodes] = bottoms[1, nail_nodes] + bed

    allowed = (1 - anatomy.shape.least_hypodermis) * room
    squeeze = np.where(bottoms[3] > allowed, allowed / bottoms[3], 1.0)
    worst = int(np.argmin(squeeze))
    if not squeeze[worst] >= LEAST_SQUEEZE:
        at = ", ".join(f"{value:.1f}" for value in skin[worst])
        raise AnatomyError(
            f"The skin needs {bottoms[3, worst]:.3g} mm but only {max(room[worst], 0):.3g} mm lie between "
            f"surface and bone near ({at}) mm: make layers or bone thinner, or the fingertip larger."
        )
    bottoms[1:4] *= squeeze / room
    bottoms[4] = 1.0
    below = np.minimum(density.layer_levels.astype(int), 3)  # tissue that begins at or above each shell
    part = (density.layer_levels - below)[:, None]
    return (1 - part) * bottoms[below] + part * bottoms[below + 1]


def _tissue_ids(density: MeshDensity, on_nail: np.ndarray) -> Ints:
    ids = np.repeat(np.arange(4), density.layers)[:, None] + np.zeros(len(on_nail), dtype=np.int64)
    plate, bed = TISSUES.index("nail_plate"), TISSUES.index("nail_bed")
    covered = np.where(ids == 0, plate, np.where(ids < TISSUES.index("hypodermis"), bed, ids))
    return np.where(on_nail, covered, ids).ravel()


def _corner_edges(corners: Floats) -> Floats:
    """Three edges at each corner of each hexahedron, right-handed in a good one: (e, 8, 3, 3) ndarray."""
    return corners[:, _CORNERS] - corners[:, :, None]


def _check_jacobians(nodes: Floats, hexahedra: Ints) -> None:
    corners = nodes[hexahedra]
    smallest = np.linalg.det(_corner_edges(corners)).min(axis=1)
    bad = np.flatnonzero(~(smallest > 0))
    if bad.size:
        x, y, z = corners[bad[0]].mean(axis=0) / MILLIMETRE
        raise AnatomyError(
            f"{bad.size} of {len(hexahedra)} elements are inverted, the first near "
            f"({x:.1f}, {y:.1f}, {z:.1f}) mm, and all must be upright: "
            "bring the bone's sections or the surface exponents nearer to the defaults."
        )
