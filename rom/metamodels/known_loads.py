"""Which of a scene's loads a method is made for: all, or those that some cases name."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from rom.checks import whole_number
from rom.scenes import CaseArrays, LinearScene


class KnownLoads:
    """Columns of the scene's unit loads, and their places among those that a method knows.

    Parameters
    ----------
    scene : LinearScene
    loads : iterable of int, optional
        Columns of ``unit_loads``; default: all.

    Raises
    ------
    ValueError
        For a column that the scene has not, one that is named twice, or none.
    """

    def __init__(self, scene: LinearScene, loads: Iterable[int] | None = None) -> None:
        self.scene = scene
        self.setting: list[int] | None = None
        if loads is not None:
            self.setting = [whole_number("a load", load, 0, scene.n_loads - 1) for load in loads]
            if not self.setting or len(set(self.setting)) < len(self.setting):
                raise ValueError(f"loads={self.setting} cannot be: name one or more loads, each once")
            self._place = np.full(scene.n_loads, -1)
            self._place[self.setting] = np.arange(len(self.setting))

    @property
    def columns(self) -> np.ndarray:
        """(n_free, n) ndarray: the unit loads."""
        return self.scene.unit_loads if self.setting is None else self.scene.unit_loads[:, self.setting]

    @property
    def index(self) -> np.ndarray:
        """(n,) ndarray of int: which they are."""
        return np.arange(self.scene.n_loads) if self.setting is None else np.array(self.setting)

    def placed(self, cases: CaseArrays) -> CaseArrays:
        """The same cases with places among the known loads for nodes; ValueError where a case names another."""
        if self.setting is None:
            return cases
        node = self._place[cases.node]
        if ((node < 0) & (cases.force != 0.0)).any():
            wrong = int(cases.node[(node < 0) & (cases.force != 0.0)][0])
            raise ValueError(f"load {wrong} is not among the {len(self.setting)} that this model was made for: "
                             "give loads= that hold it, or leave it out")
        return CaseArrays(np.maximum(node, 0), cases.force, cases.frequency, cases.loss_factor)
