"""Bodies out of other programs' files: which matrix is what, and what real models hold made fit to compute with.

Made fit means: both triangles where a file stores one, no stored zeros, no rows of held degrees of freedom (they are
left out, and their names are kept in the notes). Degrees of freedom without mass stay.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from rom.bodies.body import Body
from rom.bodies.grid import Grid
from rom.bodies.mesh_files import read_mesh_file
from rom.bodies.places import chosen_dofs
from rom.bodies.readers.found import COMPONENTS, ending, find_matrices, known_endings
from rom.bodies.sources import Sources
from rom.bodies.tidy import both_triangles, held_rows, loss_part
from rom.errors import SchemaError


def read_body(path: str | Path, *, stiffness: str | Mapping[str, str] | None = None, mass: str | None = None,
              viscous: str | None = None, loss: str | None = None, mesh: str | Path | None = None,
              held: Iterable[str] = (), name: str | None = None, **of_mesh: Any) -> Body:
    """Read a body from a file of matrices, from a mesh, or from the file that :meth:`Body.write` made.

    Parameters
    ----------
    path : str or Path
        Matrix Market, .npz, .mat, Harwell-Boeing; Abaqus *MATRIX OUTPUT, Ansys .full, Nastran .pch and .op4, CalculiX
        .sti; the .nc of a body; or any mesh that meshio reads.
    stiffness, mass, viscous, loss : str, optional
        Which matrix is what, where the file does not say so: its name in the file or another file's path, if need be
        with a sign, a factor or a part, as in ``-K``, ``350e3*Kv``, ``imag(C)``. ``viscous`` is C [N s/m], ``loss``
        the imaginary part of the complex stiffness [N/m]; a complex stiffness gives both parts by itself. A mapping
        gives the stiffness by regions, whose sum it is.
    mesh : str or Path, optional
        Nodes and cells behind the degrees of freedom, in a format of meshio.
    held : iterable of str
        What is held beside what the file holds: names of degrees of freedom or nodes, and where there is a mesh
        places such as ``z=min``, see :func:`rom.bodies.places.held_nodes`.
    name : str, optional
        Default: the file's.
    **of_mesh
        Of :func:`rom.bodies.from_mesh.assembled`: ``materials`` and others.

    Returns
    -------
    Body

    Raises
    ------
    ValueError
        Where the file is unknown, damaged, or does not say what is what; with what to do about it.
    """
    path = Path(path)
    name = name or path.stem
    if path.suffix == ".nc":
        return _stored(path)
    if ending(path) not in known_endings():
        return Body.from_mesh(path, held=held, name=name, **of_mesh)
    if of_mesh:
        raise ValueError(f"{', '.join(of_mesh)} belongs to a mesh, and {path.name} holds matrices: leave it out")
    sources = Sources(path, find_matrices(path))
    regions, lossy, notes = {}, [], list(sources.found.notes)
    asked = stiffness if isinstance(stiffness, Mapping) else {"stiffness": stiffness or sources.guess("stiffness")}
    for region, words in asked.items():
        matrix = sources.matrix(str(words), "stiffness")
        regions[region] = sp.csr_array(matrix.real)
        if matrix.dtype.kind == "c":
            lossy += loss_part(matrix, region, notes)
    matrices = {role: sources.matrix(words, role) for role, words in
                (("mass", mass or sources.guess("mass")), ("viscous", viscous or sources.guess("viscous")),
                 ("loss", loss or sources.found.roles.get("loss"))) if words is not None}
    for one in lossy:
        matrices["loss"] = one + matrices["loss"] if "loss" in matrices else one
    return _body(sources, regions, matrices, notes, mesh, held, name)


def _stored(path: Path) -> Body:
    from rom.bodies.storage import read_arguments

    arguments, expected = read_arguments(path)
    body = Body(**arguments)
    if body.matrix_hash != expected:
        raise SchemaError(f"{path} was changed after it was written, its content has another hash: make it again with "
                          "`rom body`")
    return body


def _body(sources: Sources, regions: dict[str, sp.csr_array], matrices: dict[str, sp.csr_array],
          notes: list[str], mesh: str | Path | None, held: Iterable[str], name: str) -> Body:
    regions = {region: both_triangles(one, region, notes) for region, one in regions.items()}
    matrices = {role: both_triangles(one, role, notes) for role, one in matrices.items()}
    for role in ("mass", "viscous"):
        if role in matrices and matrices[role].dtype.kind == "c":
            raise ValueError(f"the {role} matrix is complex: say which part of it is meant, such as "
                             f"{role}='imag({sources.last[role]})'")
    stiffness = sum(regions.values(), sp.csr_array(next(iter(regions.values())).shape))
    if np.all(stiffness.diagonal() <= 0) and stiffness.diagonal().any():
        raise ValueError("the whole diagonal of the stiffness is negative, so it is stored with the other sign: give "
                         f"stiffness='-{sources.last['stiffness']}'")
    labels = sources.found.labels
    names = sources.found.names if labels is None else dof_names(labels, sources.found.given)
    if names is None:
        names = np.arange(stiffness.shape[0])
    grid = None if mesh is None else _grid(Path(mesh), labels, len(names), notes)
    alone = held_rows(stiffness, matrices)
    if alone.any():
        notes.append(f"{np.count_nonzero(alone)} rows of held degrees of freedom are left out: {_few(names[alone])}")
    out = alone.copy()
    out[chosen_dofs(held, names, grid)] = True
    if out.all():
        raise ValueError("every degree of freedom is held: nothing is left that could move; hold less")
    keep = np.flatnonzero(~out)

    def part(matrix: sp.csr_array) -> sp.csr_array:
        return matrix[keep][:, keep]

    if "mass" in matrices and (massless := np.count_nonzero(matrices["mass"].diagonal()[keep] == 0)):
        notes.append(f"{massless} degrees of freedom have no mass")
    if "mass" not in matrices:
        notes.append("there is no mass: statics alone can be answered; name it by mass=... if it lies elsewhere")
    notes += sources.unused()
    if grid is not None:
        grid = replace(grid, free=grid.free[keep])
    inner = {region: part(one) for region, one in regions.items()}
    return Body(inner if len(inner) > 1 else part(stiffness), part(matrices["mass"]) if "mass" in matrices else None,
                viscous=part(matrices["viscous"]) if "viscous" in matrices else None,
                loss_stiffness=part(matrices["loss"]) if "loss" in matrices else None,
                dof_names=names[keep], grid=grid, name=name, origin=sources.origin() | {"notes": notes})


def dof_names(labels: np.ndarray, given: Mapping[int, str]) -> np.ndarray:
    """``"17 z"`` for (17, 3): node and component; a scalar point's is its number alone, a named node's its name.

    Parameters
    ----------
    labels : (n, 2) ndarray of int
    given : mapping of str
        Names of nodes that stand for something else.
    """
    return np.array([given[node] if node in given else f"{node}" if component == 0
                     else f"{node} {component_name(component)}" for node, component in labels.tolist()])


def component_name(number: int) -> str:
    """x, y, z, rx, ry, rz, or the number of what is no motion in space."""
    return COMPONENTS[number] if 0 <= number < len(COMPONENTS) else f"dof{number}"


def _grid(path: Path, labels: np.ndarray | None, count: int, notes: list[str]) -> Grid | None:
    """Nodes and cells of a mesh file, and where the degrees of freedom lie among them."""
    found = read_mesh_file(path)
    if labels is None:
        per_node = count / max(len(found.nodes), 1)
        if per_node not in (1, 2, 3, 6):
            notes.append(f"{path.name} is not used: it has {len(found.nodes)} nodes for {count} degrees of freedom "
                         "that have no labels")
            return None
        notes.append(f"degrees of freedom are taken as {per_node:g} a node, in the order of {path.name}")
        node, component = np.divmod(np.arange(count), int(per_node))
        components = COMPONENTS[1:int(per_node) + 1]
    else:
        place = {label: i for i, label in enumerate(found.names.tolist())}
        missing = [label for label in labels[:, 0].tolist() if label not in place]
        if missing:
            raise ValueError(f"{path.name} has no node {missing[0]}, which the matrices have: give this model's mesh")
        node = np.array([place[label] for label in labels[:, 0].tolist()])
        numbers = np.unique(labels[:, 1])
        if numbers.max() <= 3 and numbers.min() >= 1:  # displacements keep their three places
            numbers = np.arange(1, 4)
        component = np.searchsorted(numbers, labels[:, 1])
        components = tuple(component_name(number) for number in numbers.tolist())
    return Grid(found.nodes, len(components) * node + component, found.cells, components, *found.regions(),
                names=found.names, sets=found.sets)


def _few(names: np.ndarray, most: int = 4) -> str:
    return ", ".join(map(str, names[:most].tolist())) + (" ..." if len(names) > most else "")
