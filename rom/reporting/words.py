"""Numbers as people read them: percent, powers of ten, ratios, times, sizes, lists of names."""

from __future__ import annotations

import math
from collections.abc import Sequence

NONE = "–"
"""Stands where there is no number."""
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def significant(value: float, digits: int = 3) -> str:
    """``value`` to so many significant digits, thousands separated, without exponent or trailing zeros."""
    if value == 0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    text = f"{round(value, places):,.{max(places, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def power(value: float, digits: int = 2) -> str:
    """``1.2 × 10⁻⁶``."""
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa.removesuffix('.0')} × 10{str(int(exponent)).translate(SUPERSCRIPT)}"


def error(value: float) -> str:
    """A relative error: percent down to 0.01 %, a power of ten below, and of percent far above."""
    if not math.isfinite(value):
        return NONE if math.isnan(value) else "unbounded"
    if value == 0:
        return "0"
    if value >= 1e4:
        return f"{power(100 * value)} %"
    return f"{significant(100 * value, 2)} %" if value >= 0.999e-4 else power(value)


def ratio(value: float) -> str:
    """``1,540 ×``."""
    if not math.isfinite(value):
        return NONE
    return f"{significant(value, 3 if value >= 10 else 2)} ×"


def seconds(value: float) -> str:
    """A time in the unit that suits it; ``none`` for zero."""
    if not math.isfinite(value):
        return NONE
    if value <= 0:
        return "none" if value == 0 else NONE
    for limit, scale, unit in ((1e-6, 1e9, "ns"), (1e-3, 1e6, "µs"), (1.0, 1e3, "ms"), (120.0, 1.0, "s"),
                               (7200.0, 1 / 60, "min")):
        if value < limit:
            return f"{significant(value * scale)} {unit}"
    return f"{significant(value / 3600)} h"


def size(value: float) -> str:
    """Bytes in decimal units."""
    if not math.isfinite(value):
        return NONE
    for limit, scale, unit in ((1e3, 1.0, "B"), (1e6, 1e3, "kB"), (1e9, 1e6, "MB")):
        if value < limit:
            return f"{significant(value / scale)} {unit}"
    return f"{significant(value / 1e9)} GB"


def count(value: float) -> str:
    """A number of queries, rounded up; ``never`` where it is infinite, a dash where there is none."""
    if math.isnan(value):
        return NONE
    if math.isinf(value):
        return "never"
    if value >= 1e4:  # measured times carry no more digits
        return significant(value)
    return f"{math.ceil(value):,}"


def bound(value: float) -> str:
    """A ratio of bound to error, never rounded across 1, which tells a bound from a guess."""
    text = significant(value, 4)
    return "just below 1" if value < 1 and text == "1" else text


def frequency(value: float) -> str:
    """``122.4 Hz``."""
    return f"{significant(value, 4)} Hz"


def measure(value: float, unit: str) -> str:
    """``3,200 Pa``; a plain number where the unit is 1."""
    return f"{significant(value)} {unit}" if unit not in ("", "1") else significant(value)


def listed(names: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def plural(number: int, noun: str) -> str:
    """``1 case``, ``1,200 cases``."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
