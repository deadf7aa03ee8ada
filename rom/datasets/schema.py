"""The one schema of every dataset: dimensions, units and the UGRID mesh.

Coordinates are in metres, forces in newton.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from rom.errors import SchemaError
from rom.fingertip import TISSUES
from rom.scenes import Scene

SCHEMA_VERSION = "1.0"
CONVENTIONS = "CF-1.11 UGRID-1.0"

SPLIT_FLAGS = {"unused": 0, "train": 1, "test": 2}


def mesh_variables(scene: Scene) -> dict[str, tuple]:
    """UGRID description of the scene's mesh: topology, connectivity, tissues."""
    mesh = scene.fingertip.mesh
    return {
        "mesh": ((), np.int32(0), {
            "cf_role": "mesh_topology", "topology_dimension": np.int32(3), "long_name": "fingertip mesh",
            "node_coordinates": "node_x node_y node_z", "volume_node_connectivity": "mesh_volume_nodes",
            "volume_dimension": "hexahedron", "volume_shape_type": "mesh_volume_shape"}),
        "mesh_volume_nodes": (("hexahedron", "corner"), mesh.hexahedra.astype(np.int32), {
            "cf_role": "volume_node_connectivity", "start_index": np.int32(0), "long_name": "corners of a hexahedron",
            "units": "1"}),
        "mesh_volume_shape": (("hexahedron",), np.zeros(len(mesh.hexahedra), dtype=np.int8), {
            "cf_role": "volume_shape_type", "flag_values": np.int8(0), "flag_meanings": "hexahedron",
            "long_name": "shape of an element", "units": "1"}),
        "tissue": (("hexahedron",), mesh.tissue.astype(np.int8), {
            "long_name": "tissue of an element", "flag_values": np.arange(len(TISSUES), dtype=np.int8),
            "flag_meanings": " ".join(TISSUES), "units": "1", "mesh": "mesh", "location": "volume"}),
    }


def dataset_attributes(scene: Scene) -> dict[str, str]:
    """Attributes by which a file is recognised and tied to its mesh and scene."""
    return {
        "Conventions": CONVENTIONS, "schema_version": SCHEMA_VERSION, "title": scene.title, "scene": scene.name,
        "scene_parameters": scene.to_json(), "scene_hash": scene.content_hash,
        "mesh_hash": scene.fingertip.mesh.mesh_hash}


def check_schema(data: xr.Dataset, source: str) -> None:
    """Refuse a dataset that is not ours or not of this version.

    Raises
    ------
    SchemaError
        Naming ``source`` and what is wrong with it.
    """
    version = data.attrs.get("schema_version")
    if version is None:
        raise SchemaError(f"{source} is no fingertip-rom dataset: it carries no schema_version; "
                          "make one with `rom dataset`")
    if version != SCHEMA_VERSION:
        raise SchemaError(f"{source} has schema version {version}, this software reads {SCHEMA_VERSION}: "
                          "make the dataset again with `rom dataset`")
    missing = [name for name in ("load_node", "force_amplitude", "displacement") if name not in data.variables]
    if missing:
        raise SchemaError(f"{source} lacks {', '.join(missing)}: make the dataset again with `rom dataset`")


def check_scene(data: xr.Dataset, scene: Scene, source: str = "the dataset") -> None:
    """Refuse a dataset of another scene, anatomy or mesh.

    Raises
    ------
    SchemaError
    """
    if data.attrs.get("scene") != scene.name:
        raise SchemaError(f"{source} belongs to the scene {data.attrs.get('scene')!r}, not to {scene.name!r}: "
                          "give a dataset of this scene")
    if data.attrs.get("scene_hash") != scene.content_hash:
        found = str(data.attrs.get("scene_hash"))[:12]
        raise SchemaError(f"{source} belongs to another anatomy or mesh, or to other load sites ({found} instead "
                          f"of {scene.content_hash[:12]}): make it again for this fingertip")
