"""What the training cases covered; an answer outside is extrapolation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from rom.metamodels.validity import joined
from rom.scenes import Cases, Scene

Ends = tuple[float, float]


@dataclass(frozen=True)
class TrainedRange:
    """Kinds of the training cases (loads, variants), and the lowest and highest of their numbers.

    The corners of the box that no training case came near are not seen: the box is not the hull.

    Parameters
    ----------
    loads : tuple of int
        Kinds that some case had: columns of the unit loads, variants.
    forces : int
        Most of them in one case.
    ranges : dict
        Lowest and highest by the input's name; by kind too where a scene's kinds are learned apart, each under the
        kind's number in words.
    """

    loads: tuple[int, ...]
    forces: int
    ranges: dict[str, Any]

    @classmethod
    def of(cls, scene: Scene, cases: Cases) -> Self:
        """The range of these cases."""
        kinds, numbers = scene.kinds(cases), scene.numbers(cases)
        acting = kinds >= 0
        present = np.unique(kinds[acting])

        def ends(values: np.ndarray) -> list[float]:
            return [float(values.min()), float(values.max())]

        ranges: dict[str, Any] = {
            name: {str(kind): ends(values[(kinds == kind).any(axis=1)]) for kind in present} if scene.kinds_apart
            else ends(values) for name, values in numbers.items()}
        return cls(tuple(present.tolist()), int(acting.sum(axis=1).max(initial=0)), ranges)

    @classmethod
    def from_dict(cls, record: dict[str, Any]) -> Self:
        """The inverse of :meth:`to_dict`."""
        ranges = {name: value for name, value in record.items()
                  if name not in ("loads", "forces") and value is not None}
        return cls(tuple(record["loads"]), record["forces"], ranges)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able."""
        return {"loads": list(self.loads), "forces": self.forces, **self.ranges}

    def unseen(self, scene: Scene, cases: Cases) -> np.ndarray:
        """(n_case,) ndarray of bool: cases of a kind that no training case had."""
        kinds = scene.kinds(cases)
        return ((kinds >= 0) & ~np.isin(kinds, np.asarray(self.loads, dtype=int))).any(axis=1)

    def reasons(self, scene: Scene, cases: Cases) -> np.ndarray:
        """(n_case,) ndarray of str: what lies outside, or nothing."""
        kinds = scene.kinds(cases)
        found = np.where(self.unseen(scene, cases), f"a {scene.kind_noun} that no training case had", "")
        more = (kinds >= 0).sum(axis=1) > self.forces
        found = joined(found, np.where(more, f"more than the {self.forces} forces of any training case", ""))
        for name, values in scene.numbers(cases).items():
            ends = self.ranges.get(name)
            if isinstance(ends, dict):
                for kind in np.unique(kinds):
                    if str(kind) in ends:
                        mine = (kinds == kind).any(axis=1)
                        found = joined(found, self._outside(scene, name, values, tuple(ends[str(kind)]), mine))
            elif ends is not None:
                found = joined(found, self._outside(scene, name, values, tuple(ends), np.ones(len(values), dtype=bool)))
        return found

    @staticmethod
    def _outside(scene: Scene, name: str, values: np.ndarray, ends: Any, mine: np.ndarray) -> np.ndarray:
        low, high = ends
        slack = 1e-9 * max(abs(low), abs(high))
        outside = mine & ((values < low - slack) | (values > high + slack))
        unit = scene.input(name).unit
        text = (f"{name.replace('_', ' ')} outside the {low:.4g} to {high:.4g}{'' if unit == '1' else f' {unit}'} "
                "of training")
        return np.where(outside, text, "")
