"""What a fitted metamodel keeps in a file, declared once: which attributes, with which dimensions, units and words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from rom.metamodels.basis import Basis

ARRAYS = "arrays"
"""Attribute of a file that names its variables, so that one that was lost is missed."""
SEPARATOR = "."
"""Between the keys of nested arrays, in names of variables."""


class Stored(NamedTuple):
    """An attribute of a fitted metamodel that its file holds.

    Parameters
    ----------
    attribute : str
        An array, a `Basis`, a number or text, or dicts of these, as deep as they like.
    dims : tuple of str
        Of an array or the fields of a basis; default: dimensions of its own.
    long_name, units : str
    """

    attribute: str
    dims: tuple[str, ...] = ()
    long_name: str = ""
    units: str = "1"


def to_dataset(model: Any, declared: Iterable[Stored]) -> xr.Dataset:
    """The declared attributes of a model as variables; numbers and text as attributes of the dataset."""
    data, attributes = xr.Dataset(), {}
    for entry in declared:
        name = entry.attribute.lstrip("_")
        value = getattr(model, entry.attribute)
        if isinstance(value, str | float | int):
            attributes[name] = value
            continue
        for key, array in flattened(name, value.field if isinstance(value, Basis) else value).items():
            dims = entry.dims or tuple(f"{key}_{axis}" for axis in range(array.ndim))
            words = {"long_name": entry.long_name, "units": entry.units} if entry.long_name else {}
            data[key] = (dims, array, words)
    return data.assign_attrs(attributes, **{ARRAYS: " ".join(map(str, data.data_vars))})


def from_dataset(model: Any, declared: Iterable[Stored], data: xr.Dataset) -> None:
    """Give a model the attributes that :func:`to_dataset` wrote; KeyError where one is missing.

    What is a `Basis` in the class's annotations becomes one; nested arrays become dicts with the same keys.
    """
    for lost in sorted(set(str(data.attrs.get(ARRAYS, "")).split()) - set(data.data_vars)):
        raise KeyError(lost)
    for entry in declared:
        name = entry.attribute.lstrip("_")
        if name in data.attrs:
            value: Any = data.attrs[name]
        elif name in data:
            value = data[name].values
            if _annotation(model, entry.attribute) == "Basis":
                value = Basis(value, model.scene.part_rows, model.settings["precision"])
        else:
            value = nested({str(key)[len(name) + 1:]: data[key].values for key in data.data_vars
                            if str(key).startswith(name + SEPARATOR)})
            if not value:
                raise KeyError(name)
        setattr(model, entry.attribute, value)


def _annotation(model: Any, attribute: str) -> str:
    return next((str(kind.__annotations__[attribute]) for kind in type(model).__mro__
                 if attribute in getattr(kind, "__annotations__", {})), "")


def flattened(name: str, value: Any) -> dict[str, np.ndarray]:
    """Arrays of nested dicts, each under its keys one after another."""
    if isinstance(value, dict):
        return {key: array for part, inner in value.items()
                for key, array in flattened(f"{name}{SEPARATOR}{part}", inner).items()}
    return {name: np.asarray(value)}


def nested(arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """The inverse of :func:`flattened`, less its first key."""
    tree: dict[str, Any] = {}
    for key, array in arrays.items():
        *folders, last = key.split(SEPARATOR)
        here = tree
        for folder in folders:
            here = here.setdefault(folder, {})
        here[last] = array
    return tree
