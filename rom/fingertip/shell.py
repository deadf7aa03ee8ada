"""The logical grid of one shell: a disk of quadrilaterals, the same family at every density.

A shell's logical point (u, v) lies in the square |u|, |v| <= 2 and rho = max(|u|, |v|): the tip is the
centre, rho = 1 the nail root's section, rho = 2 the joint.  A core grid (the cap) fills rho <= 1/2; square
rings follow, front ones up to 1 and rear ones up to 2.  All densities sample one continuous map from (u, v)
to the disk, so meshes of different densities agree on where a logical point is.
"""

from __future__ import annotations

import numbers
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from rom.checks import shown
from rom.errors import AnatomyError
from rom.fingertip.shape import real_number

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LARGEST_COUNT = 10_000
LARGEST_FACTOR = 1000.0
CAP_EXTENT = 0.5  # rho at the cap's edge: cap cells and front rings then have about the same depth
CAP_ROUNDNESS = 0.8  # 0 square, 1 circle: a full circle would flatten the cap's corner cells to 180 degrees


@dataclass(frozen=True)
class MeshDensity:
    """Numbers of elements of a mesh.

    Parameters
    ----------
    cap : (int, int)
        Elements of the core grid, lateral and dorsal; even, so that mid-plane and widest section carry nodes.
    front_rings, rear_rings : int
        Rings of 2 (a + b) elements around the core, distal and proximal of the nail root.
    layers : (int, int, int, int)
        Element layers in stratum corneum, epidermis, dermis, hypodermis.

    Raises
    ------
    AnatomyError
        For counts that are not positive whole numbers, or an odd cap.
    """

    cap: tuple[int, int] = (16, 16)
    front_rings: int = 8
    rear_rings: int = 8
    layers: tuple[int, int, int, int] = (1, 1, 2, 4)

    def __post_init__(self) -> None:
        object.__setattr__(self, "cap", _counts("cap", self.cap, 2))
        object.__setattr__(self, "layers", _counts("layers", self.layers, 4))
        for name in ("front_rings", "rear_rings"):
            object.__setattr__(self, name, _counts(name, (getattr(self, name),), 1)[0])
        if any(count % 2 for count in self.cap):
            raise AnatomyError(f"MeshDensity cap is {self.cap}, but both counts must be even: use even ones.")

    def scaled(self, factor: float) -> MeshDensity:
        """Return the density with every count multiplied by `factor` and rounded to a permitted one."""
        factor = real_number("Density factor", factor, above=0.0, most=LARGEST_FACTOR)

        def count(value: float) -> int:
            return max(1, int(np.floor(value * factor + 0.5)))

        a, b = (2 * count(value / 2) for value in self.cap)
        sc, ep, de, hy = (count(value) for value in self.layers)
        return MeshDensity((a, b), count(self.front_rings), count(self.rear_rings), (sc, ep, de, hy))

    @property
    def ring_size(self) -> int:
        """int : elements of one ring, 2 (a + b)."""
        return 2 * sum(self.cap)

    @property
    def nodes_per_shell(self) -> int:
        """int : (a + 1)(b + 1) + rings x ring size."""
        return (self.cap[0] + 1) * (self.cap[1] + 1) + (self.front_rings + self.rear_rings) * self.ring_size

    @property
    def ring_levels(self) -> Floats:
        """(rings + 1,) ndarray [-] : rho of the cap's edge and of each ring."""
        front = CAP_EXTENT + (1 - CAP_EXTENT) * np.arange(self.front_rings + 1) / self.front_rings
        return np.concatenate([front, 1 + np.arange(1, self.rear_rings + 1) / self.rear_rings])

    @property
    def layer_levels(self) -> Floats:
        """(shells,) ndarray [-] : layer coordinate of each shell; tissue k lies between k and k + 1."""
        parts = [k + np.arange(count) / count for k, count in enumerate(self.layers)]
        return np.concatenate([*parts, [float(len(self.layers))]])

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-able dict."""
        return {
            "cap": list(self.cap),
            "front_rings": self.front_rings,
            "rear_rings": self.rear_rings,
            "layers": list(self.layers),
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Rebuild a density from `to_dict`; every key must be there, and no other."""
        known = {"cap", "front_rings", "rear_rings", "layers"}
        if not isinstance(values, Mapping) or set(values) != known:
            raise AnatomyError(f"MeshDensity is read from {shown(values)}, but needs {', '.join(sorted(known))}: "
                               "write files with to_dict.")
        return cls(**values)


def _counts(name: str, values: Any, size: int) -> Any:
    try:
        given = tuple(values)
        whole = all(isinstance(value, numbers.Real) and not isinstance(value, bool) for value in given)
        counts = tuple(int(value) for value in given) if whole else ()
        whole = whole and all(count == value and 1 <= count <= LARGEST_COUNT
                              for count, value in zip(counts, given, strict=True))
    except (TypeError, ValueError, OverflowError):
        counts, whole = (), False
    if not whole or len(counts) != size:
        raise AnatomyError(
            f"MeshDensity {name} is {shown(values)}, but it must be {size} whole number(s) from 1 to "
            f"{LARGEST_COUNT:,}: give counts."
        )
    return counts


