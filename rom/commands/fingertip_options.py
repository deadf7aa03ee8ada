"""Command-line options that choose a fingertip: preset, formulation, rear boundary, changed anatomy."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rom.fingertip import Anatomy, Fingertip


def add_fingertip_options(
    parser: argparse.ArgumentParser, *, preset: str = "study", formulation: str = "b-bar"
) -> None:
    """Add ``--preset``, ``--formulation``, ``--rear`` and the repeatable ``--set NAME=VALUE``.

    Parameters
    ----------
    parser : argparse.ArgumentParser
    preset, formulation : str
        Defaults.
    """
    parser.add_argument("--preset", default=preset, help=f"mesh: study or metamodel (default {preset})")
    parser.add_argument("--formulation", default=formulation,
                        help=f"b-bar, or full as published (default {formulation})")
    parser.add_argument("--rear", default="free", help="section at the joint: free (default) or fixed")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="changes",
                        help="change the anatomy, e.g. dermis_thickness=1.2, dermis.elastic_modulus=0.1 or "
                             "shape.bone_axis_rise=0.8; repeatable")


def fingertip_from(arguments: argparse.Namespace) -> Fingertip:
    """The fingertip that the options of `add_fingertip_options` describe.

    Raises
    ------
    ValueError
        For an unknown preset, formulation or rear, or a change that `changed_anatomy` refuses.
    """
    from rom.fingertip import Anatomy, Fingertip

    return Fingertip.preset(arguments.preset, formulation=arguments.formulation, rear=arguments.rear,
                            anatomy=changed_anatomy(Anatomy(), arguments.changes))


def changed_anatomy(anatomy: Anatomy, changes: Iterable[str]) -> Anatomy:
    """An anatomy with some numbers changed, all at once, so that only the outcome must be possible.

    Parameters
    ----------
    anatomy : Anatomy
    changes : iterable of str
        ``NAME=VALUE``: a dimension of table 1 [mm], ``TISSUE.FIELD`` of table 2 [MPa, -, g/cm3], or ``shape.FIELD``.

    Raises
    ------
    ValueError
        For a text of another form, an unknown name, a name given twice or a value that is no finite number.
    AnatomyError
        For an anatomy that cannot exist.
    """
    values = anatomy.to_dict()
    seen: set[str] = set()
    for change in changes:
        name, equals, text = (part.strip() for part in change.partition("="))
        if not (name and equals and text):
            raise ValueError(f"--set got {change!r}, but it needs NAME=VALUE: write for example dermis_thickness=1.2")
        if name in seen:
            raise ValueError(f"--set names {name} twice: give each value once")
        seen.add(name)
        owner, field = _owner(values, name)
        owner[field] = _number(name, text)
    return type(anatomy).from_dict(values)


def _owner(values: dict[str, Any], name: str) -> tuple[dict[str, Any], str]:
    """The dict that holds a (dotted) name's number, and the key in it."""
    group, dot, field = name.partition(".")
    if dot and isinstance(values.get(group), dict) and field in values[group]:
        return values[group], field
    if not dot and isinstance(values.get(name), float):
        return values, name
    raise ValueError(f"--set does not know {name!r}: {_remedy(values, name)}")


def _remedy(values: dict[str, Any], name: str) -> str:
    from difflib import get_close_matches

    known = [key for key, value in values.items() if not isinstance(value, dict)]
    for group, members in values.items():
        if isinstance(members, dict):
            known += [f"{group}.{field}" for field in members]
    group = name.partition(".")[0]
    if isinstance(values.get(group), dict):
        return f"{group} has {', '.join(f'{group}.{field}' for field in values[group])}"
    close = get_close_matches(name, known)
    if close:
        return f"did you mean {' or '.join(close)}?"
    return f"choose among {', '.join(known)}"


def _number(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"--set {name} got {text!r}, but it needs a finite number: write for example {name}=1.2")
    return value
