"""What a fitted metamodel keeps in a file, declared once: which attributes, with which dimensions, units and words.

Examples
--------
A method of one's own, the mean of its training answers, with what its file holds:

>>> import rom
>>> class MeanAnswer(rom.Metamodel):
...     name, summary, learns = "mean-answer", "the mean of the training answers", True
...     stored = (rom.Stored("mean", ("dof",), "mean displacement", "m"),)
...
...     def _fit(self, train):
...         self.mean = self.scene.values(train).mean(axis=0)
...
...     def _evaluate(self, cases, outputs, out):
...         return np.tile(self.mean, (len(cases), 1))
"""

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
    part : type, optional
        Class of an object that the model has, which declares itself what is stored of it.
    """

    attribute: str
    dims: tuple[str, ...] = ()
    long_name: str = ""
    units: str = "1"
    part: Any = None


def to_dataset(model: Any, declared: Iterable[Stored], prefix: str = "") -> xr.Dataset:
    """The declared attributes of a model as variables; numbers and text as attributes of the dataset.

    Those of its parts stand under the parts' names, as ``prefix`` says.
    """
    data = xr.Dataset()
    attributes: dict[str, Any] = {}
    for entry in declared:
        name = prefix + entry.attribute.lstrip("_")
        value = getattr(model, entry.attribute)
        if entry.part is not None:
            part = to_dataset(value, entry.part.stored, name + SEPARATOR)
            data, attributes = data.assign(part.variables), {**attributes, **part.attrs}
            continue
        if isinstance(value, str | float | int):
            attributes[name] = value
            continue
        for key, array in flattened(name, value.field if isinstance(value, Basis) else value).items():
            dims = entry.dims or tuple(f"{key}_{axis}" for axis in range(array.ndim))
            words = {"long_name": entry.long_name, "units": entry.units} if entry.long_name else {}
            data[key] = (dims, array, words)
    return data.assign_attrs(attributes, **{ARRAYS: " ".join(map(str, data.data_vars))})


def from_dataset(model: Any, declared: Iterable[Stored], data: xr.Dataset, prefix: str = "") -> None:
    """Give a model the attributes that :func:`to_dataset` wrote; KeyError where one is missing.

    What is a `Basis` in the class's annotations becomes one; nested arrays become dicts with the same keys.
    """
    for lost in sorted(set(str(data.attrs.get(ARRAYS, "")).split()) - set(data.data_vars)):
        raise KeyError(lost)
    for entry in declared:
        name = prefix + entry.attribute.lstrip("_")
        if entry.part is not None:
            value: Any = entry.part.__new__(entry.part)
            from_dataset(value, entry.part.stored, data, name + SEPARATOR)
        elif name in data.attrs:
            value = data.attrs[name]
        elif name in data:
            value = data[name].transpose(*(entry.dims or sorted(data[name].dims))).values
            if _annotation(model, entry.attribute) == "Basis":
                value = Basis(value, model.scene.part_rows, model.settings["precision"])
        else:
            value = nested({str(key)[len(name) + 1:]:
                            data[key].transpose(*(entry.dims or sorted(data[key].dims))).values
                            for key in data.data_vars
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
