"""Fields in the order of the labels that are asked for, whatever the order, units and parts in which they come.

xarray users reorder, select, merge, convert and store data with other tools. What carries labels is aligned by them
here; what is missing, doubled or another scene's is refused in one sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from rom.checks import shown
from rom.errors import SchemaError
from rom.scenes.complex_parts import decode_complex, join_parts
from rom.scenes.units import factor_to


def fields(data: xr.Dataset, name: str, labels: Mapping[str, Any], unit: str | None = None, source: str = "the answer"
           ) -> np.ndarray:
    """Values of a field in the order of the given labels, whatever the order in which it is stored.

    Labels that are not asked for are left out. A dimension without labels of its own is taken in its order if its size
    is right.

    Parameters
    ----------
    name : str
        A variable, its complex parts joined or not.
    labels : dict of (n,) array_like or None
        Wanted labels along each dimension, in the order of the dimensions wanted; None takes a dimension as it is.
        An answer without ``case`` is one case.
    unit : str, optional
        Other units are converted.
    source : str
        For messages.

    Returns
    -------
    ndarray
        A view where nothing had to be moved.

    Raises
    ------
    SchemaError
        For a missing variable or dimension, a missing or doubled label, or another unit.
    """
    if name not in data.variables:
        raise SchemaError(f"{source} lacks {name}: give one that holds it")
    variable = data.variables[name]
    if "part" in variable.dims:
        variable = join_parts(data[name]).variable
    if "case" in labels and "case" not in variable.dims:
        variable = variable.set_dims({"case": 1, **variable.sizes})
    _check_dims(variable, name, tuple(labels), source)
    for dim, wanted in labels.items():
        order = None if wanted is None else _order(data, dim, wanted, source)
        variable = variable if order is None else variable.isel({dim: order})
    if variable.dtype.kind not in "biufc":
        raise SchemaError(f"{name} of {source} is of type {variable.dtype}: give numbers")
    factor = 1.0 if unit is None else factor_to(unit, variable.attrs, f"{name} of {source}")
    values = variable.transpose(*labels).values
    return values if factor == 1.0 else values * factor


def in_order(data: xr.Dataset, labels: Mapping[str, Any], quantities: Mapping[str, tuple[tuple[str, ...], str]],
             source: str = "the dataset") -> xr.Dataset:
    """A dataset in the order of the given labels, whatever the order in which it is stored; itself where it is already.

    Parameters
    ----------
    labels : dict of (n,) array_like
        As in :func:`fields`; dimensions that the data do not have are passed over.
    quantities : dict of (dims, unit)
        Dimensions and unit that a variable gets; an empty unit is not looked at.

    Raises
    ------
    SchemaError
        As :func:`fields`.
    """
    data = decode_complex(data)
    orders = {dim: _order(data, dim, wanted, source) for dim, wanted in labels.items() if dim in data.dims}
    moved = {dim: order for dim, order in orders.items() if order is not None}
    data = data.isel(moved) if moved else data
    changed = {}
    for name, (dims, unit) in quantities.items():
        if name not in data.variables:
            continue
        variable = data.variables[name]
        _check_dims(variable, name, dims, source)
        factor = factor_to(unit, variable.attrs, f"{name} of {source}") if unit else 1.0
        if variable.dims != dims or factor != 1.0:
            changed[name] = (dims, variable.transpose(*dims).data * factor, {**variable.attrs, "units": unit})
    return data.assign(changed) if changed else data


def _check_dims(variable: xr.Variable, name: str, dims: tuple[str, ...], source: str) -> None:
    if set(variable.dims) != set(dims):
        raise SchemaError(f"{name} of {source} has the dimensions {', '.join(map(str, variable.dims)) or 'of a number'}"
                          f": give it along {', '.join(dims)}")


def _order(data: xr.Dataset, dim: str, wanted: Any, source: str) -> np.ndarray | None:
    """Places of the wanted labels along a dimension; None where they stand in this order."""
    wanted = np.asarray(wanted)
    if dim in data.variables:
        return positions(np.atleast_1d(data.variables[dim].values), wanted, dim, source)
    if data.sizes[dim] != len(wanted):
        raise SchemaError(f"{source} has {data.sizes[dim]} places along {dim} without labels, where {len(wanted)} are "
                          f"asked for: give it the coordinate {dim!r}")
    return None


def positions(labels: np.ndarray, wanted: np.ndarray, dim: str, source: str = "the data") -> np.ndarray | None:
    """Where each of the ``wanted`` labels stands among ``labels``; None where they are the same.

    Raises
    ------
    SchemaError
        For a missing label, and for one that stands twice.
    """
    given, sought = _plain(labels), _plain(wanted)
    if given == sought:
        return None
    place = {label: i for i, label in enumerate(given)}
    if len(place) < len(given):
        twice = next(label for i, label in enumerate(given) if place[label] != i)
        raise SchemaError(f"{source} has {dim} {shown(twice)} twice: give each label once")
    missing = [label for label in sought if label not in place]
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise SchemaError(f"{source} lacks {dim} {shown(missing[0])}{more}: give every label once")
    return np.array([place[label] for label in sought], dtype=np.int64)


def _plain(labels: np.ndarray) -> list:
    """Labels as Python's own values, among which 3 equals 3.0; texts of netCDF's characters as words."""
    if labels.dtype.kind == "S":
        labels = np.char.decode(labels, "utf-8", "replace")
    return [label.decode("utf-8", "replace") if isinstance(label, bytes) else label for label in labels.tolist()]
