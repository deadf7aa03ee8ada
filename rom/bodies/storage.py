"""A body as one netCDF file: matrices in compressed rows, labels, positions, cells, regions, sets and provenance."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
import xarray as xr

from rom.bodies.grid import Grid
from rom.errors import SchemaError
from rom.files import check_seal, seal, whole_file
from rom.provenance import stamp

if TYPE_CHECKING:
    from rom.bodies.body import Body

BODY_VERSION = "1.0"
UNITS = {"stiffness": "N m-1", "loss_stiffness": "N m-1", "mass": "kg", "viscous": "N s m-1"}


def write_body(body: Body, path: str | Path) -> None:
    """Write a body, whole or not at all.

    Parameters
    ----------
    body : Body
    path : str or Path
        Ends in ``.nc``.

    Raises
    ------
    ValueError
        For another ending.
    OSError
        Where the file cannot be written.
    """
    if Path(path).suffix != ".nc":
        raise ValueError(f"a body was to be written as {Path(path).name}: end the name in .nc")
    model = body.model
    variables: dict[str, tuple] = {"dof_name": ("dof", _plain(body.dof_names), {
        "long_name": "label of a degree of freedom in the program that it comes from"})}
    regions = body.stiffness_by_region or {"": model.stiffness}
    for i, (region, matrix) in enumerate(regions.items()):
        variables |= _rows("stiffness" if len(regions) == 1 else f"stiffness_{i}", matrix, UNITS["stiffness"], region)
    for name, one in (("mass", model.mass if body.has_mass else None), ("loss_stiffness", model.loss_stiffness),
                      ("viscous", body.viscous)):
        if one is not None:
            variables |= _rows(name, one, UNITS[name], "")
    grid_attributes: dict[str, Any] = {}
    if body.grid is not None:
        variables |= _grid_variables(body.grid)
        grid_attributes = {"components": list(body.grid.components), "region_names": list(body.grid.region_names),
                           "sets": list(body.grid.sets), "axes": list(body.grid.axes), "noun": body.grid.noun,
                           "region_noun": body.grid.region_noun}
    attributes = {"Conventions": "CF-1.11", "body_version": BODY_VERSION, "title": body.name,
                  "content_hash": body.matrix_hash, "doubts": json.dumps(list(body.doubts)),
                  "origin": json.dumps(body.origin), "grid": json.dumps(grid_attributes)}
    data = xr.Dataset(variables, attrs=stamp(**attributes))
    encoding = {name: {"zlib": True, "complevel": 1, "shuffle": True} for name, one in data.data_vars.items()
                if one.dtype.kind in "fi" and one.size > 1000}
    with whole_file(path) as temporary:
        data.to_netcdf(temporary, engine="netcdf4", encoding=encoding)
        seal(temporary)


def read_arguments(path: str | Path) -> tuple[dict[str, Any], str]:
    """Arguments of the body that :func:`write_body` wrote, and the hash that it must have.

    Raises
    ------
    SchemaError
        Where the file is missing, damaged, or no body of this version.
    """
    if not Path(path).is_file():
        raise SchemaError(f"{path} does not exist: correct the path, or make it with `rom body`")
    check_seal(path)
    try:
        with xr.open_dataset(path, engine="netcdf4", mask_and_scale=False) as opened:
            data = opened.load()
    except (OSError, ValueError, RuntimeError) as error:
        raise SchemaError(f"{path} is truncated or no netCDF file: delete it and make it again") from error
    if data.attrs.get("body_version") != BODY_VERSION:
        found = data.attrs.get("body_version", "none")
        raise SchemaError(f"{path} is no body of version {BODY_VERSION} (it says {found}): make it with `rom body`")
    try:
        return _arguments(data), data.attrs["content_hash"]
    except (KeyError, ValueError, IndexError) as error:
        raise SchemaError(f"{path} is damaged ({error}): make it again with `rom body`") from error


def _arguments(data: xr.Dataset) -> dict[str, Any]:
    n = data.sizes["dof"]

    def matrix(name: str) -> sp.csr_array | None:
        if f"{name}_value" not in data:
            return None
        parts = (data[f"{name}_{part}"].values for part in ("value", "column", "start"))
        return sp.csr_array(tuple(parts), shape=(n, n))

    regions: dict[str, Any] = {}
    while f"stiffness_{len(regions)}_value" in data:
        name = f"stiffness_{len(regions)}"
        regions[data[f"{name}_value"].attrs["region"]] = matrix(name)
    return {"stiffness": regions or matrix("stiffness"), "mass": matrix("mass"), "viscous": matrix("viscous"),
            "loss_stiffness": matrix("loss_stiffness"), "dof_names": _words(data["dof_name"].values),
            "grid": _grid(data), "name": data.attrs["title"], "doubts": tuple(json.loads(data.attrs["doubts"])),
            "origin": json.loads(data.attrs["origin"])}


def _rows(name: str, matrix: sp.csr_array, units: str, region: str) -> dict[str, tuple]:
    """Value, column and first entry of each row."""
    rows = sp.csr_array(matrix, copy=True)
    rows.sum_duplicates()
    words = name.rstrip("_0123456789").replace("_", " ") + (f" of region {region}" if region else "")
    return {f"{name}_value": (f"{name}_entry", rows.data, {
                "long_name": words, "units": units} | ({"region": region} if region else {})),
            f"{name}_column": (f"{name}_entry", rows.indices, {"long_name": f"columns, {words}", "units": "1"}),
            f"{name}_start": ("row_end", rows.indptr, {"long_name": f"first entry of each row, {words}", "units": "1"})}


def _grid_variables(grid: Grid) -> dict[str, tuple]:
    variables: dict[str, tuple] = {
        f"node_{axis}": ("node", grid.nodes[:, i], {"long_name": grid.axes[i], "units": "m"})
        for i, axis in enumerate("xyz"[:grid.nodes.shape[1]])}
    variables["free"] = ("dof", grid.free, {
        "long_name": "number of components x node + component of a degree of freedom", "units": "1"})
    if grid.names is not None:
        variables["node_name"] = ("node", _plain(grid.names), {"long_name": "label of a node"})
    for kind, cells in grid.cells.items():
        variables[f"cells_{kind}"] = (kind, f"{kind}_corner"), cells, {
            "long_name": f"nodes of a {kind}, in the order of VTK", "units": "1"}
        if kind in grid.region:
            variables[f"region_{kind}"] = (kind,), grid.region[kind], {"long_name": "index of the region", "units": "1"}
    for i, nodes in enumerate(grid.sets.values()):
        variables[f"set_{i}"] = (f"set_{i}_member",), nodes, {"long_name": "nodes of a named set", "units": "1"}
    return variables


def _grid(data: xr.Dataset) -> Grid | None:
    said = json.loads(data.attrs["grid"])
    if not said:
        return None
    kinds = [str(name).removeprefix("cells_") for name in data.data_vars if str(name).startswith("cells_")]
    return Grid(np.column_stack([data[f"node_{axis}"].values for axis in "xyz" if f"node_{axis}" in data]),
                data["free"].values, {kind: data[f"cells_{kind}"].values for kind in kinds}, tuple(said["components"]),
                {kind: data[f"region_{kind}"].values for kind in kinds if f"region_{kind}" in data},
                tuple(said["region_names"]), said["region_noun"],
                _words(data["node_name"].values) if "node_name" in data else None,
                {name: data[f"set_{i}"].values for i, name in enumerate(said["sets"])}, tuple(said["axes"]),
                said["noun"])


def _plain(labels: np.ndarray) -> np.ndarray:
    """Numbers as they are, words as netCDF takes them."""
    return labels if labels.dtype.kind in "iuf" else labels.astype(str).astype(object)


def _words(labels: np.ndarray) -> np.ndarray:
    return labels if labels.dtype.kind in "iuf" else labels.astype(str)
