"""Bodies from meshes: tetrahedra and hexahedra, linear or quadratic, with a material for each region."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from rom.bodies.elements import CHUNK, KINDS, MIRRORED, assemble, element_mass, element_stiffness, geometry, shape
from rom.bodies.grid import Grid
from rom.bodies.mesh_files import MeshFile, from_meshio, read_mesh_file
from rom.bodies.places import held_nodes
from rom.checks import choice, real_number, shown

LOCKING = {"tetra": 0.45, "tetra10": 0.495, "hexahedron": 0.45, "hexahedron20": 0.495, "hexahedron27": 0.495}
"""Poisson's ratio from which fully integrated elements are too stiff to be trusted."""


@dataclass(frozen=True)
class Material:
    """An isotropic linear elastic material.

    Parameters
    ----------
    young : float [Pa]
    poisson : float [-]
        Above -1 and below 1/2.
    density : float [kg/m3]
    loss_factor : float [-]
        Of this material alone, beside the loss factor of a case.

    Raises
    ------
    ValueError
        For a value out of range.
    """

    young: float
    poisson: float
    density: float
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        real_number("young", self.young, above=0, unit="Pa")
        if not -1 < real_number("poisson", self.poisson) < 0.5:
            raise ValueError(f"poisson={shown(self.poisson)} cannot be: give a number above -1 and below 0.5")
        real_number("density", self.density, above=0, unit="kg/m3")
        real_number("loss_factor", self.loss_factor, 0)

    @property
    def shear_modulus(self) -> float:
        """mu [Pa]."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def bulk_modulus(self) -> float:
        """kappa [Pa]."""
        return self.young / (3 * (1 - 2 * self.poisson))


def assembled(mesh: Any, materials: Material | Mapping[str, Material] | None = None, *, held: Iterable[str] = (),
              formulation: str | None = None, scale: float = 1.0, region_data: str | None = None,
              name: str = "body") -> dict[str, Any]:
    """Assemble a body of linear elastic solids.

    Parameters
    ----------
    mesh : str, Path, meshio.Mesh or skfem.Mesh
        Of tetra, tetra10, hexahedron, hexahedron20 or hexahedron27 cells, or several of them together.
    materials : Material or dict of Material
        One for the whole body, or one for each region by its name.
    held : iterable of str
        Where displacements are zero, see :func:`rom.bodies.places.held_nodes`; nothing: the body floats freely.
    formulation : {"full", "b-bar"}, optional
        Default: b-bar for linear hexahedra, full for all other cells.
    scale : float [m]
        The mesh's unit of length, such as 1e-3.
    region_data : str, optional
        Cell data of the mesh that tells regions apart, where it does not say so itself.
    name : str

    Returns
    -------
    dict
        Arguments of :class:`rom.bodies.Body`: three displacements a node, the stiffness by region where there are
        several.

    Raises
    ------
    ValueError
        For cells of other kinds, inverted or flat cells, a region without material, or a place that does not exist.
    """
    found, origin = _found(mesh, region_data)
    real_number("scale", scale, above=0, unit="m")
    region, region_names = found.regions(tuple(materials) if isinstance(materials, Mapping) else ())
    solids = [_material(one, materials, region_names) for one in region_names]
    nodes = found.nodes * scale
    cells = {kind: _oriented(kind, nodes, one) for kind, one in found.cells.items()}
    stiffness, mass = _matrices(nodes, cells, region, solids, formulation)
    used = np.zeros(len(nodes), dtype=bool)
    for one in cells.values():
        used[one] = True
    free = np.repeat(used, 3)
    grid = Grid(nodes, np.arange(3 * len(nodes)), cells, region=region, region_names=region_names, names=found.names,
                sets=found.sets)
    for words in held:
        at, components = held_nodes(words, grid)
        free[(3 * at[:, None] + components).ravel()] = False
    keep = np.flatnonzero(free)
    if not len(keep):
        raise ValueError("every degree of freedom is held: nothing is left that could move; hold less")
    parts = {one: sp.csr_array(matrix[keep][:, keep]) for one, matrix in zip(region_names, stiffness, strict=True)}
    loss = [solid.loss_factor * part for solid, part in zip(solids, parts.values(), strict=True) if solid.loss_factor]
    names = np.array([f"{node} {axis}" for node in found.names.tolist() for axis in "xyz"])[keep]
    notes = [] if used.all() else [f"{np.count_nonzero(~used)} nodes belong to no cell and are left out"]
    return {"stiffness": parts if len(parts) > 1 else parts[region_names[0]], "mass": sp.csr_array(mass[keep][:, keep]),
            "loss_stiffness": sp.csr_array(sum(loss[1:], loss[0])) if loss else None, "dof_names": names, "name": name,
            "grid": replace(grid, free=keep), "doubts": _doubts(cells, region, solids, formulation),
            "origin": origin | {"notes": notes}}


def _material(region: str, materials: Material | Mapping[str, Material] | None, regions: tuple[str, ...]) -> Material:
    found = materials.get(region) if isinstance(materials, Mapping) else materials
    if found is None:
        raise ValueError(f"region {region!r} has no material: the mesh has the regions {', '.join(regions)}; give a "
                         "Material (young [Pa], poisson, density [kg/m3]) for each, or one for all")
    return found


def _found(mesh: Any, region_data: str | None) -> tuple[MeshFile, dict[str, Any]]:
    if isinstance(mesh, (str, Path)):
        path = Path(mesh)
        found = read_mesh_file(path, region_data)
        return found, {"format": "mesh", "files": {path.name: hashlib.sha256(path.read_bytes()).hexdigest()}}
    if hasattr(mesh, "doflocs"):  # of scikit-fem
        from skfem.io.meshio import to_meshio

        converted = to_meshio(mesh)
        groups = {one: {converted.cells[0].type: np.asarray(cells)} for one, cells in (mesh.subdomains or {}).items()}
        sets = {one: np.unique(mesh.facets[:, facets]) for one, facets in (mesh.boundaries or {}).items()}
        found = from_meshio(converted)
        return MeshFile(found.nodes, found.cells, np.arange(len(found.nodes)), groups, found.sets | sets), \
            {"format": "scikit-fem mesh"}
    return from_meshio(mesh, region_data), {"format": "mesh in memory"}


def _oriented(kind: str, nodes: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The cells, tetrahedra that are inside out turned round; ValueError for folded, flat or foreign ones."""
    if kind not in KINDS:
        raise ValueError(f"the mesh has cells of the kind {kind!r}: a body is made of {', '.join(KINDS)}")
    volume = np.concatenate([geometry(kind, nodes, cells[part])[1] for part in _chunks(kind, len(cells))])
    inside = np.logical_and((volume < 0).all(axis=1), kind in MIRRORED)
    bad = np.flatnonzero(~(volume > 0).all(axis=1) & ~inside)
    if len(bad):
        raise ValueError(f"{len(bad)} of {len(cells)} cells of the kind {kind} are flat, folded or inside out, the "
                         f"first is number {bad[0]}: mend the mesh")
    return np.where(inside[:, None], cells[:, MIRRORED[kind]], cells) if inside.any() else cells


