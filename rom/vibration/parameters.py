"""What a fingertip's vibration may depend on, by name: table 1's dimensions, declared shape, table 2's properties.

Names are "fingertip_width" for a dimension, "shape.bone_axis_rise" for an assumption about the surfaces and
"dermis.elastic_modulus" for a tissue's property. What chooses loaded nodes (`NODE_CHOICES`) is none of these: it
changes in whole nodes and leaves stiffness and mass alone.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

from rom.fingertip import Fingertip
from rom.fingertip.anatomy import DIMENSIONS, TISSUES, Anatomy, Tissue
from rom.fingertip.shape import SurfaceShape

Kind = Literal["dimension", "assumption", "property"]

SHAPE = "shape"

#: Fields of the shape that choose nodes and move none.
NODE_CHOICES = ("pad_centre", "pad_start", "pad_depth")


@dataclass(frozen=True)
class Parameter:
    """A number that a fingertip is made from.

    Parameters
    ----------
    name : str
    value : float [unit]
    unit : str
        That of the tables: mm, MPa, g/cm3 or -.
    kind : {"dimension", "assumption", "property"}
        Of table 1, of the declared surface shape, of table 2.
    """

    name: str
    value: float
    unit: str
    kind: Kind

    @property
    def label(self) -> str:
        """str : the name in words."""
        return self.name.removeprefix(SHAPE + ".").replace(".", ": ").replace("_", " ").replace("poisson", "Poisson's")

    @property
    def scale(self) -> float:
        """float [unit] : what relative changes are relative to: the value's size, or one unit where it is zero."""
        return abs(self.value) or 1.0


def parameters(fingertip: Fingertip, names: Iterable[str] | None = None) -> tuple[Parameter, ...]:
    """All parameters of a fingertip, or those of some names, in that order.

    Parameters
    ----------
    fingertip : Fingertip
    names : iterable of str, optional

    Returns
    -------
    tuple of Parameter

    Raises
    ------
    ValueError
        For an unknown name.
    """
    anatomy = fingertip.anatomy
    units = {kind: _units(kind) for kind in (Anatomy, SurfaceShape, Tissue)}
    found = [Parameter(name, getattr(anatomy, name), units[Anatomy][name], "dimension") for name in DIMENSIONS]
    for item in fields(SurfaceShape):
        value = getattr(anatomy.shape, item.name)
        if item.name not in NODE_CHOICES and isinstance(value, float):
            unit = units[SurfaceShape].get(item.name, "-")
            found.append(Parameter(f"{SHAPE}.{item.name}", value, unit, "assumption"))
    for name in TISSUES:
        for item in fields(Tissue):
            value = getattr(anatomy.tissue(name), item.name)
            found.append(Parameter(f"{name}.{item.name}", value, units[Tissue][item.name], "property"))
    known = {parameter.name: parameter for parameter in found}
    if names is None:
        return tuple(found)
    names = list(names)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"There is no parameter {', '.join(map(repr, unknown))}: choose among {', '.join(known)}.")
    return tuple(known[name] for name in names)


def with_parameter(fingertip: Fingertip, name: str, value: float) -> Fingertip:
    """The same fingertip with one parameter changed.

    Parameters
    ----------
    fingertip : Fingertip
    name : str
        One of `parameters`.
    value : float
        In the parameter's unit.

    Raises
    ------
    ValueError
        For an unknown name.
    AnatomyError
        For a value that cannot be.
    """
    parameters(fingertip, [name])
    anatomy = fingertip.anatomy
    owner, _, item = name.rpartition(".")
    if owner == "":
        anatomy = anatomy.replace(**{item: value})
    elif owner == SHAPE:
        anatomy = anatomy.replace_shape(**{item: value})
    else:
        anatomy = anatomy.replace_tissue(owner, **{item: value})
    return replace(fingertip, anatomy=anatomy)


def parameter_coordinates(chosen: Sequence[Parameter]) -> dict[str, Any]:
    """Coordinates of a dimension ``parameter``."""
    return {
        "parameter": [one.name for one in chosen],
        "parameter_label": ("parameter", [one.label for one in chosen]),
        "parameter_unit": ("parameter", [one.unit for one in chosen]),
        "parameter_kind": ("parameter", [one.kind for one in chosen]),
        "parameter_value": ("parameter", [one.value for one in chosen], {
            "long_name": "value of the parameter", "units": "parameter_unit"}),
    }


def _units(kind: type) -> dict[str, str]:
    """Units by field, as the class declares them in its docstring: ``name, name : float [unit]``."""
    found = re.findall(r"^([\w, ]+) : float \[(.+)\]$", inspect.getdoc(kind) or "", flags=re.MULTILINE)
    return {name: unit for names, unit in found for name in names.split(", ")}
