"""What theorem 2 (:mod:`rom.metamodels.bounds`) needs to know of computed modes, measured once."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np

from rom.fullorder import Modes
from rom.fullorder.energy_norm import SUMS, UNIT, EnergyNorm, block_product, gamma
from rom.metamodels.bounds import amplification_beyond, eigenvalue_bound
from rom.metamodels.stored import Stored

STEPS = 13
"""Roundings of a coordinate, at most: its pole, its numerator, the complex quotient, and a Galerkin one's products."""


class ModeSplit:
    """Quality of computed modes: their defects, what they lack of orthogonality, and which others there may be.

    Parameters
    ----------
    eigenvalue : (m,) ndarray [rad^2/s^2]
        theta.
    defect : (m,) ndarray [J^1/2 kg^-1/2 m^-1]
        delta.
    stiff_deviation, mass_deviation, coupling : float
        kappa_K [1], kappa_M [s^2] and tau [s^2].
    next_bound : float [rad^2/s^2]
        Lambda; 0 where nothing is proven of the others, infinite where there are none.
    """

    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("eigenvalue", ("mode",), "squared angular frequency", "rad2 s-2"),
        Stored("defect", ("mode",), "bound of the defect", "J0.5 kg-0.5 m-1"), Stored("stiff_deviation"),
        Stored("mass_deviation"), Stored("coupling"), Stored("next_bound"))

    def __init__(self, eigenvalue: np.ndarray, defect: np.ndarray, stiff_deviation: float, mass_deviation: float,
                 coupling: float, next_bound: float) -> None:
        self.eigenvalue, self.defect = eigenvalue, defect
        self.stiff_deviation, self.mass_deviation = stiff_deviation, mass_deviation
        self.coupling, self.next_bound = coupling, next_bound

    @classmethod
    def of(cls, energy: EnergyNorm, modes: Modes) -> Self:
        """Measure computed modes; what the request cut off a cluster is measured with them."""
        shape, theta = modes.shape, modes.eigenvalue
        if modes.left_out is not None and modes.left_out.size:
            shape = np.concatenate([shape, modes.left_out], axis=1)
            stiff, inert = (np.einsum("nm,nm->m", modes.left_out, matrix @ modes.left_out)
                            for matrix in energy.matrices())
            theta = np.concatenate([theta, stiff / inert])
        long, rows = np.longdouble, np.ascontiguousarray(shape.T)
        elastic, inertial = (matrix @ shape.astype(long) for matrix in energy.matrices(long))
        size = energy.size(rows)
        left = np.asarray(elastic - inertial * theta.astype(long), dtype=float).T
        defect = energy.plain_dual(left) * (1.0 + 2 * UNIT) + energy.product_error(size, 1.0, theta, terms=2, kind=long)
        root, largest = np.sqrt(theta), float(np.sum(size ** 2 / theta)) * SUMS

        def deviation(image: np.ndarray, expected: np.ndarray, spread: float) -> float:
            product, terms = block_product(rows, np.asarray(image, dtype=float))
            off = (product - np.diag(expected)) / np.outer(root, root)
            return float(np.linalg.norm(off)) * SUMS + (gamma(terms + energy.row_length + 6) * spread) * largest

        stiff_deviation = deviation(elastic, theta, energy.spread) + energy.asymmetry * largest
        mass_deviation = deviation(inertial, np.ones(len(theta)), energy.mass_spread)

        def coupling(count: int) -> float:
            return float(np.sqrt(np.sum((defect[:count] / root[:count]) ** 2 / theta[:count] ** 2))) * SUMS

        m, beyond = modes.count, 0.0
        if m == energy.model.n:
            beyond = np.inf
        elif modes.sturm_count == len(theta):
            count_error = 4 * UNIT * (energy.spread + modes.sturm_shift * energy.mass_spread) * energy.reach ** 2
            beyond = eigenvalue_bound(modes.sturm_shift, count_error, theta, m, stiff_deviation, mass_deviation,
                                      coupling(len(theta)))
        return cls(modes.eigenvalue, defect[:m], stiff_deviation, mass_deviation, coupling(m), beyond)

    @property
    def norm(self) -> np.ndarray:
        """(m,) ndarray: bound of ``||M x_k||*``."""
        return (np.sqrt(self.eigenvalue * (1.0 + self.stiff_deviation)) + self.defect) / self.eigenvalue * SUMS

    def amplifications(self, stiffness: np.ndarray, inertia: np.ndarray) -> tuple[np.ndarray, ...]:
        """alpha (n_case,), 1 / ``|c - w / theta_k|`` (n_case, m), eps and nu (n_case,) of theorem 2.

        Parameters
        ----------
        stiffness, inertia : (n_case, 1) ndarray
            c and w.
        """
        c, w = stiffness[:, 0], inertia[:, 0]
        each = 1.0 / np.abs(stiffness - inertia / self.eigenvalue)
        return (amplification_beyond(self.next_bound, c, w), each, w * self.coupling,
                np.abs(c) * self.stiff_deviation + w * self.mass_deviation)
