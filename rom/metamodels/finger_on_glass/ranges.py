"""What the training paths covered; an answer outside is extrapolation."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from rom.finger_on_glass.tissue import VARIANTS
from rom.scenes import PathArrays
from rom.scenes.paths import NUMBERS


@dataclass(frozen=True)
class PathRange:
    """Lowest and highest input of each variant's training paths.

    Parameters
    ----------
    variants : list of str
    low, high : list of list of float
        One row a variant: c, k1, friction, normal force.
    """

    variants: list[str]
    low: list[list[float]]
    high: list[list[float]]

    @classmethod
    def of(cls, paths: PathArrays) -> Self:
        """The range of some paths."""
        present = np.unique(paths.variant)
        rows = [paths.numbers[paths.variant == v] for v in present]
        return cls([VARIANTS[v] for v in present], [r.min(axis=0).tolist() for r in rows],
                   [r.max(axis=0).tolist() for r in rows])

    def reasons(self, paths: PathArrays) -> list[str]:
        """For each path the first input that lies outside, or nothing.

        The corners of the box that no training path came near are not seen: the box is not the hull.
        """
        found = []
        for variant, values in zip(paths.variant, paths.numbers, strict=True):
            text = ""
            if VARIANTS[variant] in self.variants:
                row = self.variants.index(VARIANTS[variant])
                ranges = zip(values, self.low[row], self.high[row], NUMBERS.items(), strict=True)
                for value, low, high, (name, unit) in ranges:
                    if not low <= value <= high:
                        text = f"{name} {value:.4g}{' ' + unit if unit != '1' else ''} lies outside the trained " \
                               f"{low:.4g} to {high:.4g}"
                        break
            else:
                text = f"the variant {VARIANTS[variant]} was never learned"
            found.append(text)
        return found

    def to_dict(self) -> dict[str, Any]:
        """JSON-able."""
        return asdict(self)

    @classmethod
    def from_dict(cls, record: dict[str, Any]) -> Self:
        """The inverse of :meth:`to_dict`."""
        return cls(**record)
