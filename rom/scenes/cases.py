"""The inputs of a block of cases: as plain arrays, and what they may be worth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

LARGEST = {"Hz": 1e9, "1": 1e6, "rad": 1e9, "N": 1e100}
"""Magnitudes up to which answers and their squares stay within the range of double precision, by unit."""
SMALLEST_FORCE = 1e-100
"""Below this a force's squares vanish to zero [N]."""
NO_FORCE, NO_WORD = -1, "none"
"""Stand in the variables that name a load where a case has fewer forces than the dataset has room for."""


@dataclass(frozen=True, eq=False, slots=True)
class CaseArrays:
    """The inputs of a block of cases as plain arrays: what the lean calls take.

    Parameters
    ----------
    node : (n_case, n_force) ndarray of int
        Column of the load in the scene's ``unit_loads`` (not a mesh node id); any column where the force is zero.
    force : (n_case, n_force) ndarray [N]
        What the unit load is multiplied by; complex where forces have phases.
    frequency : (n_case,) ndarray [Hz] or None
    loss_factor : (n_case,) ndarray or None
    """

    node: np.ndarray
    force: np.ndarray
    frequency: np.ndarray = None  # type: ignore[assignment]  # static scenes have none and never read it
    loss_factor: np.ndarray = None  # type: ignore[assignment]

    def __len__(self) -> int:
        """Number of cases."""
        return len(self.node)

    def __iter__(self) -> Iterator[np.ndarray]:
        """The four fields, in order."""
        return iter((self.node, self.force, self.frequency, self.loss_factor))

    def take(self, index) -> CaseArrays:
        """The cases at ``index`` (slice, mask or integers)."""
        return CaseArrays(*(a if a is None else a[index] for a in self))

    def joined(self, other: CaseArrays) -> CaseArrays:
        """These cases, then the others, padded to the same number of forces."""
        width = max(self.node.shape[1], other.node.shape[1])
        pairs = zip(self, other, strict=True)
        return CaseArrays(*(a if a is None or b is None else np.concatenate([_padded(a, width), _padded(b, width)])
                            for a, b in pairs))


def _padded(values: np.ndarray, width: int) -> np.ndarray:
    return values if values.ndim == 1 else np.pad(values, ((0, 0), (0, width - values.shape[1])))


def finite(values: np.ndarray, name: str, unit: str) -> np.ndarray:
    """``values`` as real floating-point numbers.

    Raises
    ------
    ValueError
        For other kinds, NaN and infinity, and magnitudes beyond :data:`LARGEST` or below :data:`SMALLEST_FORCE`.
    """
    if values.dtype.kind not in "iuf":
        raise ValueError(f"{name} is of type {values.dtype}: every value must be a real number of {unit}")
    values = values.astype(float)
    if not np.isfinite(values).all():
        bad = values[~np.isfinite(values)].ravel()[0]
        raise ValueError(f"{name} holds {bad}: every value must be a finite number of {unit}; mend or drop the case")
    size = np.abs(values)
    wrong = size > LARGEST[unit]
    if unit == "N":
        wrong |= (size > 0) & (size < SMALLEST_FORCE)
    if wrong.any():
        least = f"zero, or from {SMALLEST_FORCE:g}" if unit == "N" else "zero"
        raise ValueError(f"{name} holds {values[wrong].ravel()[0]:g}: its magnitude must be {least} to "
                         f"{LARGEST[unit]:g}, as squares leave the range of double precision beyond; give another unit "
                         "or drop the case")
    return values
