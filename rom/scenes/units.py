"""Units of labelled variables: those of the schema, or others that convert into them; nothing is guessed.

Pint does the arithmetic and is imported only when a unit is not the schema's own. It takes an angle for a bare number,
so that a rad/s would become a hertz without the factor 2 pi: units convert here only where their angles agree too.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cache
from typing import Any

from rom.checks import shown
from rom.errors import SchemaError

NO_UNIT = ("", "1", "-")
WORD = r"\s*[A-Za-zµμ°%]+\s*(?:\*\*|\^)?\s*[+-]?\d?\s*"
SPELLING = re.compile(rf"\s*(?:1\s*/)?{WORD}(?:[\s*/·.]{WORD})*")
"""What is handed to pint at all: a product of names with short powers."""


def factor_to(unit: str, attributes: Mapping[Any, Any], name: str) -> float:
    """What a variable's values are multiplied by to be in ``unit``; 1 where it has no attribute ``units``.

    Parameters
    ----------
    unit : str
        Such as ``"N"``; ``"1"`` for pure numbers.
    attributes : mapping
        Of the variable.
    name : str
        For the message.

    Raises
    ------
    SchemaError
        Where the attribute ``units`` is no unit of the same kind.
    """
    found = attributes.get("units", unit)
    if isinstance(found, str) and (found.strip() == unit or {found.strip(), unit} <= set(NO_UNIT)):
        return 1.0
    factor = _factor(found, unit) if isinstance(found, str) else None
    if factor is None:
        raise SchemaError(f"{name} has the units {shown(found)}, which do not convert to {unit}: give it in {unit}, or "
                          "correct its attribute `units`")
    return factor


@cache
def _factor(found: str, unit: str) -> float | None:
    """What numbers in ``found`` are multiplied by; None where it is no unit of the kind of ``unit``."""
    if len(found) > 40 or not SPELLING.fullmatch(found):
        return None
    try:
        one, two, goal = (_registry().Quantity(size, _spelled(text)).to_root_units()
                          for size, text in ((1.0, found), (2.0, found), (1.0, unit)))
        proportional = math.isclose(two.magnitude, 2.0 * one.magnitude)  # degrees Celsius and decibels are not
        return one.magnitude / goal.magnitude if proportional and one.units == goal.units else None
    except Exception:  # whatever pint says of a text that is no unit
        return None


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def _spelled(text: str) -> str:
    """Units as pint writes them: powers marked, products with a star."""
    text = "" if text.strip() in NO_UNIT else text.strip().replace("·", "*").replace(".", "*").replace("%", "percent")
    return re.sub(r"(?<=[A-Za-zµμ])\s*([+-]?\d)", r"**\1", text)
