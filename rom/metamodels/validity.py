"""What a method says of its own answers: how wrong each may be, and where it does not stand behind them.

The measure is the relative error in the energy norm, ``sqrt(e^H K e) / sqrt(u^H K u)`` with the true answer u.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from rom.scenes import CaseArrays

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
        "bound" is rigorous.
    reason : (n_case,) ndarray of str
        Empty where the method stands behind its answer, else one clause that says why not.
    """

    error: np.ndarray
    kind: str
    reason: np.ndarray

    @classmethod
    def unknown(cls, reason: np.ndarray) -> Self:
        """Nothing is known but the reasons, so the method stands behind none of the answers."""
        return cls(np.full(len(reason), np.inf), "none", np.where(reason == "", UNJUDGED, reason))

    def with_large_errors_named(self) -> Self:
        """Reasons added where the error may be as large as the answer."""
        text = f"its {self.kind} of the relative error is 1 or more"
        wrong = ~(self.error < 1.0) & (self.kind != "none")
        return type(self)(self.error, self.kind, joined(self.reason, np.where(wrong, text, "")))


@dataclass(frozen=True)
class TrainedRange:
    """What the training cases covered; an answer outside is extrapolation.

    Parameters
    ----------
    loads : tuple of int
        Unit loads that some case applied.
    forces : int
        Most forces in a case.
    frequency, loss_factor : (float, float), optional
        Lowest and highest; None in statics.
    """

    loads: tuple[int, ...]
    forces: int
    frequency: tuple[float, float] | None = None
    loss_factor: tuple[float, float] | None = None

    @classmethod
    def of(cls, cases: CaseArrays) -> Self:
        """The range of these cases."""
        def ends(values: np.ndarray | None) -> tuple[float, float] | None:
            return None if values is None else (float(values.min()), float(values.max()))

        acting = cases.force != 0.0
        return cls(tuple(int(load) for load in np.unique(cases.node[acting])), int(acting.sum(axis=1).max(initial=0)),
                   ends(cases.frequency), ends(cases.loss_factor))

    @classmethod
    def from_dict(cls, record: dict[str, Any]) -> Self:
        """The inverse of :meth:`to_dict`."""
        values: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in record.items()}
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able."""
        return asdict(self)

    def reasons(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray of str: what lies outside, or nothing."""
        acting = cases.force != 0.0
        unseen = (acting & ~np.isin(cases.node, np.asarray(self.loads, dtype=int))).any(axis=1)
        found = np.where(unseen, "a load that no training case applied", "")
        more = acting.sum(axis=1) > self.forces
        found = joined(found, np.where(more, f"more than the {self.forces} forces of any training case", ""))
        for name, unit, values, ends in (("frequency", " Hz", cases.frequency, self.frequency),
                                         ("loss factor", "", cases.loss_factor, self.loss_factor)):
            if ends is not None and values is not None:
                slack = 1e-9 * max(1.0, ends[1])
                outside = (values < ends[0] - slack) | (values > ends[1] + slack)
                text = f"{name} outside the {ends[0]:g} to {ends[1]:g}{unit} of training"
                found = joined(found, np.where(outside, text, ""))
        return found


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
        raise ValueError(f"tolerance={tolerance!r} is no relative error: give a number above 0, such as 1e-3")
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
