"""Metamodels that learn how the POD coordinates of a whole path follow from its inputs, a variant at a time."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
import xarray as xr

from rom.collagen.tissue import VARIANTS
from rom.datasets.contact_schema import QUANTITIES
from rom.metamodels.contact.base import Answers, ContactMetamodel
from rom.metamodels.contact.features import dimensionless
from rom.metamodels.contact.pod import FIELDS, SCALARS, PathSpace
from rom.scenes import FingerOnGlass, PathArrays

PROFILE_WEIGHT, SCALAR_WEIGHT = 0.3, 0.2
"""Of the relative errors of profiles and scalars, beside one for those of the displacement, in what a fit minimises."""


class OnModes(ContactMetamodel):
    """POD coordinates from a regression; the subclasses say which.

    Parameters
    ----------
    rank : int, optional
        Number of displacement modes of each variant; None: all that the training paths span.
    """

    least_paths = 3

    def __init__(self, scene: FingerOnGlass, rank: int | None, **settings: Any) -> None:
        if rank is not None and (isinstance(rank, bool) or not isinstance(rank, int) or rank < 1):
            raise ValueError(f"rank={rank!r} cannot be: give one or more, or None for all")
        super().__init__(scene, rank=rank, **settings)
        self._forget()

    def _forget(self) -> None:
        self._spaces: dict[int, PathSpace] = {}
        self._means: dict[int, np.ndarray] = {}
        self._sizes: dict[int, np.ndarray] = {}

    @property
    def model_bytes(self) -> int:
        return sum(space.nbytes + self._means[v].nbytes + self._sizes[v].nbytes for v, space in self._spaces.items())

    def _fit(self, train: xr.Dataset) -> None:
        paths = self.scene.case_arrays(train)
        self._forget()
        for v in map(int, np.unique(paths.variant)):
            rows = np.flatnonzero(paths.variant == v)
            mine = paths.take(rows)
            answers = {name: train[name].values[rows] for name in QUANTITIES}
            space = PathSpace.of(self.scene, answers, self.settings["rank"])
            state = space.encode(mine, answers)
            self._spaces[v], self._means[v] = space, state.mean(axis=0)
            self._sizes[v] = _sizes(space, state, answers["displacement"])
            self._learn(v, dimensionless(mine), (state - self._means[v]) / self._sizes[v])

    @abstractmethod
    def _learn(self, v: int, features: np.ndarray, target: np.ndarray) -> None:
        """Learn (n_path, n_position, size) scaled coordinates of a variant from (n_path, 4) features."""

    @abstractmethod
    def _coordinates(self, v: int, features: np.ndarray) -> np.ndarray:
        """(n_path, n_position, size) ndarray: what was learned."""

    def _evaluate(self, paths: PathArrays, positions: np.ndarray, outputs: str) -> Answers:
        found: Answers = {}
        for v in map(int, np.unique(paths.variant)):
            rows = np.flatnonzero(paths.variant == v)
            mine = paths if len(rows) == len(paths) else paths.take(rows)
            state = self._coordinates(v, dimensionless(mine))[:, positions] * self._sizes[v][positions]
            part = self._spaces[v].decode(mine, state + self._means[v][positions], outputs)
            if len(rows) == len(paths):
                return part
            for name, values in part.items():
                found.setdefault(name, np.empty((len(paths), *values.shape[1:])))[rows] = values
        return found

    def best_approximation(self, paths: PathArrays, displacement: np.ndarray) -> np.ndarray:
        out = np.empty_like(displacement)
        for v in map(int, np.unique(paths.variant)):
            rows = paths.variant == v
            out[rows] = self._spaces[v].project(displacement[rows])
        return out

    # ---- files ----------------------------------------------------------------------------------------------

    def _state(self) -> xr.Dataset:
        data: dict[str, tuple] = {}
        for v, space in self._spaces.items():
            name = VARIANTS[v]
            arrays = {"mean": self._means[v], "size": self._sizes[v],
                      **{f"mode_{field}": modes for field, modes in space.modes.items()}, **self._learned(v)}
            for key, array in arrays.items():
                # a dimension of each array's own: ranks differ between variants
                data[f"{name}_{key}"] = (tuple(f"{name}_{key}_{axis}" for axis in range(array.ndim)), array)
        return xr.Dataset(data)

    def _restore(self, data: xr.Dataset) -> None:
        self._forget()
        for name in self.trained.variants if self.trained else ():
            v, prefix = VARIANTS.index(name), f"{name}_"
            arrays = {str(key)[len(prefix):]: data[key].values for key in data if str(key).startswith(prefix)}
            self._spaces[v] = PathSpace(self.scene, {f: arrays.pop(f"mode_{f}") for f in FIELDS})
            self._means[v], self._sizes[v] = arrays.pop("mean"), arrays.pop("size")
            self._keep_learned(v, arrays)

    @abstractmethod
    def _learned(self, v: int) -> dict[str, np.ndarray]:
        """What was learned of a variant, as arrays."""

    @abstractmethod
    def _keep_learned(self, v: int, arrays: dict[str, np.ndarray]) -> None:
        """The inverse of :meth:`_learned`; KeyError where an array is missing."""


def _sizes(space: PathSpace, state: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """(n_position, size) ndarray by which coordinates are divided, so that equal errors of them weigh as wanted."""
    sizes = np.empty(state.shape[1:])
    length = np.linalg.norm(displacement.reshape(*state.shape[:2], -1), axis=2).mean(axis=0)
    sizes[:, space.start["displacement"]] = length[:, None]
    for name in ("pressure", "shear"):
        level = np.linalg.norm(state[..., space.start[name]], axis=2).mean()
        sizes[:, space.start[name]] = max(level, 1e-300) / PROFILE_WEIGHT
    spread = state[..., :len(SCALARS)].std(axis=(0, 1))
    sizes[:, :len(SCALARS)] = np.maximum(spread, 1e-12) / SCALAR_WEIGHT
    return sizes
