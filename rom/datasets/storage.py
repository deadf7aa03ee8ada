"""Files that appear whole or not at all, and are refused by name when they are not ours."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr

from rom.datasets.schema import check_schema
from rom.errors import SchemaError
from rom.scenes.complex_parts import PART, decode_complex, encode_complex, to_parts

MOST_BYTES = 16e9
"""Of fields put together from a reduced file at once."""
STORAGE = "poles and shapes"
"""Attribute ``storage`` of a file that holds no fields, see :mod:`rom.datasets.reduced`."""


def is_reduced(data: xr.Dataset) -> bool:
    """Whether an opened file holds poles and shapes instead of fields."""
    return data.attrs.get("storage") == STORAGE


def remove_leftovers(path: str | Path) -> None:
    """Remove what killed processes left of ``path`` under temporary names; a living one's file stays."""
    path = Path(path)
    for partial in path.parent.glob(f".{glob.escape(path.name)}.*.partial"):
        number = partial.name.removesuffix(".partial").rpartition(".")[2]
        if number.isdecimal() and not _alive(int(number)):
            partial.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    if os.name == "nt":  # where signal 0 would end it
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # someone else's
        return True
    return True


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary name beside ``path``; rename it to ``path`` on success, remove it on failure.

    Raises
    ------
    OSError
        Where the folder cannot be written or the disk is full.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        yield temporary
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_netcdf(data: xr.Dataset, path: str | Path, compress: bool = False) -> None:
    """Write a dataset, complex variables as parts, atomically."""
    encoded = encode_complex(data)
    encoding = {name: {"zlib": True, "complevel": 4, "shuffle": True} for name in encoded.data_vars
                if compress and encoded[name].size > 1000}
    with whole_file(path) as temporary:
        try:
            encoded.to_netcdf(temporary, engine="netcdf4", encoding=encoding)
        except RuntimeError as error:  # how netCDF4 words a failed write
            raise OSError(f"{path} could not be written ({error}): check the disk's free space") from error


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
    with whole_file(path) as temporary:
        try:
            frame.to_netcdf(temporary, engine="netcdf4")
            with netCDF4.Dataset(temporary, "a") as file:
                chunks = [1, *(file.dimensions[dim].size for dim in dims[1:])]
                kind = np.empty(0, dtype).real.dtype
                variable = file.createVariable(name, kind, dims, zlib=compress, chunksizes=chunks)
                variable.setncatts(attributes)
                for index, values in blocks:
                    values = to_parts(values) if parts else values
                    for run in np.split(np.arange(len(index)), np.flatnonzero(np.diff(index) != 1) + 1):
                        variable[int(index[run[0]]):int(index[run[-1]]) + 1] = values[run[0]:run[-1] + 1]
        except RuntimeError as error:  # how netCDF4 words a failed write
            raise OSError(f"{path} could not be written ({error}): check the disk's free space") from error


def write_dataset(data: xr.Dataset, path: str | Path, compress: bool = False) -> None:
    """Write a dataset of the schema atomically; see :func:`write_netcdf`."""
    check_schema(data, str(path))
    write_netcdf(data, path, compress)


def open_netcdf(path: str | Path) -> xr.Dataset:
    """Open a netCDF file lazily, parts undecoded.

    Raises
    ------
    SchemaError
        Where the file is missing, truncated or no netCDF file.
    """
    if not Path(path).is_file():
        raise SchemaError(f"{path} does not exist: make it with `rom dataset`, or correct the path")
    try:
        return xr.open_dataset(path, engine="netcdf4")
    except (OSError, ValueError, RuntimeError) as error:
        raise SchemaError(f"{path} is truncated or no netCDF file: delete it and make it again") from error


def read_netcdf(path: str | Path) -> xr.Dataset:
    """Read a netCDF file into memory, parts joined to complex numbers."""
    with open_netcdf(path) as data:
        try:
            return decode_complex(data.load())
        except (OSError, RuntimeError) as error:
            raise SchemaError(f"{path} is damaged: delete it and make it again") from error


def read_dataset(path: str | Path, cases=None) -> xr.Dataset:
    """Read a dataset of the schema, stored whole or reduced, or only the cases selected by integers, a slice or a mask.

    Raises
    ------
    SchemaError
        Where the file is missing, truncated, foreign or of another schema version.
    ValueError
        Where a reduced file would fill more than :data:`MOST_BYTES` of memory.
    """
    with open_netcdf(path) as data:
        if is_reduced(data):
            data.close()  # one handle at a time
            return _read_reduced(path, cases)
        check_schema(data, str(path))
        try:
            return decode_complex((data if cases is None else data.isel(case=cases)).load())
        except (OSError, RuntimeError) as error:
            raise SchemaError(f"{path} is damaged: delete it and make it again") from error


def _read_reduced(path: str | Path, cases) -> xr.Dataset:
    from rom.datasets.reduced import open_dataset

    with open_dataset(path, chunks=None) as data:
        wanted = data if cases is None else data.isel(case=cases)
        size = wanted["displacement"].nbytes
        if size > MOST_BYTES:
            raise ValueError(f"{wanted.sizes['case']} cases of {path} fill {size / 1e9:.0f} GB: name fewer, or take "
                             "rom.datasets.open_dataset, which reads what is asked for")
        try:
            return wanted.load()
        except (OSError, RuntimeError) as error:
            raise SchemaError(f"{path} is damaged: delete it and make it again") from error
