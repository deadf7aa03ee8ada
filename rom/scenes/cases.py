"""The inputs of a block of cases: as plain arrays, and the checks that turn labelled ones into them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from rom.checks import shown

LARGEST = {"Hz": 1e9, "1": 1e6, "rad": 1e9, "N": 1e100}
"""Magnitudes up to which answers and their squares stay within the range of double precision, by unit."""
SMALLEST_FORCE = 1e-100
"""Below this a force's squares vanish to zero [N]."""
LARGEST_NODE = 2**53
NO_FORCE, NO_WORD = -1, "none"
"""Stand in the variables that name a load where a case has fewer forces than the dataset has room for."""


@dataclass(frozen=True, eq=False, slots=True)
class CaseArrays:
    """The inputs of a block of cases as plain arrays: what the lean calls take.

    Parameters
    ----------
    node : (n_case, n_force) ndarray of int
        Column of the load in the scene's ``unit_loads`` (not a mesh node id); any column where the force is zero.
    force : (n_case, n_force) ndarray [N]
        What the unit load is multiplied by; complex where forces have phases.
    frequency : (n_case,) ndarray [Hz] or None
    loss_factor : (n_case,) ndarray or None
    """

    node: np.ndarray
    force: np.ndarray
    frequency: np.ndarray = None  # type: ignore[assignment]  # static scenes have none and never read it
    loss_factor: np.ndarray = None  # type: ignore[assignment]

    def __len__(self) -> int:
        """Number of cases."""
        return len(self.node)

    def __iter__(self) -> Iterator[np.ndarray]:
        """The four fields, in order."""
        return iter((self.node, self.force, self.frequency, self.loss_factor))

    def take(self, index) -> CaseArrays:
        """The cases at ``index`` (slice, mask or integers)."""
        return CaseArrays(*(a if a is None else a[index] for a in self))

    def joined(self, other: CaseArrays) -> CaseArrays:
        """These cases, then the others, padded to the same number of forces."""
        width = max(self.node.shape[1], other.node.shape[1])
        pairs = zip(self, other, strict=True)
        return CaseArrays(*(a if a is None or b is None else np.concatenate([_padded(a, width), _padded(b, width)])
                            for a, b in pairs))


def _padded(values: np.ndarray, width: int) -> np.ndarray:
    return values if values.ndim == 1 else np.pad(values, ((0, 0), (0, width - values.shape[1])))


def check_shapes(cases: xr.Dataset, scene: str, loads: tuple[str, ...], points: tuple[str, ...],
                 defaults: Mapping[str, Any]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Values of labelled cases, complete and of one shape; what they are worth is not looked at.

    Parameters
    ----------
    cases : xr.Dataset
    scene : str
        Its name, for messages.
    loads, points : tuple of str
        Variables along (case, force), and along case.
    defaults : mapping
        Values for variables that may be left out.

    Returns
    -------
    loads : dict of (n_case, n_force) ndarray
    points : dict of (n_case,) ndarray

    Raises
    ------
    ValueError
        For a missing variable, a wrong dimension, shapes that differ, or no case at all.
    """
    if not isinstance(cases, xr.Dataset):
        raise ValueError(f"cases of {scene} are of type {type(cases).__name__}: give an xarray.Dataset")
    wanted = [*loads, *points]
    for name in wanted:
        if name not in cases and name not in defaults:
            raise ValueError(f"cases of {scene} lack the variable {name!r}: give all of {', '.join(wanted)}")
    for name in wanted:
        if name not in cases:
            continue
        extra = set(cases[name].dims) - {"case"}
        if "case" not in cases[name].dims or len(extra) > (name in loads):
            shape = "('case',) or ('case', 'force')" if name in loads else "('case',)"
            raise ValueError(f"{name} has the dimensions {cases[name].dims}: batch it along {shape}")
    if any(name in cases and not cases[name].size for name in wanted):
        raise ValueError(f"the batch of {scene} holds no case: give at least one")
    first = loads[0]
    found = {}
    for name in loads:
        if name in cases:
            values = cases[name].transpose("case", ...).values
            found[name] = values[:, None] if values.ndim == 1 else values
        else:
            found[name] = np.full(found[first].shape, defaults[name])
        if found[name].shape != found[first].shape:
            raise ValueError(f"{first} has shape {found[first].shape} and {name} {found[name].shape}: each force needs "
                             f"one value of {' and '.join(loads)}")
    n_case = cases.sizes["case"]
    return found, {name: cases[name].values if name in cases else np.full(n_case, defaults[name]) for name in points}


def finite(values: np.ndarray, name: str, unit: str) -> np.ndarray:
    """``values`` as real floating-point numbers.

    Raises
    ------
    ValueError
        For other kinds, NaN and infinity, and magnitudes beyond :data:`LARGEST` or below :data:`SMALLEST_FORCE`.
    """
    if values.dtype.kind not in "iuf":
        raise ValueError(f"{name} is of type {values.dtype}: every value must be a real number of {unit}")
    values = values.astype(float)
    if not np.isfinite(values).all():
        bad = values[~np.isfinite(values)].ravel()[0]
        raise ValueError(f"{name} holds {bad}: every value must be a finite number of {unit}; mend or drop the case")
    size = np.abs(values)
    wrong = size > LARGEST[unit]
    if unit == "N":
        wrong |= (size > 0) & (size < SMALLEST_FORCE)
    if wrong.any():
        least = f"zero, or from {SMALLEST_FORCE:g}" if unit == "N" else "zero"
        raise ValueError(f"{name} holds {values[wrong].ravel()[0]:g}: its magnitude must be {least} to "
                         f"{LARGEST[unit]:g}, as squares leave the range of double precision beyond; give another unit "
                         "or drop the case")
    return values


def positions_of(values: np.ndarray, allowed: np.ndarray, name: str) -> np.ndarray:
    """Positions of labels in ``allowed``, NO_FORCE where no force acts.

    Parameters
    ----------
    values : ndarray
        Numbers (whole ones in a floating-point array will do) or words; words may be given by their positions.
    allowed : (n,) ndarray
        Numbers or words, each once.
    name : str
        Of the variable, for messages.

    Raises
    ------
    ValueError
        For a value that is no whole number or no word, or one that is not allowed.
    """
    values = np.asarray(values)
    words = allowed.dtype.kind in "UO"
    kind = values.dtype.kind
    if words and kind in "UOS":
        values = values.astype(str)
        absent = np.isin(values, ["", NO_WORD])
        known = allowed.astype(str)
    else:
        if kind not in "iuf" or (kind == "f" and (not np.isfinite(values).all() or (values != np.round(values)).any())):
            raise ValueError(f"{name} holds a value that is no whole number: give {_listed(allowed)}")
        if (np.abs(values.astype(float)) > LARGEST_NODE).any():
            raise ValueError(f"{name} holds a value beyond {LARGEST_NODE}: give {_listed(allowed)}")
        values = values.astype(np.int64)
        absent = values == NO_FORCE
        known = np.arange(len(allowed)) if words else allowed
    order = np.argsort(known, kind="stable")
    rows = order[np.minimum(np.searchsorted(known, values, sorter=order), len(known) - 1)]
    wrong = (known[rows] != values) & ~absent
    if wrong.any():
        raise ValueError(f"{name} {shown(values[wrong][0].item())} cannot carry load: choose among {_listed(allowed)}")
    return np.where(absent, NO_FORCE, rows)


def _listed(allowed: np.ndarray) -> str:
    some = ", ".join(map(str, allowed[:6].tolist()))
    return f"the {len(allowed)} of this scene's loads, {some}{' ...' if len(allowed) > 6 else ''}"
