"""Meshes in any format of meshio, with what bodies want of them: labels of nodes, regions, named sets.

Labels of nodes are read from Abaqus and Nastran decks themselves, because meshio forgets them. Tetrahedra as lines
``v x y z`` and ``t a b c d`` (.tet), which meshio lacks, are read here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import meshio

DIMENSION = {"vertex": 0, "line": 1, "triangle": 2, "quad": 2, "tetra": 3, "hexahedron": 3, "wedge": 3, "pyramid": 3}
"""By the beginning of a cell kind's name."""
REGION_DATA = ("gmsh:physical", "medit:ref", "nastran:ref", "cell_tags", "region", "material", "tissue", "label")
"""Cell data that usually tells regions apart, the first that is there."""


@dataclass(frozen=True, eq=False)
class MeshFile:
    """Nodes, the cells of the highest dimension, and groups of both.

    Parameters
    ----------
    nodes : (n, 3) ndarray
        In the file's unit of length.
    cells : dict of (n_cell, n_corner) ndarray of int
        By meshio's kind names.
    names : (n,) ndarray, optional
        Labels of the nodes.
    groups : dict of dict of ndarray of int
        Cells of each named group, by kind.
    sets : dict of ndarray of int
        Nodes of each named set: of points, of cells, and of faces.
    """

    nodes: np.ndarray
    cells: dict[str, np.ndarray]
    names: np.ndarray
    groups: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    sets: dict[str, np.ndarray] = field(default_factory=dict)

    def regions(self, wanted: tuple[str, ...] = ()) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
        """Index of each cell's region, by kind, and the regions' names.

        Parameters
        ----------
        wanted : tuple of str
            Groups that count where groups of the file share cells.

        Raises
        ------
        ValueError
            Where a cell is in two of the groups.
        """
        names = list(self.groups)
        grouped = sum(len(one) for kinds in self.groups.values() for one in kinds.values())
        if grouped > sum(map(len, self.cells.values())):
            names = [name for name in self.groups if name in wanted] or names
        region = {kind: np.full(len(cells), -1) for kind, cells in self.cells.items()}
        for number, name in enumerate(names):
            for kind, cells in self.groups[name].items():
                twice = region[kind][cells] >= 0
                if twice.any():
                    other = names[region[kind][cells[twice][0]]]
                    raise ValueError(f"groups {name!r} and {other!r} of the mesh share cells: name those that tell the "
                                     "materials apart")
                region[kind][cells] = number
        if any((index < 0).any() for index in region.values()):
            for index in region.values():
                index[index < 0] = len(names)
            names.append("body" if not names else "rest")
        return region, tuple(names)


