"""One method on one level: what it answered, what it said of itself, and whether that was honest."""

from __future__ import annotations

import logging
import math
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from rom.errors import RomError
from rom.metamodels.validity import Assessment
from rom.scenes import LinearScene

RIGHT, WARNED, REFUSED, SILENT, CRASHED = OUTCOMES = ("right", "warned", "refused", "silent", "crashed")
"""From best to worst."""
EXACT = 1e-6
"""Relative energy error up to which a method that claims to be exact is right."""
CLAIM_EXACT = ("direct", "direct-reused", "superposition", "modal-krylov")
SPEAKING = frozenset({"ValidityWarning", "IllConditionedWarning"})
"""Warnings by which the toolkit says that an answer is in doubt; numpy's do not count."""
ESTIMATE_FACTOR = 3.0
"""How far an estimate may lie below the true error and still tell the reader the truth."""
ROUNDING = 1e-13
"""Errors below this are the reference's own rounding; no bound is held against them."""


def tolerance_of(method: str, scene: LinearScene) -> float:
    """Relative energy error up to which a method's answer is right: exact methods 1e-6, others the scene's gate."""
    return EXACT if method in CLAIM_EXACT else scene.gate


@dataclass
class Heard:
    """What a method said while it worked: spoken warnings and log records; others beside."""

    said: list[str] = field(default_factory=list)
    other: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Record:
    """What is kept of one method on one level.

    ``error`` relative in the energy norm (against the sum of single answers where these cancel), ``bound`` what the
    answer says of it and ``kind`` how ("bound", "estimate", "none"), ``assessed`` and ``assessed_kind`` the same by
    `Metamodel.assess`, which may cost more; ``bound_holds`` whether every claimed bound held.
    """

    outcome: str
    error: float = math.nan
    bound: float = math.nan
    kind: str = "none"
    residual: float = math.nan
    seconds: float = math.nan
    message: str = ""
    bound_holds: bool = True
    assessed: float = math.nan
    assessed_kind: str = "none"
    tolerance: float = math.nan


class Unanswered(Exception):
    """A method stopped before an answer; `outcome` says whether on purpose."""

    def __init__(self, outcome: str, message: str) -> None:
        super().__init__(message)
        self.outcome = outcome


def classify(error: float, tolerance: float, said: str, bound: float = math.nan, kind: str = "none") -> str:
    """Outcome of an answer.

    Parameters
    ----------
    error : float
        True relative error; NaN or infinite where no answer can be right.
    tolerance : float
        The method's stated one.
    said : str
        What it said of the answer's doubtfulness, "" for nothing.
    bound : float
        Relative error that it names.
    kind : {"bound", "estimate", "none"}
        Where the number named lies below one and covers the error, the reader is told the truth: a bound must hold,
        an estimate may be `ESTIMATE_FACTOR` too small.

    Returns
    -------
    {"right", "warned", "silent"}
    """
    if said:
        return WARNED
    factor = {"bound": 1 + 1e-6, "estimate": ESTIMATE_FACTOR}.get(kind, 0.0)
    if error <= tolerance or (bound < 1.0 and error <= factor * bound + ROUNDING):
        return RIGHT
    return SILENT


def worst_of(records: list[Record]) -> Record:
    """The record that speaks for a level: the worst outcome, the largest error among those."""
    def key(record: Record) -> tuple[int, bool, float]:
        error = record.error if math.isfinite(record.error) else math.inf
        return OUTCOMES.index(record.outcome), not record.bound_holds, error
    return max(records, key=key)


def listen(work: Callable[[], Any]) -> tuple[Any, Heard, float]:
    """Do some work and hear what it says.

    Returns
    -------
    result : Any
    heard : Heard
    seconds : float

    Raises
    ------
    Unanswered
        With outcome "refused" for ValueError and the toolkit's own errors, "crashed" for anything else.
    """
    heard = Heard()
    start = time.perf_counter()
    try:
        with warnings.catch_warnings(record=True) as caught, _log_records(heard), np.errstate(all="ignore"):
            warnings.simplefilter("always")
            result = work()
    except np.linalg.LinAlgError as error:  # a ValueError by descent, but not a sentence to a reader
        raise Unanswered(CRASHED, f"LinAlgError: {error}") from error
    except (ValueError, RomError) as error:
        if not _on_purpose(error):
            raise Unanswered(CRASHED, f"{type(error).__name__} from outside the toolkit: {error}") from error
        raise Unanswered(REFUSED, str(error)) from error
    except Exception as error:
        raise Unanswered(CRASHED, f"{type(error).__name__}: {error}") from error
    seconds = time.perf_counter() - start
    for one in caught:
        speaks = any(kind.__name__ in SPEAKING for kind in one.category.__mro__)
        (heard.said if speaks else heard.other).append(str(one.message))
    return result, heard, seconds


def _on_purpose(error: Exception) -> bool:
    """Whether the toolkit itself raised the error, or a library in its depth."""
    frames = traceback.extract_tb(error.__traceback__)
    return isinstance(error, RomError) or not frames or "site-packages" not in frames[-1].filename


@contextmanager
def _log_records(heard: Heard) -> Iterator[None]:
    class Collect(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            # that another solver runs is no word on the answer
            (heard.other if "oneMKL" in record.getMessage() else heard.said).append(record.getMessage())

    handler, logger = Collect(logging.WARNING), logging.getLogger("rom")
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


def judge_answer(answer: xr.Dataset, assessment: Assessment, heard: Heard, seconds: float, *, error: float,
                 relative: float, residual: float, tolerance: float) -> Record:
    """Judge one labelled answer of one case.

    Parameters
    ----------
    answer : xr.Dataset
        What `Metamodel.predict` returned.
    assessment : Assessment
        What `Metamodel.assess` says of it.
    heard : Heard
        From fitting and answering.
    seconds : float
    error : float
        True error in the measure of the level.
    relative : float
        True relative error in the energy norm, which a bound speaks of.
    residual, tolerance : float
    """
    bound, kind = stated(answer)
    reason = str(answer["validity"].values[0])
    said = "; ".join(dict.fromkeys(filter(None, [reason, *heard.said])))
    assessed = float(assessment.error[0])
    broken = [one for one, how in ((bound, kind), (assessed, assessment.kind))
              if how == "bound" and relative > one * (1 + 1e-6) + ROUNDING]
    outcome = classify(error, tolerance, said, bound, kind)
    notes = [said] if said else ["; ".join(dict.fromkeys(heard.other))]
    if broken:
        notes.append(f"its bound {min(broken):.1e} lies below the true relative error {relative:.1e}")
    return Record(outcome, error, bound, kind, residual, seconds, "; ".join(filter(None, notes))[:400],
                  not broken, assessed, assessment.kind, tolerance)


def stated(answer: xr.Dataset) -> tuple[float, str]:
    """Relative error that a labelled answer names for its only case, and of which kind."""
    return float(answer["error_estimate"].values[0]), str(answer["error_kind"].values[0])
