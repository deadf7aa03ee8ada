"""The full-order model in the metamodels' row, and the same on a coarser section."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.metamodels.facts import Needs
from rom.metamodels.finger_on_glass.glass import joined_reasons, not_on_glass
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.validity import Assessment
from rom.scenes import Answers, Scene
from rom.scenes.finger_on_glass import FingerOnGlass, warm_up
from rom.scenes.path_answers import solve_path, wanted
from rom.scenes.paths import PathArrays


class PathDirect(Metamodel):
    """Follow each path with the full-order model."""

    name: ClassVar[str] = "direct"
    summary: ClassVar[str] = "follows the whole path with the full-order model, strictly converged"
    colour: ClassVar[str] = "#000000"
    full_order: ClassVar[bool] = True
    slow: ClassVar[int] = 16

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_on_glass(scene)

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(solves=True)

    def __init__(self, scene: FingerOnGlass) -> None:
        super().__init__(scene)

    @property
    def model_bytes(self) -> int:
        """Element tangents and the assembled tangent; its factor estimated at ten times as many entries [byte]."""
        return 8 * 81 * len(self.scene.mesh.quads) + 11 * 12 * 18 * 2 * self.scene.n_nodes

    def _fit(self, train: xr.Dataset | None) -> None:
        warm_up()  # compiling belongs to the offline stage

    def _evaluate(self, cases: PathArrays, outputs: str, out: np.ndarray | None) -> Answers:
        return self._follow(cases, outputs)[0]

    def answer(self, cases: PathArrays) -> tuple[Answers, Assessment]:
        self._check_fitted()
        answers, early = self._follow(cases, self.scene.outputs)
        return answers, Assessment.unknown(joined_reasons(self.reasons(cases), early), named=False)

    def _follow(self, paths: PathArrays, outputs: str) -> tuple[Answers, list[str]]:
        found = [self._one(paths, i) for i in range(len(paths))]
        return ({name: np.stack([values[name] for values, _ in found]) for name in wanted(outputs)},
                [record["reason"] for _, record in found])

    def _one(self, paths: PathArrays, i: int) -> tuple[dict[str, np.ndarray], dict]:
        return solve_path(self.scene, paths, i)

    def _restored(self, data: xr.Dataset) -> None:
        self._fit(None)  # the scene in the attributes is all that it is