def read_mesh_file(path: str | Path, region_data: str | None = None) -> MeshFile:
    """Read a mesh; parameters as :func:`from_meshio`.

    Raises
    ------
    ValueError
        Where meshio does not know the format, or the file is damaged or holds no cells.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} does not exist: correct the path")
    if path.suffix.lower() == ".tet":
        return _tet(path)
    import meshio

    try:
        found = from_meshio(meshio.read(path), region_data)
    except (meshio.ReadError, SystemExit) as error:  # meshio ends the process for an unknown ending
        raise ValueError(f"{path.name} is no mesh that meshio reads ({error}): give one of its formats, or a file of "
                         "matrices") from error
    except (KeyError, IndexError, AssertionError, TypeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path.name} is damaged ({type(error).__name__}: {error}): write it again") from error
    labels = _labels(path)
    return found if labels is None or len(labels) != len(found.nodes) else MeshFile(
        found.nodes, found.cells, labels, found.groups, found.sets)


def from_meshio(mesh: meshio.Mesh, region_data: str | None = None) -> MeshFile:
    """What a mesh in memory holds.

    Parameters
    ----------
    mesh : meshio.Mesh
    region_data : str, optional
        Cell data that tells regions apart; default: the first of :data:`REGION_DATA` that is there.

    Raises
    ------
    ValueError
        Where there is no cell, or no such cell data.
    """
    dimension = [next((d for name, d in DIMENSION.items() if block.type.startswith(name)), -1) for block in mesh.cells]
    top = max(dimension, default=-1)
    if top < 1:
        raise ValueError("the mesh has no cells: give one of tetrahedra or hexahedra")
    if region_data is not None and region_data not in mesh.cell_data:
        raise ValueError(f"the mesh has no cell data {region_data!r}: it has {', '.join(mesh.cell_data) or 'none'}")
    nodes = np.zeros((len(mesh.points), 3))
    nodes[:, :mesh.points.shape[1]] = mesh.points
    groups: dict[str, list[np.ndarray]] = {name: list(parts) for name, parts in mesh.cell_sets.items()
                                           if not name.startswith("gmsh:")}
    data = region_data or (next((name for name in REGION_DATA if name in mesh.cell_data), None) if not groups else None)
    if data is not None:
        groups |= _by_value(mesh, data, dimension)
    blocks: dict[str, list[np.ndarray]] = {}
    inner: dict[str, dict[str, list[np.ndarray]]] = {}
    sets = {name: np.asarray(points) for name, points in mesh.point_sets.items()}
    for i, block in enumerate(mesh.cells):
        offset = sum(map(len, blocks.get(block.type, ())))
        if dimension[i] == top:
            blocks.setdefault(block.type, []).append(np.asarray(block.data, dtype=np.int64))
        for name, parts in groups.items():
            chosen = np.asarray(parts[i] if parts[i] is not None else [], dtype=np.int64)
            if len(chosen):
                if dimension[i] == top:
                    inner.setdefault(name, {}).setdefault(block.type, []).append(chosen + offset)
                sets[name] = np.union1d(sets.get(name, np.empty(0, dtype=np.int64)), np.asarray(block.data)[chosen])
    return MeshFile(nodes, {kind: np.concatenate(parts) for kind, parts in blocks.items()},
                    np.arange(1, len(nodes) + 1), {name: {kind: np.concatenate(parts) for kind, parts in kinds.items()}
                     for name, kinds in inner.items()}, sets)


def _by_value(mesh: meshio.Mesh, data: str, dimension: list[int]) -> dict[str, list[np.ndarray]]:
    """Groups of cells with the same value, under the names that gmsh gives to (value, dimension)."""
    known = {(int(tag), int(d)): name for name, (tag, d) in mesh.field_data.items()} if mesh.field_data else {}
    groups: dict[str, list[np.ndarray]] = {}
    for i, values in enumerate(mesh.cell_data[data]):
        for value in np.unique(values):
            name = known.get((int(value), dimension[i]), f"{value:g}")
            parts = groups.setdefault(name, [np.empty(0, dtype=np.int64)] * len(mesh.cells))
            parts[i] = np.flatnonzero(values == value)
    return groups


def _tet(path: Path) -> MeshFile:
    """``v x y z`` and ``t a b c d`` lines, counted from 0."""
    rows: dict[str, list[list[str]]] = {"v": [], "t": []}
    with open(path, encoding="utf-8", errors="replace") as lines:
        for words in map(str.split, lines):
            if words and words[0] in rows:
                rows[words[0]].append(words[1:4 if words[0] == "v" else 5])
    try:
        nodes, cells = np.array(rows["v"], dtype=float), np.array(rows["t"], dtype=np.int64)
    except ValueError as error:
        raise ValueError(f"{path.name} is damaged ({error}): a line is `v x y z` or `t a b c d`") from error
    if not (nodes.ndim == cells.ndim == 2 and nodes.shape[1] == 3 and cells.shape[1] == 4 and cells.min() >= 0
            and cells.max() < len(nodes)):
        raise ValueError(f"{path.name} has nodes of shape {nodes.shape} and tetrahedra of shape {cells.shape}, or a "
                         "tetrahedron without its nodes: a line is `v x y z` or `t a b c d`, counted from 0")
    return MeshFile(nodes, {"tetra": cells}, np.arange(len(nodes)))


def _labels(path: Path) -> np.ndarray | None:
    """Labels of the nodes of an Abaqus or Nastran deck, in the order of the file."""
    if path.suffix.lower() == ".inp":
        found, inside = [], False
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("*"):
                inside = inside if line.startswith("**") else bool(re.match(r"\*node\s*(,|$)", line, re.IGNORECASE))
            elif inside and line.strip():
                found.append(int(line.split(",")[0]))
        return np.array(found)
    if path.suffix.lower() in (".bdf", ".fem", ".nas"):
        return np.array([int(match) for match in re.findall(
            r"^GRID(?:\*\s{3}|\s{4}|\s*,)\s*(\d+)", path.read_text(encoding="utf-8", errors="replace"), re.MULTILINE)])
    return None
