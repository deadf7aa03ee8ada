"""The relative error, once: what every comparison, certificate and test measures answers by."""

from __future__ import annotations

import numpy as np


def relative(miss: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Size of a difference over that of the truth.

    Parameters
    ----------
    miss, size : (...) ndarray
        Norms, at least zero.

    Returns
    -------
    (...) ndarray
        0 where the difference vanishes, infinite where the truth alone does or something is not finite.
    """
    miss, size = np.asarray(miss), np.asarray(size)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        error = np.where(miss == 0.0, 0.0, miss / size)
    return np.where(np.isfinite(error), error, np.inf)


def relative_errors(answers: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """``||u_hat - u|| / ||u||`` along the last axis, complex where the answers are.

    Parameters
    ----------
    answers, truth : (..., n) ndarray

    Returns
    -------
    (...) ndarray
        Infinite where the truth is zero and the answer is not, or where the answer is not finite.

    Examples
    --------
    >>> relative_errors(np.array([[1.0, 1.1], [0.0, 0.0], [1.0, 0.0]]), np.array([[1.0, 1.0], [0.0, 0.0], [0.0, 0.0]]))
    array([0.07071068, 0.        ,        inf])
    """
    return relative(np.linalg.norm(answers - truth, axis=-1), np.linalg.norm(truth, axis=-1))
