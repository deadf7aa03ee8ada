"""`pod-regression` of load paths: POD coordinates of whole paths by Gaussian process, ridge or neighbours."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from rom.metamodels.contact.kriging import Regressor, fit_regressor
from rom.metamodels.contact.on_modes import OnModes, restored, stored
from rom.scenes import FingerOnGlass

REGRESSORS = ("gp", "ridge", "neighbours")


class ContactRegression(OnModes):
    """POD coordinates of the whole path at once.

    Parameters
    ----------
    rank : int, optional
        Number of displacement modes of each variant; None: all that the training paths span.
    regressor : {"gp", "ridge", "neighbours"}
        Gaussian process with a length scale for each of the four ratios; polynomial of second degree; the nearest
        paths by inverse square distance.
    registration : {"auto", "slip", "none"}
        See :class:`rom.metamodels.contact.on_modes.OnModes`.
    """

    name: ClassVar[str] = "pod-regression"
    summary: ClassVar[str] = "learns POD coordinates of whole paths from four ratios of the inputs, a variant at a time"

    def __init__(self, scene: FingerOnGlass, rank: int | None = 40, regressor: str = "gp",
                 registration: str = "auto") -> None:
        if regressor not in REGRESSORS:
            raise ValueError(f"regressor={regressor!r} is unknown: choose from {', '.join(REGRESSORS)}")
        super().__init__(scene, rank, registration, regressor=regressor)

    def _forget(self) -> None:
        super()._forget()
        self._regressors: dict[int, Regressor] = {}

    @property
    def model_bytes(self) -> int:
        return super().model_bytes + sum(found.nbytes for found in self._regressors.values())

    def _learn(self, v: int, features: np.ndarray, target: np.ndarray) -> None:
        self._regressors[v] = fit_regressor(self.settings["regressor"], features, target.reshape(len(target), -1))

    def _coordinates(self, v: int, features: np.ndarray) -> np.ndarray:
        return self._regressors[v](features).reshape(len(features), *self._means[v].shape)

    def _learned(self, v: int) -> dict[str, np.ndarray]:
        return stored(self._regressors[v])

    def _keep_learned(self, v: int, arrays: dict[str, np.ndarray]) -> None:
        self._regressors[v] = restored(self.settings["regressor"], arrays)
