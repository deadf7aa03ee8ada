"""Interpolation between stored paths of the same variant: the simple opponent that every reduced model has to beat."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.datasets.contact_schema import QUANTITIES, area_between, wanted
from rom.metamodels.contact.base import Answers, ContactMetamodel
from rom.metamodels.contact.features import dimensionless
from rom.scenes import FingerOnGlass, PathArrays

KINDS = ("radial", "inverse-distance", "nearest")


class ContactInterpolation(ContactMetamodel):
    """Weighted sums of stored paths.

    Parameters
    ----------
    kind : {"radial", "inverse-distance", "nearest"}
        Radial functions r (the polyharmonic spline) with a linear polynomial over all paths of the variant; the
        ``neighbours`` nearest paths by inverse square distance; the nearest path alone.
    neighbours : int
        Of inverse distance.
    """

    name: ClassVar[str] = "interpolation"
    summary: ClassVar[str] = "interpolates between the stored paths of the same variant in four ratios of the inputs"
    least_paths: ClassVar[int] = 1

    def __init__(self, scene: FingerOnGlass, kind: str = "radial", neighbours: int = 5) -> None:
        if kind not in KINDS:
            raise ValueError(f"kind={kind!r} is no interpolation: choose from {', '.join(KINDS)}")
        if isinstance(neighbours, bool) or not isinstance(neighbours, int) or neighbours < 1:
            raise ValueError(f"neighbours={neighbours!r} cannot be: give one or more")
        super().__init__(scene, kind=kind, neighbours=neighbours)
        self._paths: PathArrays
        self._stored: Answers

    @property
    def model_bytes(self) -> int:
        return sum(array.nbytes for array in self._stored.values())

    def _fit(self, train: xr.Dataset) -> None:
        self._keep(self.scene.case_arrays(train), {name: train[name].values for name in QUANTITIES})

    def _keep(self, paths: PathArrays, stored: Answers) -> None:
        self._paths, self._stored = paths, stored
        self._rows = {v: np.flatnonzero(paths.variant == v) for v in np.unique(paths.variant)}
        features = dimensionless(paths)
        self._scale = {v: np.maximum(np.ptp(features[rows], axis=0), 1e-9) for v, rows in self._rows.items()}
        self._features = {v: features[rows] / self._scale[v] for v, rows in self._rows.items()}
        self._inverse = {v: np.linalg.pinv(_system(points)) for v, points in self._features.items()} \
            if self.settings["kind"] == "radial" else {}

    def _weights(self, paths: PathArrays, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the stored paths and their weights, which add up to one."""
        v = int(paths.variant[i])
        rows, points = self._rows[v], self._features[v]
        place = dimensionless(paths.take(slice(i, i + 1))) / self._scale[v]
        distance = np.linalg.norm(points - place, axis=1)
        if self.settings["kind"] == "radial" and len(rows) > place.shape[1] + 1:
            right = np.concatenate([distance, [1.0], place[0]])
            return rows, (right @ self._inverse[v])[:len(rows)]
        count = 1 if self.settings["kind"] == "nearest" else self.settings["neighbours"]
        near = np.argsort(distance, kind="stable")[:count]
        weight = 1.0 / np.maximum(distance[near], 1e-12) ** 2
        return rows[near], weight / weight.sum()

    def _evaluate(self, paths: PathArrays, positions: np.ndarray, outputs: str) -> Answers:
        names = [name for name in wanted(outputs) if name != "contact_area"]
        found: Answers = {name: np.empty((len(paths), len(positions), *self._stored[name].shape[2:])) for name in names}
        every = len(positions) == self.scene.n_positions and (np.diff(positions) == 1).all()
        for i in range(len(paths)):
            rows, weight = self._weights(paths, i)
            for name in names:
                stored = self._stored[name] if every else self._stored[name][:, positions]
                whole = len(rows) == len(stored)
                found[name][i] = np.tensordot(weight, stored if whole else stored[rows], 1)
        return finish(found, outputs)

    def _state(self) -> xr.Dataset:
        numbers = {name: (("stored",), values) for name, values in zip(INPUTS, self._paths, strict=True)}
        return xr.Dataset({**numbers, **{name: (("stored", "position", *QUANTITIES[name].dims), array)
                                         for name, array in self._stored.items()}})

    def _restore(self, data: xr.Dataset) -> None:
        self._keep(PathArrays(*(data[name].values for name in INPUTS)),
                   {name: data[name].values for name in QUANTITIES})


INPUTS = ("input_variant", "input_c", "input_k1", "input_friction", "input_normal_force")


def finish(found: Answers, outputs: str) -> Answers:
    """What follows from the rest: the area from its ends, no tension; quantities in the schema's order."""
    np.maximum(found["pressure"], 0.0, out=found["pressure"])
    found["contact_area"] = area_between(found["contact_left"], found["contact_right"])
    return {name: found[name] for name in wanted(outputs)}


def _system(points: np.ndarray) -> np.ndarray:
    """Matrix of the radial functions r and the linear polynomial beside them; symmetric."""
    n, d = points.shape
    linear = np.column_stack([np.ones(n), points])
    system = np.zeros((n + d + 1, n + d + 1))
    system[:n, :n] = np.linalg.norm(points[:, None] - points[None], axis=2)
    system[:n, n:], system[n:, :n] = linear, linear.T
    return system
