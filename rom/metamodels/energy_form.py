"""Energies of combinations of stored fields, from their products in K: from above and below, rounding included."""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from rom.fullorder.energy_norm import SUMS, UNIT, EnergyNorm, block_product, gamma
from rom.metamodels.stored import Stored


class EnergyForm:
    """``||sum_j s_j v_j||`` of some of the fields v_1 ... v_L.

    Parameters
    ----------
    matrix : (L, L) ndarray
        v_i^T K v_j.
    size : (L,) ndarray
        Sizes of the fields, as :meth:`EnergyNorm.size` has them.
    slack : float
        Rounding of the matrix, in units of sizes.
    spread : float
        See :class:`EnergyNorm`.
    """

    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("matrix", ("load", "other_load"), "products in K"), Stored("size", ("load",), "size of each field"),
        Stored("slack"), Stored("spread"))

    def __init__(self, matrix: np.ndarray, size: np.ndarray, slack: float, spread: float) -> None:
        self.matrix, self.size, self.slack, self.spread = matrix, size, slack, spread

    @classmethod
    def of(cls, energy: EnergyNorm, fields: np.ndarray) -> Self:
        """The form of fields (L, n)."""
        product, terms = block_product(fields, energy.model.stiffness @ fields.T)
        slack = (gamma(terms + energy.row_length + 4) * energy.spread + energy.asymmetry) * SUMS
        return cls(0.5 * (product + product.T), energy.size(fields), slack, energy.spread)

    @cached_property
    def _single(self) -> tuple[np.ndarray, np.ndarray]:
        square, doubt = self.matrix.diagonal(), (self.slack + 8 * UNIT * self.spread) * self.size ** 2
        return np.sqrt(np.maximum(square - doubt, 0.0)), np.sqrt(np.maximum(square + doubt, 0.0))

    def norms(self, index: np.ndarray, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest norm of ``sum_j number[i, j] v_index[i, j]``, (n_case,) each.

        Parameters
        ----------
        index : (n_case, k) ndarray of int
        number : (n_case, k) ndarray
            Real or complex.
        """
        if index.shape[1] == 1:
            strength = np.abs(number[:, 0])
            return strength * self._single[0][index[:, 0]], strength * self._single[1][index[:, 0]]
        pairs = self.matrix[index[:, :, None], index[:, None, :]]
        square = np.einsum("ci,cij,cj->c", number.conj(), pairs, number).real
        doubt = self.slack + (index.shape[1] ** 2 + 8) * UNIT * self.spread
        doubt = doubt * np.einsum("ci,ci->c", np.abs(number), self.size[index]) ** 2
        return np.sqrt(np.maximum(square - doubt, 0.0)), np.sqrt(np.maximum(square + doubt, 0.0))


def merged(index: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Numbers (n_case, k) with those of equal index added up in the first place: what cancels there cancels exactly."""
    if index.shape[1] == 1:
        return number
    number = number.copy()
    for j in range(1, index.shape[1]):
        for i in range(j):
            same = index[:, i] == index[:, j]
            number[same, i] += number[same, j]
            number[same, j] = 0.0
    return number
