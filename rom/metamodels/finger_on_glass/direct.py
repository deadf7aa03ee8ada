"""The full-order model in the metamodels' row, and the same on a coarser section."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.datasets.contact_schema import wanted
from rom.datasets.path_solutions import solve_path, warm_up
from rom.metamodels.contact.base import Answers, ContactMetamodel
from rom.scenes import FingerOnGlass, PathArrays


class ContactDirect(ContactMetamodel):
    """Follow each path with the full-order model."""

    name: ClassVar[str] = "direct"
    summary: ClassVar[str] = "follows the whole path with the full-order model, strictly converged"
    learns: ClassVar[bool] = False

    def __init__(self, scene: FingerOnGlass) -> None:
        super().__init__(scene)

    @property
    def model_bytes(self) -> int:
        """Element tangents and the assembled tangent; its factor estimated at ten times as many entries [byte]."""
        return 8 * 81 * len(self.scene.mesh.quads) + 11 * 12 * 18 * 2 * self.scene.n_nodes

    def _fit(self, train: xr.Dataset | None) -> None:
        warm_up()  # compiling belongs to the offline stage

    def _evaluate(self, paths: PathArrays, positions: np.ndarray, outputs: str) -> Answers:
        return self._follow(paths, positions, outputs)[0]

    def _answer(self, paths: PathArrays) -> tuple[Answers, list[str]]:
        return self._follow(paths, np.arange(self.scene.n_positions), self.scene.outputs)

    def _follow(self, paths: PathArrays, positions: np.ndarray, outputs: str) -> tuple[Answers, list[str]]:
        found, reasons = [], []
        for i in range(len(paths)):
            values, record = self._one(paths, i)
            found.append({name: values[name][positions] for name in wanted(outputs)})
            reasons.append(record["reason"])
        return {name: np.stack([values[name] for values in found]) for name in wanted(outputs)}, reasons

    def _one(self, paths: PathArrays, i: int) -> tuple[dict[str, np.ndarray], dict]:
        return solve_path(self.scene, paths, i)

    def _state(self) -> xr.Dataset:
        return xr.Dataset()  # the scene in the attributes is all that it is

    def _restore(self, data: xr.Dataset) -> None:
        self._fit(None)
