"""netCDF files, written whole and sealed, and refused by name when they are damaged or not ours."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from rom.checks import shown
from rom.datasets.schema import check_schema
from rom.errors import SchemaError
from rom.files import check_seal, seal, whole_file
from rom.scenes.complex_parts import PART, decode_complex, encode_complex, to_parts

CHECKED_AT_ONCE = 1e9
"""Bytes of a file up to which its seal is checked when it is opened; in a larger one each chunk has a checksum of its
own, which is checked when the chunk is read."""
MOST_COMPRESSION = 1100
"""Above what deflate can reach [RFC 1951], so that a small file that claims to hold more was not written by anyone."""


def write_netcdf(data: xr.Dataset, path: str | Path, compress: bool = False) -> None:
    """Write a dataset, complex variables as parts, atomically and sealed.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    encoded = encode_complex(data)
    encoding = {name: {"zlib": True, "complevel": 4, "shuffle": True} for name in encoded.data_vars
                if compress and encoded[name].size > 1000}
    with whole_file(path) as temporary, _failing_as_os_error(path):
        encoded.to_netcdf(temporary, engine="netcdf4", encoding=encoding)
        seal(temporary)


def write_in_blocks(frame: xr.Dataset, path: str | Path, name: str, dims: tuple[str, ...], dtype: np.dtype,
                    attributes: dict[str, str], blocks: Iterable[tuple[np.ndarray, np.ndarray]],
                    compress: bool = False) -> None:
    """Write a dataset atomically whose variable ``name`` is too big for memory and comes block by block.

    Parameters
    ----------
    frame : xr.Dataset
        Everything else.
    dims : tuple of str
        Of the variable, the blocks' first; a complex one gets ``part`` on disk.
    blocks : iterable of (index, values)
        Positions (k,) along the first dimension, and (k, ...) values.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    parts = np.issubdtype(dtype, np.complexfloating)
    if parts:
        dims = (*dims, "part")
        frame = frame.assign_coords(part=PART)
    with whole_file(path) as temporary, _failing_as_os_error(path):
        frame.to_netcdf(temporary, engine="netcdf4")
        with netCDF4.Dataset(temporary, "a") as file:
            sizes = [file.dimensions[dim].size for dim in dims]
            kind = np.empty(0, dtype).real.dtype
            variable = file.createVariable(name, kind, dims, zlib=compress, chunksizes=[1, *sizes[1:]],
                                           fletcher32=float(np.prod(sizes)) * kind.itemsize > CHECKED_AT_ONCE)
            variable.setncatts(attributes)
            for index, values in blocks:
                values = to_parts(values) if parts else values
                for run in np.split(np.arange(len(index)), np.flatnonzero(np.diff(index) != 1) + 1):
                    variable[int(index[run[0]]):int(index[run[-1]]) + 1] = values[run[0]:run[-1] + 1]
        seal(temporary)


@contextmanager
def _failing_as_os_error(path: str | Path) -> Iterator[None]:
    try:
        yield
    except RuntimeError as error:  # how netCDF4 words a failed write
        raise OSError(f"{path} could not be written ({error}): check the disk's free space") from error


def write_dataset(data: xr.Dataset, path: str | Path, compress: bool = False) -> None:
    """Write a dataset of the schema atomically; see :func:`write_netcdf`."""
    check_schema(data, str(path))
    write_netcdf(data, path, compress)


@contextmanager
def reading(path: str | Path) -> Iterator[None]:
    """Whatever the libraries below raise of a damaged file, said as a SchemaError in one sentence."""
    try:
        yield
    except SchemaError as error:
        if str(path) in str(error):
            raise
        raise SchemaError(f"{path}: {error}") from error
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SchemaError(f"{path} is damaged ({shown(reason)[1:-1]}): delete it and make it again") from error


def open_netcdf(path: str | Path, checked: float = CHECKED_AT_ONCE) -> xr.Dataset:
    """Open a netCDF file lazily, parts undecoded.

    Parameters
    ----------
    checked : float
        Size [byte] up to which the seal is checked.

    Raises
    ------
    SchemaError
        Where the file is missing, damaged or no netCDF file.
    """
    try:
        there = Path(path).is_file()
    except ValueError:  # a null character
        there = False
    if not there:
        raise SchemaError(f"{path} does not exist: make it with `rom dataset`, or correct the path")
    try:
        check_seal(path, checked)
        data = xr.open_dataset(path, engine="netcdf4")
        for name, variable in list(data.variables.items()):
            if name not in data.xindexes:
                lazy = indexing.LazilyIndexedArray(_Read(variable, path))
                data[name] = xr.Variable(variable.dims, lazy, variable.attrs, variable.encoding)
        return data
    except SchemaError:
        raise
    except Exception as error:  # HDF5's and netCDF's words for a damaged file are of every kind
        raise SchemaError(f"{path} is truncated or no netCDF file: delete it and make it again") from error


class _Read(BackendArray):
    """A variable on disk whose damage is named when it is read, however late that is."""

    def __init__(self, variable: xr.Variable, path: str | Path) -> None:
        self.variable, self.path = variable, path
        self.shape, self.dtype = variable.shape, variable.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._values)

    def _values(self, key: tuple) -> np.ndarray:
        with reading(self.path):
            return self.variable[key].values


def read_netcdf(path: str | Path) -> xr.Dataset:
    """Read a netCDF file into memory, parts joined to complex numbers; raises as :func:`open_netcdf`."""
    with open_netcdf(path, np.inf) as data:
        return loaded(data, path)


def loaded(data: xr.Dataset, path: str | Path) -> xr.Dataset:
    """Cases of an opened file in memory, parts joined to complex numbers.

    Raises
    ------
    SchemaError
        Where the file is damaged, or claims to hold more than a file of its size can.
    """
    size = os.path.getsize(path)
    if data.nbytes > 1e8 + MOST_COMPRESSION * size:
        raise SchemaError(f"{path} claims to hold {data.nbytes / 1e9:.1f} GB in {size / 1e6:.1f} MB, more than "
                          "compression can do: delete it and make it again")
    with reading(path):
        return decode_complex(data.load())
