"""Dynamic stiffness Z = K (1 + i eta) - omega^2 M of a structurally damped body, as one vector operation.

Time factor e^{+i omega t}; loss factor eta >= 0 (hysteretic damping, K* = K (1 + i eta)).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.fullorder.symmetric import SymmetricMatrix, merge_symmetric


class DynamicStiffness:
    """K and M as upper triangles on the union of their patterns.

    Every combination a K + b M then has one pattern, and a factorization keeps its symbolic phase over all.

    Parameters
    ----------
    stiffness : (n, n) scipy sparse matrix [N/m]
        Symmetric; complex symmetric where each tissue has a loss factor of its own.
    mass : (n, n) scipy sparse matrix [kg]
        Real symmetric.

    Raises
    ------
    ValueError
        If one is not sparse, square, finite and symmetric, or their sizes differ, or the mass is complex.
    """

    def __init__(self, stiffness: Any, mass: Any) -> None:
        if np.iscomplexobj(mass):
            raise ValueError("the mass matrix is complex: it must be real")
        self._stiffness, self._mass = merge_symmetric(stiffness, mass, names=("stiffness matrix", "mass matrix"))

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self._stiffness.n

    def harmonic(self, frequency: float, loss_factor: float = 0.0) -> SymmetricMatrix:
        """Z at a frequency, always complex [N/m].

        Parameters
        ----------
        frequency : float [Hz]
            At least 0.
        loss_factor : float [1]
            At least 0, the same for the whole body; adds to the loss factors that a complex K holds already:
            Z = K + i eta Re K - omega^2 M.

        Raises
        ------
        ValueError
            If either is negative or not finite.
        """
        check_not_negative(frequency, "frequency", "Hz")
        check_not_negative(loss_factor, "loss factor", "1")
        omega = 2 * math.pi * frequency
        elastic = self._stiffness.values
        return self._combine(elastic + 1j * loss_factor * elastic.real - omega**2 * self._mass.values)

    def shifted(self, shift: float) -> SymmetricMatrix:
        """K - shift M, of the dtype of K.

        Parameters
        ----------
        shift : float [rad^2/s^2]
            Any finite number.
        """
        if not math.isfinite(shift):
            raise ValueError(f"the shift is {shift!r}: it must be a finite number")
        return self._combine(self._stiffness.values - shift * self._mass.values)

    def _combine(self, values: NDArray) -> SymmetricMatrix:
        return SymmetricMatrix(self._stiffness.indptr, self._stiffness.indices, values)


def check_not_negative(value: float, name: str, unit: str) -> None:
    """Refuse NaN, infinity and numbers below zero (ValueError)."""
    if not (math.isfinite(value) and value >= 0):
        raise ValueError(f"the {name} is {value!r} {unit}: it must be a finite number of at least 0")
