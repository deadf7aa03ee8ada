"""Sums of poles: what shapes that diagonalise K and M answer under hysteretic damping.

A shape with ``x^T K x = elastic`` and ``x^T M x = inertial``, K- and M-orthogonal to the others, answers a load f
with the coordinate

    x^T f / (elastic (1 + i eta) - omega^2 inertial).

Natural modes are mass-orthonormal (elastic = lambda, inertial = 1), load-dependent vectors K-orthonormal (elastic = 1,
inertial = theta, :mod:`rom.fullorder.load_vectors`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np


def operating_points(frequency: Any, loss_factor: Any) -> tuple[np.ndarray, np.ndarray]:
    """1 + i eta and omega^2 [rad^2/s^2] of frequencies [Hz] and loss factors, (n, 1) each: a row an operating point."""
    omega = 2.0 * np.pi * np.atleast_1d(frequency)
    return np.atleast_1d(1.0 + 1j * np.asarray(loss_factor))[:, None], (omega * omega)[:, None]


@dataclass(frozen=True, eq=False)
class Poles:
    """Elastic and inertial numbers of shapes; None stands for ones.

    Parameters
    ----------
    elastic, inertial : (..., m) ndarray or None
    """

    elastic: np.ndarray | None = None
    inertial: np.ndarray | None = None

    @classmethod
    def of_modes(cls, eigenvalue: np.ndarray) -> Self:
        """Of mass-orthonormal shapes with the eigenvalues (m,) [rad^2/s^2]."""
        return cls(elastic=eigenvalue)

    @classmethod
    def of_vectors(cls, theta: np.ndarray) -> Self:
        """Of K-orthonormal shapes with the reciprocal Ritz values (..., p) [s^2]."""
        return cls(inertial=theta)

    def __getitem__(self, index: Any) -> Poles:
        """The shapes at ``index`` along the first axis, as of one load."""
        return Poles(*(None if part is None else part[index] for part in (self.elastic, self.inertial)))

    def at(self, numerator: Any, stiffness: Any, inertia: Any) -> np.ndarray:
        """Coordinates under loads.

        Parameters
        ----------
        numerator : (..., m) ndarray
            Shape times load, x^T f.
        stiffness : (..., 1) ndarray
            1 + i eta, or any complex factor of the whole stiffness.
        inertia : (..., 1) ndarray [rad^2/s^2]
            omega^2.

        Returns
        -------
        (..., m) ndarray, complex
        """
        elastic = stiffness if self.elastic is None else self.elastic * stiffness
        return numerator / (elastic - (inertia if self.inertial is None else inertia * self.inertial))
