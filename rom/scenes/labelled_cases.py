"""Inputs of labelled cases, read into arrays of one shape: by name, unit and fill value, in whatever order they come.

What is missing, misspelt, of another unit or another scene's is refused in one sentence.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from rom.checks import shown
from rom.scenes.cases import NO_FORCE, NO_WORD
from rom.scenes.units import factor_to

BESIDE = ("residual", "solve_seconds", "split_published", "split_hard", "hard_region", "error_estimate", "error_kind",
          "validity", "answered_by", "energy_error_bound", "relative_energy_error_bound")
"""What datasets and answers hold beside inputs, along cases."""
LARGEST_LABEL = 2**53
"""Up to here every whole number is a floating-point number too."""
FILLS = ("_FillValue", "missing_value", "missing_force")
"""Attributes that name a value which stands for none, where the reader of a file has not replaced it."""


def check_cases(data: Any, scene: str, required: Sequence[str], optional: Sequence[str] = ()) -> None:
    """Refuse what are no cases of a scene, before any value is looked at.

    Parameters
    ----------
    data : xr.Dataset
    scene : str
        Its name, for messages.
    required, optional : sequence of str
        Its inputs.

    Raises
    ------
    ValueError
        For another type, a missing input, a variable that may be a misspelt one, or no case at all.
    """
    if not isinstance(data, xr.Dataset):
        raise ValueError(f"cases of {scene} are of type {type(data).__name__}: give an xarray.Dataset")
    wanted = [*required, *optional]
    expected = {*wanted, *BESIDE}
    unknown = [str(name) for name, array in data.data_vars.items()
               if name not in expected and set(array.dims) <= {"case", "force"}]
    absent = [name for name in wanted if name not in data.variables]
    for name in absent:
        near = difflib.get_close_matches(name.lower(), [other.lower() for other in unknown], 1, 0.75)
        if near:
            meant = next(other for other in unknown if other.lower() == near[0])
            raise ValueError(f"cases of {scene} hold {shown(meant)}, which the scene does not know: did you mean "
                             f"{name!r}?")
        if name in required:
            raise ValueError(f"cases of {scene} lack the variable {name!r}: give all of {', '.join(required)}")
    if absent and unknown:
        raise ValueError(f"cases of {scene} hold {shown(unknown[0])}, which the scene does not know, and no "
                         f"{', '.join(absent)}: rename it if it is meant so, else drop it or make it a coordinate")
    if any(not data.variables[name].size for name in wanted if name in data.variables):
        raise ValueError(f"the batch of {scene} holds no case: give at least one")


def numbers(data: xr.Dataset, name: str, dims: tuple[str, ...], unit: str, default: float | None = None) -> np.ndarray:
    """Values of a numeric input, in its unit; NaN where there is none.

    Parameters
    ----------
    dims : tuple of str
        ``("case",)`` or ``("case", "force")``; a variable without ``case`` holds for every case.
    unit : str
        Other units are converted; see :func:`rom.scenes.units.factor_to`.
    default : float, optional
        Where the variable is left out.

    Returns
    -------
    (n_case,) or (n_case, n_force) ndarray of float

    Raises
    ------
    ValueError
        For other dimensions, types or units.
    """
    if name not in data.variables and default is not None:
        return np.full(_shape(data, dims), float(default))
    values, attributes = _values(data, name, dims)
    if values.dtype.kind not in "iuf":
        raise ValueError(f"{name} is of type {values.dtype}: every value must be a real number of {unit}")
    missing = _missing(values, attributes)
    with np.errstate(over="ignore"):  # infinity is for the caller to refuse
        return np.where(missing, np.nan, values.astype(float) * factor_to(unit, attributes, name))


def categories(data: xr.Dataset, name: str, dims: tuple[str, ...], words: Sequence[str]) -> np.ndarray:
    """Positions among ``words`` of an input that holds words, or numbers that stand for them.

    Numbers are read by the variable's own ``flag_values`` and ``flag_meanings`` (CF conventions, section 3.5), or else
    are positions already.

    Returns
    -------
    (n_case,) or (n_case, n_force) ndarray of int
        :data:`NO_FORCE` where there is none.

    Raises
    ------
    ValueError
        For a word or number that is none of them.
    """
    values, attributes = _values(data, name, dims)
    labels, absent = _labels(values, attributes, name)
    if labels.dtype.kind != "U":
        labels = _flagged(labels, absent, attributes, name, words)
    found = _places(labels, np.array(words))
    wrong = (found == NO_FORCE) & ~absent
    if wrong.any():
        raise ValueError(f"{name} holds {shown(str(labels[wrong][0]))}: choose from {', '.join(words)}")
    return np.where(absent, NO_FORCE, found)


class LoadLabels:
    """The labels by which cases name loads.

    Parameters
    ----------
    labels : dict of (n_load,) ndarray
        Values of the variables that together name a load, as in :class:`rom.bodies.Loads`: words or whole numbers.
    """

    def __init__(self, labels: Mapping[str, np.ndarray]) -> None:
        self.distinct = {name: np.array(list(dict.fromkeys(values.tolist()))) for name, values in labels.items()}
        self.number: np.ndarray = np.zeros(len(next(iter(labels.values()))), dtype=np.int64)
        """Of each load among all combinations of labels."""
        for name, values in labels.items():
            self.number = self.number * len(self.distinct[name]) + _places(values, self.distinct[name])

    def columns(self, data: xr.Dataset) -> np.ndarray:
        """(n_case, n_force) ndarray of int: the loads that labelled cases name, NO_FORCE where a force is absent.

        It is where one of its labels is NaN, a fill value, -1, empty or "none".

        Raises
        ------
        ValueError
            For labels that no load has.
        """
        return self._read(data)[0]

    def _read(self, data: xr.Dataset) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Columns, and where each label is missing."""
        dims = ("case", "force")
        absent, number = np.zeros((), dtype=bool), np.zeros((), dtype=np.int64)
        lacking = {}
        for name, distinct in self.distinct.items():
            if distinct.dtype.kind == "U":
                place = categories(data, name, dims, distinct.tolist())
                missing = place == NO_FORCE
            else:
                values, missing = _labels(*_values(data, name, dims), name)
                place = _places(values, distinct)
                wrong = (place == NO_FORCE) & ~missing
                if wrong.any():
                    raise ValueError(f"{name} {shown(values[wrong][0].item())} cannot carry load: choose among the "
                                     f"{len(distinct)} of this scene's loads, {_listed(distinct)}")
            absent, lacking[name] = absent | missing, missing
            number = number * len(distinct) + place
        column = _places(number, self.number)
        mixed = (column == NO_FORCE) & ~absent
        if mixed.any():
            case, force = np.argwhere(mixed)[0]
            raise ValueError(f"force {force} of case {case} has labels of different loads: give "
                             f"{', '.join(self.distinct)} of one")
        return np.where(absent, NO_FORCE, column), lacking

    def forces(self, data: xr.Dataset, amplitude: str = "force_amplitude", unit: str = "N"
               ) -> tuple[np.ndarray, np.ndarray]:
        """Columns as :meth:`columns` gives them, and the amplitudes that multiply them, zero where a force is absent.

        Returns
        -------
        column : (n_case, n_force) ndarray of int
        force : (n_case, n_force) ndarray [N]

        Raises
        ------
        ValueError
            For labels that no load has, and an amplitude without a load.
        """
        column, lacking = self._read(data)
        force = numbers(data, amplitude, ("case", "force"), unit)
        absent = column == NO_FORCE
        lost = absent & (force != 0.0) & ~np.isnan(force)
        if lost.any():
            case, place = np.argwhere(lost)[0]
            name = next(name for name, missing in lacking.items() if missing[case, place])
            raise ValueError(f"force {place} of case {case} has the amplitude {force[case, place]:g} {unit} but no "
                             f"{name}: give both, or neither")
        return column, np.where(absent, 0.0, force)


