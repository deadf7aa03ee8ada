"""Interpolation between stored paths of the same variant: the simple opponent that every reduced model has to beat."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.checks import choice, whole_number
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.finger_on_glass.features import dimensionless
from rom.metamodels.finger_on_glass.glass import check_learned, not_on_glass
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.stored import Stored
from rom.scenes import Answers, Scene
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.path_answers import QUANTITIES, area_between, wanted
from rom.scenes.paths import PathArrays

KINDS = ("radial", "inverse-distance", "nearest")


class PathInterpolation(Metamodel):
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
    learns: ClassVar[bool] = True
    colour: ClassVar[str] = "#B58900"
    stored: ClassVar[tuple[Stored, ...]] = (Stored("_inputs"), Stored("_stored"))

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve(({"kind": "nearest"}, {"kind": "radial"}))

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve()

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_on_glass(scene)

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(stiffness=False)

    def __init__(self, scene: FingerOnGlass, kind: str = "radial", neighbours: int = 5) -> None:
        choice("kind", kind, KINDS)
        whole_number("neighbours", neighbours, 1)
        super().__init__(scene, kind=kind, neighbours=neighbours)
        self._inputs: dict[str, np.ndarray]
        self._stored: Answers

    @property
    def model_bytes(self) -> int:
        return sum(array.nbytes for array in self._stored.values())

    def _fit(self, train: xr.Dataset) -> None:
        self._keep(self.scene.read(train), self.scene.values(train))

    def _keep(self, paths: PathArrays, stored: Answers) -> None:
        self._inputs, self._stored = dict(zip(INPUTS, paths, strict=True)), stored
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

    def _evaluate(self, cases: PathArrays, outputs: str, out: np.ndarray | None) -> Answers:
        check_learned(self.name, cases, self._rows)
        names = [name for name in wanted(outputs) if name != "contact_area"]
        found: Answers = {name: np.empty((len(cases), *self._stored[name].shape[1:])) for name in names}
        for i in range(len(cases)):
            rows, weight = self._weights(cases, i)
            for name in names:
                stored = self._stored[name]
                found[name][i] = np.tensordot(weight, stored if len(rows) == len(stored) else stored[rows], 1)
        return finish(found, outputs)

    def _restored(self, data: xr.Dataset) -> None:
        self._keep(PathArrays(*(self._inputs[name] for name in INPUTS)),
                   {name: self._stored[name] for name in QUANTITIES})


INPUTS = ("variant", "c", "k1", "friction", "normal_force")


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
