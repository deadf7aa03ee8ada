"""Two methods as a stranger would write them: one of linear scenes, one of the finger on glass."""

from typing import ClassVar

import numpy as np

from rom.metamodels import Metamodel, Stored
from rom.metamodels.basis import room
from rom.scenes import LinearScene


class StaticResponse(Metamodel):
    """Without inertia: the static response over the complex stiffness."""

    name: ClassVar[str] = "static-response"
    summary: ClassVar[str] = "answers as if nothing had mass"
    stored = (Stored("responses", ("load", "dof"), "static response to a unit load", "m N-1"),)

    @classmethod
    def why_not(cls, scene):
        return None if isinstance(scene, LinearScene) else "it adds up responses"

    def _fit(self, train):
        self.responses = self.scene.model.solve_static(self.scene.unit_loads).T

    def _evaluate(self, cases, outputs, out):
        rows = self.responses if outputs == "field" else self.responses[:, self.scene.part_rows]
        out = room(out, len(cases), rows.shape[1], self.scene.dtype)
        out[:] = np.einsum("cf,cfn->cn", cases.force, rows[cases.node])
        if self.scene.harmonic:
            out /= (1 + 1j * cases.loss_factor)[:, None]
        return out


class MeanPath(Metamodel):
    """The mean of all training paths, whatever is asked."""

    name: ClassVar[str] = "mean-path"
    summary: ClassVar[str] = "answers with the mean of what it has seen"
    learns: ClassVar[bool] = True
    stored = (Stored("mean"),)

    @classmethod
    def why_not(cls, scene):
        return None if scene.name == "finger-on-glass" else "it has seen load paths alone"

    def _fit(self, train):
        self.mean = {name: values.mean(axis=0) for name, values in self.scene.values(train).items()}

    def _evaluate(self, cases, outputs, out):
        names = [name for name, quantity in self.scene.quantities.items()
                 if outputs == "field" or name not in ("displacement", "stretch_z")]
        return {name: np.repeat(self.mean[name][None], len(cases), axis=0) for name in names}
