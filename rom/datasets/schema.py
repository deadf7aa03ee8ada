"""The one schema of every dataset: dimensions, units and the UGRID mesh.

Coordinates are in metres, forces in newton; how complex numbers stand on disk, see :mod:`rom.scenes.complex_parts`.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from rom.bodies import Grid
from rom.errors import SchemaError
from rom.scenes import Scene

SCHEMA_VERSION = "1.0"
CONVENTIONS = "CF-1.11 UGRID-1.0"

SPLIT_FLAGS = {"unused": 0, "train": 1, "test": 2}


def mesh_variables(grid: Grid | None) -> dict[str, tuple]:
    """UGRID description of a grid: topology, connectivity, regions; nothing where there is none."""
    if grid is None or len(grid.cells) != 1:  # UGRID has one kind of cell a topology: mixed ones stay with the body
        return {}
    (kind, cells), = grid.cells.items()
    flat = grid.nodes.shape[1] == 2
    where, cell = ("face", {"quad": "quadrilateral"}.get(kind, kind)) if flat else ("volume", kind)
    variables: dict[str, tuple] = {
        "mesh": ((), np.int32(0), {
            "cf_role": "mesh_topology", "topology_dimension": np.int32(2 if flat else 3), "long_name": grid.noun,
            "node_coordinates": " ".join(f"node_{axis}" for axis in "xyz"[:grid.nodes.shape[1]]),
            f"{where}_node_connectivity": f"mesh_{where}_nodes", f"{where}_dimension": cell,
            **({} if flat else {"volume_shape_type": "mesh_volume_shape"})}),
        f"mesh_{where}_nodes": ((cell, "corner"), cells.astype(np.int32), {
            "cf_role": f"{where}_node_connectivity", "start_index": np.int32(0), "long_name": f"corners of a {cell}",
            "units": "1"})}
    if not flat:
        variables["mesh_volume_shape"] = ((cell,), np.zeros(len(cells), dtype=np.int8), {
            "cf_role": "volume_shape_type", "flag_values": np.int8(0), "flag_meanings": cell,
            "long_name": "shape of an element", "units": "1"})
    if kind in grid.region:
        variables[grid.region_noun] = ((cell,), grid.region[kind].astype(np.int8), {
            "long_name": f"{grid.region_noun} of an element",
            "flag_values": np.arange(len(grid.region_names), dtype=np.int8),
            "flag_meanings": " ".join(grid.region_names), "units": "1", "mesh": "mesh", "location": where})
    return variables


def dataset_attributes(scene: Scene) -> dict[str, str]:
    """Attributes by which a file is recognised and tied to its scene."""
    return {
        "Conventions": CONVENTIONS, "schema_version": SCHEMA_VERSION, "title": scene.title, "scene": scene.name,
        "inputs": " ".join(one.name for one in scene.inputs if one.default is None),
        "scene_parameters": scene.to_json(), "scene_hash": scene.content_hash}


def check_schema(data: xr.Dataset, source: str) -> None:
    """Refuse a dataset that is not ours or not of this version.

    Raises
    ------
    SchemaError
        Naming ``source`` and what is wrong with it.
    """
    version = data.attrs.get("schema_version")
    if version is None:
        raise SchemaError(f"{source} is no dataset of this toolkit: it carries no schema_version; make one with "
                          "`rom dataset`")
    if version != SCHEMA_VERSION or "path" in data.dims:
        raise SchemaError(f"{source} has schema version {'1.0' if 'path' in data.dims else version}, this software "
                          f"reads {SCHEMA_VERSION}: make the dataset again with `rom dataset`")
    wanted = (*data.attrs.get("inputs", "").split(), "displacement")
    missing = [name for name in wanted if name not in data.variables]
    missing += ["the dimension case"] if "case" not in data.dims else []
    if missing:
        raise SchemaError(f"{source} lacks {', '.join(missing)}: make the dataset again with `rom dataset`")
