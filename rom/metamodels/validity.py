"""What a method says of its own answers: how wrong each may be, and where it does not stand behind them.

The measure is the relative error in the energy norm, ``sqrt(e^H K e) / sqrt(u^H K u)`` with the true answer u.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Self

import numpy as np

from rom.checks import shown

KINDS = ("bound", "estimate", "none")
SMALLEST_TOLERANCE = 1e-11
"""What a direct solve in double precision reaches: unit roundoff times what a fingertip's condition makes of it."""

UNJUDGED = "nothing is known of its error without a tolerance or assess()"
"""Reason of answers whose method neither bounds nor estimates its error at little cost."""


class ValidityWarning(UserWarning):
    """Answers that a method does not stand behind."""


@dataclass(frozen=True, eq=False)
class Assessment:
    """How wrong the answers to a block of cases may be.

    Parameters
    ----------
    error : (n_case,) ndarray
        Relative error in the energy norm: a bound, an estimate, or infinite where nothing is known.
    kind : {"bound", "estimate", "none"}
        "bound" is proven, rounding included, under the assumptions that :mod:`rom.metamodels.bounds` states.
    reason : (n_case,) ndarray of str
        Empty where the method stands behind its answer, else one clause that says why not.
    """

    error: np.ndarray
    kind: str
    reason: np.ndarray

    @classmethod
    def unknown(cls, reason: np.ndarray, named: bool = True) -> Self:
        """Nothing is known but the reasons; ``named`` says so where there is none, since more could be known."""
        return cls(np.full(len(reason), np.inf), "none", np.where(reason == "", UNJUDGED, reason) if named else reason)

    def with_large_errors_named(self) -> Self:
        """Reasons added where the error may be as large as the answer."""
        text = f"its {self.kind} of the relative error is 1 or more"
        wrong = ~(self.error < 1.0) & (self.kind != "none")
        return type(self)(self.error, self.kind, joined(self.reason, np.where(wrong, text, "")))


def joined(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(n_case,) ndarray of str: two reasons as one clause."""
    both = (first != "") & (second != "")
    return np.strings.add(np.strings.add(first, np.where(both, "; ", "")), second)


def check_tolerance(tolerance: float) -> float:
    """The tolerance of a relative energy error as a float.

    Raises
    ------
    ValueError
        Where no answer could be known to meet it, or every one would.
    """
    if isinstance(tolerance, bool) or not isinstance(tolerance, (int, float, np.integer, np.floating)) or not (
            math.isfinite(tolerance) and tolerance > 0):
        raise ValueError(f"tolerance={shown(tolerance)} is no relative error: give a number above 0, such as 1e-3")
    if tolerance < SMALLEST_TOLERANCE:
        raise ValueError(f"tolerance={tolerance:g} is below what double precision can reach on this model: give "
                         f"{SMALLEST_TOLERANCE:g} or more")
    return float(tolerance)


def warning_text(name: str, reason: np.ndarray, error: np.ndarray) -> str:
    """One sentence that counts the cases with a reason and names the reasons."""
    doubtful = reason != ""
    counts = Counter(reason[doubtful].tolist()).most_common()
    told = ", ".join(f"{text} ({count})" for text, count in counts[:4]) + (", ..." if len(counts) > 4 else "")
    worst = float(error[doubtful].max())
    size = f"relative energy error up to {worst:.2g}" if np.isfinite(worst) else "of unknown or unlimited error"
    return (f"{name} does not stand behind {int(doubtful.sum())} of {len(reason)} answers, {size}: {told}; see "
            "`validity` of the answer, or give predict() a tolerance")
