"""How wrong answers are, in numbers: statistics of errors, and errors in the energy norm."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rom.fullorder.energy_norm import energy_norms


def energy_errors(answers: np.ndarray, truth: np.ndarray, stiffness: sp.sparray) -> np.ndarray:
    """``sqrt(e^H K e)`` of each case [J^1/2].

    Parameters
    ----------
    answers, truth : (n_case, n) ndarray [m]
    stiffness : (n, n) sparse array [N/m]
    """
    return energy_norms((answers - truth).T, stiffness)


def statistics(errors: np.ndarray) -> tuple[float, float, float]:
    """Maximum, 95 % quantile and median of the errors that are known; NaN where there are none."""
    known = errors[~np.isnan(errors)]
    if not len(known):
        return float("nan"), float("nan"), float("nan")
    # a sorted quantile, since interpolation between infinities would give NaN
    ordered = np.sort(known)
    return float(ordered[-1]), float(ordered[int(0.95 * (len(ordered) - 1))]), float(ordered[(len(ordered) - 1) // 2])


def largest(errors: np.ndarray, axis: int | tuple[int, ...] | None = None) -> np.ndarray:
    """Largest of the errors that are known along axes; NaN where none is."""
    known = ~np.isnan(errors)
    return np.where(known.any(axis=axis), np.where(known, errors, -np.inf).max(axis=axis, initial=-np.inf), np.nan)


def of_cases(errors: np.ndarray) -> np.ndarray:
    """(n_case,) ndarray: the largest known error along all further axes."""
    return largest(errors.reshape(len(errors), -1), axis=1) if errors.ndim > 1 else errors