def _chunks(kind: str, count: int) -> list[slice]:
    points, m = shape(kind).value.shape
    step = max(1, CHUNK // max(9 * m * m, 3 * m * points))
    return [slice(start, start + step) for start in range(0, count, step)]


def _formulation(kind: str, formulation: str | None) -> str:
    return formulation or ("b-bar" if kind == "hexahedron" else "full")


def _matrices(nodes: np.ndarray, cells: dict[str, np.ndarray], region: dict[str, np.ndarray],
              materials: list[Material], formulation: str | None) -> tuple[list[sp.csr_array], sp.csr_array]:
    """Stiffness of each region, and the mass, over three displacements of every node."""
    if formulation is not None:
        choice("formulation", formulation, ("full", "b-bar"))
    n = 3 * len(nodes)
    stiffness, mass = [sp.csr_array((n, n)) for _ in materials], sp.csr_array((len(nodes), len(nodes)))
    for kind, every in cells.items():
        for index, material in enumerate(materials):
            here = every[region[kind] == index]
            for part in _chunks(kind, len(here)):
                one = here[part]
                k = element_stiffness(kind, nodes, one, material.shear_modulus, material.bulk_modulus,
                                      _formulation(kind, formulation))
                stiffness[index] = stiffness[index] + sp.csr_array(assemble(one, k, len(nodes)))
                m = element_mass(kind, nodes, one, material.density)
                mass = mass + sp.csr_array(assemble(one, m, len(nodes)))
    return stiffness, sp.csr_array(sp.kron(mass, sp.eye_array(3), format="csr"))


def _doubts(cells: dict[str, np.ndarray], region: dict[str, np.ndarray], materials: list[Material],
            formulation: str | None) -> tuple[str, ...]:
    doubts = []
    for kind in cells:
        present = [materials[index].poisson for index in np.unique(region[kind])]
        if _formulation(kind, formulation) == "full" and max(present) >= LOCKING[kind]:
            doubts.append(f"cells of the kind {kind} lock at Poisson's ratio {max(present):g}: take quadratic ones" + (
                ", or formulation b-bar" if kind == "hexahedron" else ""))
    return tuple(doubts)