# ---- arrays -------------------------------------------------------------------------------------------------

def _shape(data: xr.Dataset, dims: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(data.sizes.get(dim, 1) for dim in dims)


def _values(data: xr.Dataset, name: str, dims: tuple[str, ...]) -> tuple[np.ndarray, Mapping[Any, Any]]:
    """Values of an input in the shape of ``dims``, and its attributes."""
    variable = data.variables[name]
    shape = _shape(data, dims)
    several = [dim for dim, size in zip(dims, shape, strict=True) if dim not in variable.dims and dim != "case"
               and size > 1]
    if set(variable.dims) - set(dims) or several:
        want = " or ".join(str(dims[:k]) for k in range(1, len(dims) + 1))
        raise ValueError(f"{name} has the dimensions {variable.dims}: batch it along {want}" + (
            f", with one value for each of the {data.sizes[several[0]]} forces" if several else ""))
    order = [variable.dims.index(dim) for dim in dims if dim in variable.dims]
    values = np.asarray(variable.values).transpose(order)
    values = values.reshape([variable.sizes.get(dim, 1) for dim in dims])
    return np.broadcast_to(values, shape), variable.attrs


def _missing(values: np.ndarray, attributes: Mapping[Any, Any]) -> np.ndarray:
    """Where a numeric variable holds NaN or one of its own fill values."""
    missing = np.isnan(values) if values.dtype.kind == "f" else np.zeros(values.shape, dtype=bool)
    for name in FILLS:
        fill = np.asarray(attributes.get(name))
        if fill.dtype.kind in "iuf":
            missing = missing | np.isin(values, fill)
    return missing


def _labels(values: np.ndarray, attributes: Mapping[Any, Any], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Labels as int64 or words, and where there is none; ValueError for values that can be no labels."""
    if values.dtype.kind in "SOT":
        listed = [label.decode("utf-8", "replace") if isinstance(label, bytes) else label
                  for label in values.ravel().tolist()]
        there = [label for label in listed if not _is_none(label)]
        if all(isinstance(label, str) for label in there):
            values = np.array(["" if _is_none(label) else label for label in listed], dtype=str).reshape(values.shape)
        elif all(isinstance(label, int | np.integer) and not isinstance(label, bool)
                 and -LARGEST_LABEL <= label <= LARGEST_LABEL for label in there):
            whole = [NO_FORCE if _is_none(label) else int(label) for label in listed]
            values = np.array(whole, dtype=np.int64).reshape(values.shape)
    if values.dtype.kind == "U":
        absent = np.isin(values, ["", NO_WORD])
        fills = [attributes[fill] for fill in FILLS if isinstance(attributes.get(fill), str)]
        return values, absent | np.isin(values, fills) if fills else absent
    if values.dtype.kind not in "iuf":
        raise ValueError(f"{name} is of type {values.dtype}: give words or whole numbers")
    absent = _missing(values, attributes) | (values == NO_FORCE)
    there = values[~absent]
    if there.dtype.kind == "f" and (there != np.round(there)).any():  # infinity is round
        raise ValueError(f"{name} holds {there[there != np.round(there)][0]:g}, which is no whole number: give the "
                         "labels of loads")
    if (np.abs(there.astype(float)) > LARGEST_LABEL).any():
        raise ValueError(f"{name} holds a value beyond {LARGEST_LABEL}: give the labels of loads")
    return np.where(absent, NO_FORCE, values).astype(np.int64), absent


def _is_none(label: Any) -> bool:
    return label is None or (isinstance(label, float) and label != label)


def _places(values: np.ndarray, among: np.ndarray) -> np.ndarray:
    """Positions of values among distinct others, :data:`NO_FORCE` where there is none."""
    if values.dtype.kind != among.dtype.kind and "U" in (values.dtype.kind, among.dtype.kind):
        return np.full(values.shape, NO_FORCE, dtype=np.int64)
    order = np.argsort(among, kind="stable")
    rows = order[np.minimum(np.searchsorted(among, values, sorter=order), len(among) - 1)]
    return np.where(among[rows] == values, rows, NO_FORCE)


def _listed(labels: np.ndarray) -> str:
    """The first labels, for messages."""
    return ", ".join(map(str, labels[:8])) + (" ..." if len(labels) > 8 else "")


def _flagged(codes: np.ndarray, absent: np.ndarray, attributes: Mapping[Any, Any], name: str, words: Sequence[str]
             ) -> np.ndarray:
    """Words that numbers stand for."""
    flags, meanings = attributes.get("flag_values"), attributes.get("flag_meanings")
    known = dict(enumerate(words))
    if flags is not None and isinstance(meanings, str):
        known = dict(zip(np.atleast_1d(flags).tolist(), meanings.split(), strict=False))
    wrong = ~np.isin(codes, list(known)) & ~absent
    if wrong.any():
        listed = ", ".join(f"{code} ({word})" for code, word in known.items())
        raise ValueError(f"{name} holds {codes[wrong][0]}, which stands for nothing: give {listed}, or the words")
    return np.array([known.get(code, "") for code in codes.ravel().tolist()], dtype=str).reshape(codes.shape)
