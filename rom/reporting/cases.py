"""What varies from case to case: inputs to draw errors over, and cases in words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from rom.reporting import words
from rom.reporting.results import Results

FEW = 8
"""An input with so many values or fewer is drawn value by value."""
CATEGORIES = 12
"""Words with more values than that are names of things, not an input to draw errors over."""


class Input(NamedTuple):
    """Something that varies from case to case."""

    name: str
    title: str
    values: np.ndarray

    @property
    def few(self) -> bool:
        """Whether it takes a few values only, or none that can be put on an axis."""
        return self.values.dtype.kind not in "iuf" or len(np.unique(self.values)) <= FEW


def inputs_of(found: Results) -> list[Input]:
    """What varies from case to case: quantities, a few categories, and how many of several things a case has."""
    some = []
    for name, one in _of_cases(found).items():
        unit, title = one.attrs.get("units", ""), str(one.attrs.get("long_name", name.replace("_", " ")))
        lists = one.values
        if one.ndim == 2 and one.dtype.kind != "f" and one.shape[1] > 1:
            some.append(Input(name, f"number of {one.dims[1]}s", _present(lists).sum(axis=1)))
        elif (one.ndim == 1) if one.dtype.kind == "f" else len(np.unique(lists)) <= CATEGORIES:
            some.append(Input(name, f"{title} [{unit}]" if unit not in ("", "1") else title, lists.ravel()))
    return [one for one in some if len(np.unique(one.values)) > 1]


def _of_cases(found: Results) -> dict[str, xr.DataArray]:
    """What describes a case; whole numbers count rows or parts of a split and do not."""
    return {str(name): found.data[name].transpose("case", ...) for name, one in found.data.variables.items()
            if "case" in one.dims and "entry" not in one.dims and not (one.ndim == 1 and one.dtype.kind in "iub")}


def worst_case(found: Results, entry: int) -> int | None:
    """Position along ``case`` of an entry's worst case on the first split; None where that is not stored."""
    if not {"worst_case", "case"} <= set(map(str, found.data.variables)):
        return None
    return next(iter(np.flatnonzero(
        found.data["case"].values == found.by_split("worst_case", found.splits[0])[entry]).tolist()), None)


def case_words(found: Results, entry: int) -> str:
    """The inputs of an entry's worst case on the first split; empty where that is not stored."""
    case, parts = worst_case(found, entry), []
    for name, one in _of_cases(found).items() if case is not None else ():
        value = one.isel(case=case)
        if one.ndim == 2 and one.dtype.kind != "f":
            listed = words.listed([str(one) for one in value.values[_present(value.values)]])
            parts.append(f"{name.replace('_', ' ')} {listed}")
        elif one.ndim == 1 and one.dtype.kind == "f":
            parts.append(f"{name.replace('_', ' ')} {words.measure(float(value), one.attrs.get('units', ''))}")
        elif one.ndim == 1:
            parts.append(str(value.values))
    return ", ".join(parts)


def _present(values: np.ndarray) -> np.ndarray:
    """Which entries of lists of names hold one: no negative number, no empty word."""
    return values >= 0 if values.dtype.kind in "iu" else values.astype(str) != ""
