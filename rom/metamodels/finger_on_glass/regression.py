"""`pod-regression` of load paths: POD coordinates of whole paths by Gaussian process, ridge or neighbours."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from rom.checks import choice
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.finger_on_glass.kriging import Regressor, fit_regressor
from rom.metamodels.finger_on_glass.on_modes import STORED, OnModes, restored, stored
from rom.scenes import Scene
from rom.scenes.finger_on_glass import FingerOnGlass

REGRESSORS = ("gp", "ridge", "knn")
STAGES = ("press", "slide")
"""Learned apart: friction hardly matters to the first and rules the second, so that length scales differ."""


class PathRegression(OnModes):
    """POD coordinates of all positions of a stage at once: pressing, then sliding.

    Parameters
    ----------
    rank : int, optional
        Number of displacement modes of each variant; None: all that the training paths span.
    regressor : {"gp", "ridge", "knn"}
        Gaussian process with a length scale for each of the four ratios; polynomial of second degree; the nearest
        paths by inverse square distance.
    registration : {"auto", "slip", "none"}
        See :class:`rom.metamodels.finger_on_glass.on_modes.OnModes`.
    """

    name: ClassVar[str] = "pod-regression"
    colour: ClassVar[str] = "#44AA99"
    summary: ClassVar[str] = "learns POD coordinates of whole paths from four ratios of the inputs, a variant at a time"

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(stiffness=False, regression=True)

    def __init__(self, scene: FingerOnGlass, rank: int | None = 40, regressor: str = "gp",
                 registration: str = "auto") -> None:
        choice("regressor", regressor, REGRESSORS)
        super().__init__(scene, rank, registration, regressor=regressor)

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve((*({"regressor": name} for name in ("ridge", "knn")), *({"rank": rank} for rank in (10, 20, 40))))

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"rank": 8},))

    def _forget(self) -> None:
        super()._forget()
        self._regressors: dict[int, list[Regressor]] = {}

    @property
    def model_bytes(self) -> int:
        return super().model_bytes + sum(
            found.nbytes for pair in self._regressors.values() for found in pair)

    def _learn(self, v: int, features: np.ndarray, target: np.ndarray) -> None:
        kind, press = self.settings["regressor"], self._press
        self._regressors[v] = [fit_regressor(kind, features, part.reshape(len(part), -1))
                               for part in (target[:, :press], target[:, press:])]

    def _coordinates(self, v: int, features: np.ndarray) -> np.ndarray:
        size = self._means[v].shape[1]
        stages = [found(features).reshape(len(features), -1, size) for found in self._regressors[v]]
        return np.concatenate(stages, axis=1)

    def _learned(self, v: int) -> dict[str, np.ndarray]:
        return {f"{stage}_{key}": array for stage, found in zip(STAGES, self._regressors[v], strict=True)
                for key, array in stored(found).items()}

    def _keep_learned(self, v: int, arrays: dict[str, np.ndarray]) -> None:
        kind = self.settings["regressor"]
        self._regressors[v] = [restored(kind, {key: arrays[f"{stage}_{key}"] for key in STORED}) for stage in STAGES]
