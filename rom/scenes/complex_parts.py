"""Complex numbers on disk: an extra dimension ``part`` with the labels real and imag, joined again by those labels.

Plain netCDF tools know no complex numbers. Both directions are here and nowhere else.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from rom.checks import shown
from rom.errors import SchemaError

PARTS = ["real", "imag"]
PART = xr.Variable("part", PARTS, {"long_name": "part of a complex number"})


def to_parts(values: np.ndarray) -> np.ndarray:
    """(..., 2) ndarray of real and imaginary parts; a view where the memory allows it."""
    values = np.ascontiguousarray(values).reshape(np.shape(values))  # which makes a scalar one long
    return values[..., None].view(values.real.dtype)


def from_parts(values: np.ndarray) -> np.ndarray:
    """The complex array that :func:`to_parts` took apart."""
    values = np.ascontiguousarray(values, np.result_type(values.dtype, np.float32))
    return values.view(np.result_type(values.dtype, np.complex64))[..., 0]


def encode_complex(data: xr.Dataset) -> xr.Dataset:
    """Replace every complex variable and coordinate by real ones with the trailing dimension ``part``.

    Raises
    ------
    ValueError
        For a complex coordinate that names the places along its own dimension: files know no such labels.
    """
    complex_ones = {name: variable for name, variable in data.variables.items() if variable.dtype.kind == "c"}
    if not complex_ones:
        return data.copy()
    labels = [name for name in complex_ones if name in data.dims]
    if labels:
        raise ValueError(f"the coordinate {labels[0]!r} is complex and labels its own dimension, which no netCDF file "
                         "can hold: store it as another variable along that dimension")
    encoded = {name: ((*variable.dims, "part"), to_parts(variable.values), variable.attrs)
               for name, variable in complex_ones.items()}
    return data.assign({name: value for name, value in encoded.items() if name in data.data_vars}).assign_coords(
        {"part": PART, **{name: value for name, value in encoded.items() if name in data.coords}})


def decode_complex(data: xr.Dataset) -> xr.Dataset:
    """The inverse of :func:`encode_complex`, whatever the order of the parts; dask arrays stay lazy.

    Raises
    ------
    SchemaError
        Where the labels of ``part`` are not real and imag, each once.
    """
    if "part" not in data.dims:
        return data
    joined = {name: join_parts(data[name]).variable for name, variable in data.variables.items()
              if "part" in variable.dims and name != "part"}
    return data.drop_vars(["part", *joined], errors="ignore").assign(
        {name: value for name, value in joined.items() if name in data.data_vars}).assign_coords(
        {name: value for name, value in joined.items() if name in data.coords})


def join_parts(array: xr.DataArray) -> xr.DataArray:
    """One variable with the dimension ``part`` as complex numbers; raises as :func:`decode_complex`."""
    labels = array["part"].values.tolist() if "part" in array.coords else []
    if sorted(map(str, labels)) != sorted(PARTS):
        raise SchemaError(f"{array.name} has the parts {shown(labels)} of complex numbers: label them 'real' and "
                          "'imag', each once")
    if array.dtype.kind not in "iuf":
        raise SchemaError(f"{array.name} is of type {array.dtype}: parts of complex numbers are real numbers")
    ordered = array.transpose(..., "part").sel(part=PARTS)
    if ordered.chunks is None:
        return ordered.isel(part=0, drop=True).copy(data=from_parts(ordered.values))
    return (ordered.isel(part=0, drop=True) + 1j * ordered.isel(part=1, drop=True)).assign_attrs(array.attrs)
