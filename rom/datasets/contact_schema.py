"""The schema of datasets of load paths: dimensions, units, the UGRID mesh of the section.

Dimensions (path, position, node, component, skin). A position that a path did not reach holds NaN, ``reached`` says so
and ``reason`` why. Coordinates in metres, forces in newton, pressures in pascal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from rom.datasets.schema import CONVENTIONS, SCHEMA_VERSION
from rom.errors import SchemaError
from rom.scenes import FingerOnGlass

COMPONENTS = ["x", "y"]


class Quantity(NamedTuple):
    """An answer at each position of a path."""

    dims: tuple[str, ...]
    """Beside path and position."""
    units: str
    long_name: str


QUANTITIES: dict[str, Quantity] = {
    "displacement": Quantity(("node", "component"), "m", "displacement"),
    "stretch_z": Quantity((), "1", "out-of-plane stretch"),
    "normal_displacement": Quantity((), "m", "displacement of the plate since it touched"),
    "tangential_force": Quantity((), "N", "force that moves the plate along"),
    "contact_left": Quantity((), "m", "left end of the contact along the plate"),
    "contact_right": Quantity((), "m", "right end of the contact along the plate"),
    "contact_area": Quantity((), "m2", "area of a circle as wide as the contact"),
    "pressure": Quantity(("skin",), "Pa", "contact pressure over the deformed skin"),
    "shear": Quantity(("skin",), "Pa", "shear with which the plate drags the skin, over the deformed skin"),
}
"""What every method of the scene answers."""
CONTACT = tuple(name for name in QUANTITIES if name not in ("displacement", "stretch_z"))
"""The contact quantities: what remains of an answer where the field is not wanted."""
TRUTH_VARIABLES = ("reached", "viscosity", "solve_seconds", "iterations", "reason")
"""What a dataset says of its full-order paths; no other method's answer may carry it."""


def wanted(outputs: str) -> tuple[str, ...]:
    """Names of the quantities of ``outputs``: "field" or "contact"."""
    return CONTACT if outputs == "contact" else tuple(QUANTITIES)


def area_between(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """pi W^2 / 4 [m^2] of a contact W [m] wide: the publication's."""
    return 0.25 * np.pi * (right - left) ** 2


def shape_of(scene: FingerOnGlass, name: str) -> tuple[int, ...]:
    """Shape of a quantity beside path and position."""
    sizes = {"node": scene.n_nodes, "component": 2, "skin": scene.n_skin}
    return tuple(sizes[dim] for dim in QUANTITIES[name].dims)


def label_answers(scene: FingerOnGlass, cases: xr.Dataset, values: dict[str, np.ndarray]) -> xr.Dataset:
    """Attach names, units and positions to answers.

    Parameters
    ----------
    scene : FingerOnGlass
    cases : xr.Dataset
        Labelled paths.
    values : dict of (n_path, n_position, ...) ndarray
        By the names of :data:`QUANTITIES`.
    """
    # a stored dataset may come in as cases: its truth stays behind
    mine = [name for name in cases.variables if name not in (*QUANTITIES, *TRUTH_VARIABLES)
            and set(cases[name].dims) <= {"path", "position"}]
    answer = cases[mine].drop_dims("position", errors="ignore").assign_coords(
        {**scene.position_coordinates(), **field_coordinates(scene)})
    for name, array in values.items():
        quantity = QUANTITIES[name]
        answer[name] = (("path", "position", *quantity.dims), array, {
            "long_name": quantity.long_name, "units": quantity.units, **(
                {"mesh": "mesh", "location": "node"} if "node" in quantity.dims else {})})
    return answer


def field_coordinates(scene: FingerOnGlass) -> dict[str, tuple]:
    """Node and skin ids, components, positions in the undeformed section [m]."""
    mesh = scene.mesh
    nodes = 1e-3 * mesh.nodes
    return {
        "node": ("node", np.arange(scene.n_nodes), {"long_name": "mesh node", "units": "1"}),
        "component": ("component", COMPONENTS, {"long_name": "component of the displacement"}),
        "node_x": ("node", nodes[:, 0], {"long_name": "position along the plate", "units": "m"}),
        "node_y": ("node", nodes[:, 1], {"long_name": "height, towards the nail", "units": "m"}),
        "skin": ("skin", mesh.skin_nodes, {"long_name": "mesh node on the skin", "units": "1"})}


def mesh_variables(scene: FingerOnGlass) -> dict[str, tuple]:
    """UGRID description of the section's quadrilaterals."""
    return {
        "mesh": ((), np.int32(0), {
            "cf_role": "mesh_topology", "topology_dimension": np.int32(2), "long_name": "section of the finger",
            "node_coordinates": "node_x node_y", "face_node_connectivity": "mesh_face_nodes",
            "face_dimension": "quadrilateral"}),
        "mesh_face_nodes": (("quadrilateral", "corner"), scene.mesh.quads.astype(np.int32), {
            "cf_role": "face_node_connectivity", "start_index": np.int32(0), "long_name": "corners of a quadrilateral",
            "units": "1"})}


def dataset_attributes(scene: FingerOnGlass) -> dict[str, str]:
    """Attributes by which a file is recognised and tied to its section and scene."""
    return {
        "Conventions": CONVENTIONS, "schema_version": SCHEMA_VERSION, "title": scene.title, "scene": scene.name,
        "scene_parameters": scene.to_json(), "scene_hash": scene.content_hash}


def check_paths(data: xr.Dataset, scene: FingerOnGlass, source: str = "the dataset") -> None:
    """Refuse a dataset of another scene, section or mesh, or one that lacks a quantity.

    Raises
    ------
    SchemaError
    """
    if data.attrs.get("schema_version") != SCHEMA_VERSION:
        raise SchemaError(f"{source} is no dataset of schema version {SCHEMA_VERSION}: make one with `rom dataset`")
    if data.attrs.get("scene") != scene.name:
        raise SchemaError(f"{source} belongs to the scene {data.attrs.get('scene')!r}, not to {scene.name!r}: "
                          "give a dataset of this scene")
    if data.attrs.get("scene_hash") != scene.content_hash:
        found = str(data.attrs.get("scene_hash"))[:12]
        raise SchemaError(f"{source} belongs to another section or mesh ({found} instead of "
                          f"{scene.content_hash[:12]}): make it again for this one")
    missing = [name for name in (*QUANTITIES, "reached") if name not in data.variables]
    if missing:
        raise SchemaError(f"{source} lacks {', '.join(missing)}: make the dataset again with `rom dataset`")
