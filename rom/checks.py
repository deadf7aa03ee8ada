"""Checks of arguments, once for the whole toolkit: each refusal names the value, the rule and the remedy."""

from __future__ import annotations

import math
import numbers
import operator
from collections.abc import Iterable
from typing import Any

LONGEST = 60


def shown(value: Any, longest: int = LONGEST) -> str:
    """A value as a message shows it: on one line, and short."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # an integer of thousands of digits
        text = f"a {type(value).__name__} too long to show"
    return text if len(text) <= longest else f"{text[:longest]}..."


def whole_number(name: str, value: Any, least: int | None = None, most: int | None = None) -> int:
    """``value`` as an int within its limits; ValueError where it is none."""
    try:
        found = operator.index(value)
    except TypeError:
        found = None
    if found is None or isinstance(value, bool) or (least is not None and found < least) or (
            most is not None and found > most):
        raise ValueError(f"{name}={shown(value)} cannot be: give a whole number{_limits(least, most)}")
    return found


def real_number(name: str, value: Any, least: float | None = None, most: float | None = None, *,
                above: float | None = None, unit: str = "") -> float:
    """``value`` as a float within its limits; ValueError where it is no finite real number or lies outside.

    Parameters
    ----------
    name : str
    value : object
    least, most : float, optional
        Included in the range.
    above : float, optional
        Lower limit that is not included.
    unit : str
        For the message.
    """
    try:
        found = float(value) if isinstance(value, numbers.Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        found = math.inf
    if not math.isfinite(found) or (least is not None and found < least) or (most is not None and found > most) or (
            above is not None and found <= above):
        limits = f" above {above:g}" + (f" and at most {most:g}" if most is not None else "") \
            if above is not None else _limits(least, most)
        raise ValueError(f"{name}={shown(value)} cannot be: give a finite number{limits}{f' {unit}' if unit else ''}")
    return found


def choice(name: str, value: Any, choices: Iterable[str]) -> str:
    """``value`` if it is one of ``choices``; ValueError otherwise.

    Examples
    --------
    >>> choice("precision", "float16", ["float64", "float32"])
    Traceback (most recent call last):
        ...
    ValueError: precision='float16' is unknown: choose one of float64, float32
    """
    known = list(choices)
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{name}={shown(value)} is unknown: choose one of {', '.join(known)}")
    return value


def _limits(least: float | None, most: float | None) -> str:
    if least is None:
        return "" if most is None else f" of at most {most:g}"
    return f" from {least:g} up" if most is None else f" from {least:g} to {most:g}"