@dataclass(frozen=True, eq=False)
class ShellGrid:
    """Nodes and quadrilaterals of one shell.

    Parameters
    ----------
    logical : (n, 2) ndarray [-]
        u (lateral) and v (dorsal) of each node.
    quads : (m, 4) ndarray
        Node numbers, counter-clockwise seen from outside.
    last_ring : (ring_size,) ndarray
        Nodes at the joint.
    mirror : (n,) ndarray
        Node at (-u, v) for each node.
    """

    logical: Floats
    quads: Ints
    last_ring: Ints
    mirror: Ints


def shell_grid(density: MeshDensity) -> ShellGrid:
    """Build the grid: cap nodes row by row in u, then ring after ring."""
    a, b = density.cap
    i, j = (index.ravel() for index in np.meshgrid(np.arange(a + 1), np.arange(b + 1), indexing="ij"))
    # exact integers before the division, so that mirror partners are exact opposites
    square = np.stack([(2 * i - a) / a, (2 * j - b) / b], axis=1)
    edge = cap_edge(density)
    levels = density.ring_levels[1:]
    logical = np.concatenate([CAP_EXTENT * square, (levels[:, None, None] * square[edge]).reshape(-1, 2)])

    ids = np.arange((a + 1) * (b + 1)).reshape(a + 1, b + 1)
    cap_quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(-1, 4)
    rings = ring_nodes(density)
    inner, outer = rings[:-1], rings[1:]
    ring_quads = np.stack([inner, outer, np.roll(outer, -1, axis=1), np.roll(inner, -1, axis=1)], axis=-1)

    cap_mirror = ids[::-1].ravel()
    position = np.empty(ids.size, dtype=np.int64)
    position[edge] = np.arange(edge.size)
    ring_mirror = rings[1:][:, position[cap_mirror[edge]]]
    return ShellGrid(
        logical=logical,
        quads=np.concatenate([cap_quads, ring_quads.reshape(-1, 4)]),
        last_ring=rings[-1],
        mirror=np.concatenate([cap_mirror, ring_mirror.ravel()]),
    )


def cap_edge(density: MeshDensity) -> Ints:
    """Cap nodes on its edge, counter-clockwise from the corner (-1, -1): (ring_size,) ndarray."""
    a, b = density.cap
    ids = np.arange((a + 1) * (b + 1)).reshape(a + 1, b + 1)
    return np.concatenate([ids[:-1, 0], ids[-1, :-1], ids[:0:-1, -1], ids[0, :0:-1]])


def ring_nodes(density: MeshDensity) -> Ints:
    """Nodes of the cap's edge and of each ring: (rings + 1, ring_size) ndarray."""
    size, cap_size = density.ring_size, (density.cap[0] + 1) * (density.cap[1] + 1)
    rings = cap_size + np.arange((density.front_rings + density.rear_rings) * size).reshape(-1, size)
    return np.concatenate([cap_edge(density)[None], rings])


def to_disk(logical: Floats) -> tuple[Floats, Floats]:
    """Map logical points to disk and rear coordinates (see `rom.fingertip.surfaces`).

    Parameters
    ----------
    logical : (n, 2) ndarray [-]

    Returns
    -------
    disk : (n, 2) ndarray [-]
    rear : (n,) ndarray [-]
    """
    rho = np.abs(logical).max(axis=1)
    rim = logical / np.where(rho > 0, rho, 1.0)[:, None]  # on the unit square's edge
    cap = CAP_EXTENT * _round_square(logical / CAP_EXTENT)
    blend = np.clip((rho - CAP_EXTENT) / (1 - CAP_EXTENT), 0, 1)[:, None]
    ring = (1 - blend) * CAP_EXTENT * _round_square(rim) + blend * _equal_angles(rim)
    return np.where((rho <= CAP_EXTENT)[:, None], cap, ring), np.clip(rho - 1, 0, 1)


def _round_square(square: Floats) -> Floats:
    """Smooth elliptic map of the square towards the disk; the weight CAP_ROUNDNESS = 1 would reach it."""
    square = np.clip(square, -1, 1)
    return square * np.sqrt(1 - CAP_ROUNDNESS / 2 * square[:, ::-1] ** 2)


def _equal_angles(rim: Floats) -> Floats:
    """Square's edge to the unit circle, equal angles for equal lengths."""
    u, v = rim.T
    side = np.abs(u) >= np.abs(v)
    angle = np.pi / 4 * np.where(side, v, u)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack(
        [np.where(side, np.copysign(cosine, u), sine), np.where(side, sine, np.copysign(cosine, v))], axis=1
    )
