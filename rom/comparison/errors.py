"""How wrong an answer is: the relative error of a case, its statistics, and the certificate's effectivity."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp


def relative_errors(answers: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """``||u_hat - u|| / ||u||`` of each case over all its degrees of freedom, complex where the answers are.

    Parameters
    ----------
    answers, truth : (n_case, n) ndarray [m]

    Returns
    -------
    (n_case,) ndarray
        Infinite where the truth is zero and the answer is not, or where the answer is not finite.
    """
    size = np.linalg.norm(truth, axis=1)
    miss = np.linalg.norm(answers - truth, axis=1)
    errors = np.where(miss == 0.0, 0.0, np.divide(miss, size, out=np.full(len(size), np.inf), where=size > 0))
    return np.where(np.isfinite(errors), errors, np.inf)


def energy_errors(answers: np.ndarray, truth: np.ndarray, stiffness: sp.sparray) -> np.ndarray:
    """``sqrt(e^H K e)`` of each case [J^1/2]."""
    miss = (answers - truth).T
    parts = (miss.real, miss.imag) if np.iscomplexobj(miss) else (miss,)
    return np.sqrt(sum(np.einsum("ij,ij->j", part, stiffness @ part) for part in map(np.ascontiguousarray, parts)))


def statistics(errors: np.ndarray) -> tuple[float, float, float]:
    """Maximum, 95 % quantile and median; NaN where there are no cases."""
    if not len(errors):
        return float("nan"), float("nan"), float("nan")
    # a sorted quantile, since interpolation between infinities would give NaN
    ordered = np.sort(errors)
    return float(ordered[-1]), float(ordered[int(0.95 * (len(ordered) - 1))]), float(ordered[(len(ordered) - 1) // 2])
