"""Errors of many cases put together by what they have in common."""

from __future__ import annotations

import numpy as np

from rom.comparison.errors import statistics
from rom.scenes import LinearScene

MISSING = np.nan


def largest_by(error: np.ndarray, key: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(len(values),) ndarray: the largest error where ``key`` equals each of ``values``; NaN where none does."""
    out = np.full(len(values), MISSING)
    index = np.clip(np.searchsorted(values, key), 0, len(values) - 1)
    known = np.isclose(values[index], key)
    out[np.unique(index[known])] = -np.inf
    np.maximum.at(out, index[known], error[known])
    return out


class Table:
    """Variables over entries and splits, filled a model at a time.

    Parameters
    ----------
    n_entry, n_split : int
    by : dict of ndarray
        Dimension name to its values, over which largest errors are told apart.
    """

    def __init__(self, n_entry: int, n_split: int, by: dict[str, np.ndarray]) -> None:
        self.by = by
        self.count = np.zeros((n_entry, n_split), dtype=int)
        self.statistics = np.full((3, n_entry, n_split), MISSING)
        self.largest = {name: np.full((n_entry, n_split, len(values)), MISSING) for name, values in by.items()}

    def put(self, entry: int, split: int, error: np.ndarray, held_out: np.ndarray,
            keys: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
        """Take in errors (n,) of cases.

        Parameters
        ----------
        held_out : (n,) ndarray of bool
            Cases within the published ranges that the statistics are over.
        keys : dict
            By dimension: which cases count there, as a mask or positions, and the value of each of those.
        """
        self.count[entry, split] = int(held_out.sum())
        self.statistics[:, entry, split] = statistics(error[held_out])
        for name, (cases, key) in keys.items():
            self.largest[name][entry, split] = largest_by(error[cases], key, self.by[name])

    def variables(self) -> dict[str, tuple]:
        """Named, with units."""
        one = {"units": "1"}
        found: dict[str, tuple] = {"full_scale_count": (("entry", "split"), self.count, {
            "long_name": "held-out cases of the whole population that were evaluated", **one})}
        kinds = {"max": "largest", "p95": "95 % quantile of the", "median": "median"}
        for k, (name, words) in enumerate(kinds.items()):
            found[f"full_scale_{name}"] = (("entry", "split"), self.statistics[k], {
                "long_name": f"{words} relative error over held-out cases of the whole population", **one})
        for name, values in self.largest.items():
            found[f"by_{name}"] = (("entry", "split", name), values, {
                "long_name": f"largest relative error by {name.removeprefix('full_scale_').replace('_', ' ')}", **one})
        return found


def pad_places(scene: LinearScene) -> dict[str, tuple]:
    """Coordinates of the pad's nodes."""
    names = {"pad_x": "distance from the joint towards the tip", "pad_y": "lateral position"}
    return {name: ("pad_node", scene.loads.position[:, k], {"long_name": words, "units": "m"})
            for k, (name, words) in enumerate(names.items())}
