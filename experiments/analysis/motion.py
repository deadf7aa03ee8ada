"""What a complex displacement amplitude says of the motion it stands for, u(t) = Re(u exp(i omega t)).

A node of amplitude u in three dimensions runs through an ellipse; with ``|u|^2 = u^H u`` and ``s = u^T u`` its
semi-axes are ``sqrt((|u|^2 + |s|) / 2)`` and ``sqrt((|u|^2 - |s|) / 2)``. A whole field moves in place, as a standing
wave, if its nodes share one phase, and travels if phase goes on from place to place: the matrix [Re u, Im u] then has
rank two, and the ratio of its singular values is the travelling index of Feeny (2008, Journal of Sound and Vibration
310), 0 for a standing, 1 for a purely travelling motion, the same whatever the phase from which time is counted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def ellipse_axes(amplitude: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Semi-axes of the ellipse that each node runs through.

    Parameters
    ----------
    amplitude : (..., 3) ndarray, complex [m]
        Any number of components will do.

    Returns
    -------
    major, minor : (...,) ndarray [m]
        The major one is the largest displacement within a cycle.
    """
    size = np.sum(np.abs(amplitude) ** 2, axis=-1)
    square = np.abs(np.sum(amplitude**2, axis=-1))
    return np.sqrt((size + square) / 2), np.sqrt(np.maximum(size - square, 0.0) / 2)


def travelling_index(field: NDArray) -> NDArray[np.float64]:
    """Ratio of minor to major singular value of [Re u, Im u]: 0 standing, 1 travelling.

    Parameters
    ----------
    field : (n_case, n) ndarray, complex

    Returns
    -------
    (n_case,) ndarray [1]
        0 for a field of zeros.
    """
    # the singular values are the semi-axes of the ellipse that the whole field runs through in its own space
    major, minor = ellipse_axes(field)
    return np.divide(minor, major, out=np.zeros_like(major), where=major > 0)


def at_largest_motion(field: NDArray) -> NDArray[np.float64]:
    """The real field at the instant of its largest norm: (n_case, ...) complex -> (n_case, ...) real."""
    flat = field.reshape(len(field), -1)
    turn = np.exp(-0.5j * np.angle(np.sum(flat**2, axis=1)))
    return (flat * turn[:, None]).real.reshape(field.shape)
