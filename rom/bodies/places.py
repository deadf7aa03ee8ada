"""Places on a body in words: degrees of freedom, named sets, labels of nodes, and planes such as ``z=min``."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from rom.bodies.grid import Grid
from rom.bodies.loads import Loads
from rom.checks import shown

NEAR = 1e-6
"""Distance from a plane that counts as lying in it, against the body's size."""
_PLANE = re.compile(r"(?P<axis>[xyz])\s*(?P<sign><=|>=|<|>|=)\s*(?P<value>min|max|[-+]?[\d.]+(?:e[-+]?\d+)?)",
                    re.IGNORECASE)


def chosen_dofs(places: str | Iterable[str], names: np.ndarray, grid: Grid | None = None) -> np.ndarray:
    """Degrees of freedom that places name, in the order of the places and then of the body.

    Parameters
    ----------
    places : str or iterable of str
        Each the name of a degree of freedom, the label of a node before its component's, or, where there is a grid,
        what :func:`held_nodes` takes.
    names : (n,) ndarray
        Names of the degrees of freedom.
    grid : Grid, optional

    Returns
    -------
    dofs : (k,) ndarray of int

    Raises
    ------
    ValueError
        Where a place names nothing.
    """
    text = names.astype(str)
    found: list[int] = []
    for place in [places] if isinstance(places, str) else places:
        here = np.flatnonzero(text == place)
        if not len(here):
            here = np.flatnonzero(np.char.startswith(text, f"{place} "))
        if not len(here) and grid is not None:
            nodes, components = held_nodes(place, grid)
            node, component = np.divmod(grid.free, len(grid.components))
            here = np.flatnonzero(np.isin(node, nodes) & np.isin(component, components))
        if not len(here):
            raise ValueError(f"{shown(place)} names no degree of freedom of this body that is free: give one such as "
                             f"{shown(str(text[0]))}, or the label of a node")
        found += [dof for dof in here.tolist() if dof not in found]
    return np.array(found, dtype=np.int64)


def columns_of(inputs: str | Iterable[str] | Loads, names: np.ndarray,
               grid: Grid | None = None) -> tuple[np.ndarray, list[str]]:
    """(n, k) right-hand sides of unit forces at places, or of loads, and their names; parameters as above."""
    if isinstance(inputs, Loads):
        return np.asarray(inputs.columns, dtype=float), inputs.names
    at = chosen_dofs(inputs, names, grid)
    force = np.zeros((len(names), len(at)))
    force[at, np.arange(len(at))] = 1
    return force, names[at].astype(str).tolist()


def held_nodes(words: str, grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of a place and the components that are meant there.

    Parameters
    ----------
    words : str
        The name of a set, the label of a node, or a plane or side such as ``z=min``, ``x=0.02``, ``y<0`` [m]; then, if
        not all components are meant, a colon and theirs: ``base:x,z``; also ``17 z`` for one component of one node.
    grid : Grid

    Returns
    -------
    nodes, components : ndarray of int

    Raises
    ------
    ValueError
        Where nothing is called so or lies there.
    """
    place, _, chosen = words.partition(":")
    nodes = _nodes(place.strip(), grid)
    if nodes is None and not chosen and " " in words.strip():
        place, _, chosen = words.strip().rpartition(" ")
        nodes = _nodes(place, grid)
    if nodes is None:
        sets = ", ".join(sorted(grid.sets)) or "there is none"
        raise ValueError(f"{shown(words)} is no place on the body: give a set ({sets}), the label of a node "
                         f"such as {grid.node_names[0]}, or a plane such as z=min")
    if not len(nodes):
        low, high = (" ".join(f"{value:.6g}" for value in end(axis=0)) for end in (grid.nodes.min, grid.nodes.max))
        raise ValueError(f"no node lies in {shown(place.strip())}: the body reaches from {low} to {high} m")
    names = [name.strip() for name in chosen.split(",") if name.strip()] or list(grid.components)
    unknown = [name for name in names if name not in grid.components]
    if unknown:
        raise ValueError(f"{shown(words)} names the component {unknown[0]}: the body has {', '.join(grid.components)}")
    return nodes, np.array([grid.components.index(name) for name in names])


def _nodes(place: str, grid: Grid) -> np.ndarray | None:
    if place in grid.sets:
        return grid.sets[place]
    plane = _PLANE.fullmatch(place)
    if plane is None:
        found = np.flatnonzero(np.asarray(grid.node_names).astype(str) == place)
        return found if len(found) else None
    along = grid.nodes[:, "xyz".index(plane["axis"].lower())]
    near = NEAR * float(np.ptp(grid.nodes, axis=0).max())
    ends = {"min": along.min(), "max": along.max()}
    value = ends[plane["value"].lower()] if plane["value"].lower() in ends else float(plane["value"])
    test = {"=": np.abs(along - value) <= near, "<": along < value, ">": along > value, "<=": along <= value + near,
            ">=": along >= value - near}
    return np.flatnonzero(test[plane["sign"]])
