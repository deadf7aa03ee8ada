"""From a state to what is shown: the field, figures at the loaded nodes, residual, bound, strain, frequency response.

Everything is computed on free degrees of freedom in double precision; only the picture is rounded to single.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rom.errors import SolverError
from rom.fingertip import TISSUES
from rom.fingertip.mesh import MILLIMETRE
from rom.interactive import state as states
from rom.interactive.cut import Section, section
from rom.interactive.models import REFERENCE, Models
from rom.interactive.receptance import natural_frequencies, response_at
from rom.interactive.receptors import ReceptorStrain
from rom.interactive.state import Limits, State
from rom.interactive.surface import Surface, surface_of
from rom.scenes import CaseArrays, LinearScene

SWEEP = np.linspace(2.0, 300.0, 150)
"""Frequencies of a frequency response [Hz]."""
MOST_SECTIONS = 32
"""Plane sections kept; a slider asks for the same ones again and again."""
SUMMED = "single-force answers summed, which linearity makes exact"


@dataclass(frozen=True, eq=False)
class Answer:
    """The answer to a state.

    Parameters
    ----------
    values : (n_free,) ndarray [m]
        Complex amplitudes; real at 0 Hz.
    seconds : float
        Wall time of the evaluation alone.
    bound : float or None
        Of the relative error in the energy norm, where the method knows one.
    validity : str
        Why the method does not stand behind the answer; empty where it does.
    note : str
        What else should be known of it.
    """

    values: np.ndarray
    seconds: float
    bound: float | None = None
    validity: str = ""
    note: str = ""


class Engine:
    """Answers of one fingertip's models.

    Parameters
    ----------
    models : Models
    """

    def __init__(self, models: Models) -> None:
        self.models = models
        self.tip = models.tip
        self.surface: Surface = surface_of(self.tip)
        self.limits = Limits.of(self.tip, self.surface.vertex_node.tolist())
        self._pad_row = {int(node): i for i, node in enumerate(self.tip.mesh.pad_nodes)}
        self._sections: OrderedDict[tuple[str, float], Section] = OrderedDict()
        self._keeping = threading.Lock()
        self.direct_seconds: dict[bool, float] = {}
        """Wall time of the quickest direct solve so far, by whether it was of a moving state: a busy moment must not
        make other methods look faster."""

    # ---- the answer -----------------------------------------------------------------------------------------

    def scene(self, state: State) -> LinearScene:
        """The scene whose question a state asks."""
        return self.models.scene(state.harmonic)

    def cases(self, state: State, scene: LinearScene) -> CaseArrays:
        """The state as one case of a scene; at 0 Hz a harmonic scene's case has no loss."""
        node = np.array([[self._pad_row[node] for node, _ in state.forces]])
        force = np.array([[amplitude for _, amplitude in state.forces]])
        if not scene.harmonic:
            return CaseArrays(node, force)
        loss_factor = state.loss_factor if state.harmonic else 0.0
        return CaseArrays(node, force, np.array([state.frequency]), np.array([loss_factor]))

    def answer(self, state: State) -> Answer:
        """Answer a state with its method, one of those that do not factorise.

        Raises
        ------
        ValueError
            Where the method cannot be chosen for this state; says why.
        """
        model = self.models.model(state.method, state.harmonic)
        cases, note = self.cases(state, model.scene), ""
        if model.learns and model.scene.max_forces < cases.node.shape[1]:
            cases, note = _each_force(cases), SUMMED
        start = time.perf_counter()
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            values = model.evaluate(cases, "field")
        values = values.sum(axis=0) if note else values[0]
        if not state.harmonic and np.iscomplexobj(values):
            values = np.ascontiguousarray(values.real)
        seconds = time.perf_counter() - start
        check_finite(values)
        found = model.quick_assessment(cases) if not model.learns and not note else None
        if found is None or found.kind == "none":
            return Answer(values, seconds, None, self.validity(*model.reasons(cases).tolist()), note)
        bound = float(found.error[0]) if found.kind == "bound" and np.isfinite(found.error[0]) else None
        return Answer(values, seconds, bound, self.validity(*found.reason.tolist()), note)

    def picture(self, state: State) -> tuple[Answer, dict[str, Any], dict[str, np.ndarray]]:
        """Answer a state and show the answer."""
        answer = self.answer(state)
        return answer, *self.shown(state, answer)

    def validity(self, *reasons: str) -> str:
        """Reasons not to stand behind an answer as one clause, the fingertip's own among them; each once."""
        return "; ".join(dict.fromkeys(reason for reason in (*reasons, *self.models.harmonic.doubts) if reason))

    def assemble(self) -> None:
        """Make stiffness and mass, which residuals need and answers do not."""
        _ = self.models.harmonic.model.matrices

    def residual(self, state: State, values: np.ndarray) -> float:
        """``||Z u - f|| / ||f||`` of an answer."""
        scene = self.models.harmonic  # one pair of matrices serves both
        point = (state.frequency, state.loss_factor) if state.harmonic else ()
        force = scene.force_vectors(self.cases(state, scene))[:, 0]
        return float(scene.model.residual(values, force, *point))

    # ---- what is shown of it --------------------------------------------------------------------------------

    def hello(self) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """What the page needs once: methods, ranges, geometry."""
        surface, mesh = self.surface, self.tip.mesh
        header = {
            "title": "The interactive fingertip", "ready": True, "methods": self.models.listed(),
            "quantities": list(states.QUANTITIES), "tissues": list(TISSUES), "pad_center": self.limits.pad_center,
            "n_nodes": mesh.n_nodes, "n_free": len(self.tip.free_dofs), "loadable": len(mesh.pad_nodes),
            "receptor_depth_mm": self.strain.depth,
            "ranges": {"amplitude": list(states.AMPLITUDE), "frequency": list(states.FREQUENCY),
                       "loss_factor": list(states.LOSS_FACTOR), "forces": [1, states.MOST_FORCES],
                       "cut": {axis: list(ends) for axis, ends in self.limits.extent.items()}},
            "default": State(((self.limits.pad_center, states.DEFAULT_AMPLITUDE),)).to_json()}
        return header, {
            "vertices": surface.vertices.astype("f4"), "triangles": surface.triangles.astype("u4"),
            "vertex_node": surface.vertex_node.astype("u4"), "vertex_normal": surface.vertex_normal.astype("f4"),
            "vertex_tissue": surface.vertex_tissue.astype("u1"), "pad_vertex": surface.pad_vertex.astype("u4"),
            "bone_vertices": surface.bone_vertices.astype("f4"), "bone_triangles": surface.bone_triangles.astype("u4")}

    def shown(self, state: State, answer: Answer) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Figures and arrays of the picture of an answer."""
        full = self.on_nodes(answer.values)
        at_vertices = full[self.surface.vertex_node]
        size = np.sqrt(np.sum(np.abs(full) ** 2, axis=1))
        largest = int(np.argmax(size))
        header: dict[str, Any] = {
            "method": state.method, "seconds": answer.seconds, "bound": answer.bound, "validity": answer.validity,
            "note": answer.note, "residual": None, "speedup": self.speedup(state, answer.seconds),
            "probes": [self._probe(node, full) for node, _ in state.forces],
            "largest": {"node": largest, "magnitude": float(size[largest])}}
        if state.probe is not None:
            header["probe"] = self._probe(state.probe, full)
        arrays = {"u": _parts(at_vertices)}
        if state.cut is not None:
            arrays["cut_u"] = _parts(self.section(*state.cut).field(full))
        if state.quantity == "strain":
            strain = np.full(len(self.surface.vertex_node), np.nan, dtype="f4")
            strain[self.surface.pad_vertex] = self.strain.at_pad_nodes(answer.values)
            arrays["strain"] = strain
        return header, arrays

    def time_direct(self, state: State, seconds: float) -> None:
        """Take note of how long a direct solve took."""
        self.direct_seconds[state.harmonic] = min(seconds, self.direct_seconds.get(state.harmonic, seconds))

    def speedup(self, state: State, seconds: float) -> float | None:
        """Direct's time over this, or None until a direct solve of the same kind was timed on this machine."""
        direct = self.direct_seconds.get(state.harmonic)
        return None if direct is None or seconds <= 0 else direct / seconds

    def on_nodes(self, values: np.ndarray) -> np.ndarray:
        """(n_node, 3) ndarray [m] of an answer (n_free,)."""
        full = np.zeros(3 * self.tip.mesh.n_nodes, dtype=values.dtype)
        full[self.tip.free_dofs] = values
        return full.reshape(-1, 3)

    def _probe(self, node: int, full: np.ndarray) -> dict[str, Any]:
        u = full[node]
        mesh, normal = self.tip.mesh, None
        if node < len(mesh.skin_nodes):
            inward = complex(-(u @ mesh.normals[node]))
            normal = [inward.real, inward.imag]
        return {"node": node, "u": [[float(one.real), float(one.imag)] for one in u], "normal": normal}

    # ---- cut, strain, frequency response --------------------------------------------------------------------

    def section(self, axis: str, position: float) -> Section:
        """The plane section at a position [mm]; the latest are kept."""
        key = (axis, position)
        with self._keeping:
            if key in self._sections:
                self._sections.move_to_end(key)
                return self._sections[key]
        found = section(self.tip.mesh, axis, position)
        with self._keeping:
            self._sections[key] = found
            while len(self._sections) > MOST_SECTIONS:
                self._sections.popitem(last=False)
        return found

    def cut(self, state: State) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Geometry of the section that a state shows."""
        if state.cut is None:
            raise ValueError("the state has no cut: give an axis and a position in mm")
        found = self.section(*state.cut)
        return {"cut": list(state.cut)}, {
            "cut_vertices": (found.vertices / MILLIMETRE).astype("f4"), "cut_triangles": found.triangles.astype("u4"),
            "cut_tissue": found.tissue.astype("u1")}

    @cached_property
    def strain(self) -> ReceptorStrain:
        """Strain at receptor depth."""
        return ReceptorStrain(self.tip)

    def frequency_response(self, state: State, node: int) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Normal displacement at a surface node over frequency under the state's forces, by the reference method.

        Raises
        ------
        ValueError
            For a node that is not on the skin or held.
        """
        mesh = self.tip.mesh
        mesh.check_skin_node(node)
        rows = np.searchsorted(self.tip.free_dofs, 3 * node + np.arange(3))
        if rows[-1] >= len(self.tip.free_dofs) or self.tip.free_dofs[rows[0]] != 3 * node:
            raise ValueError(f"node {node} is held and does not move: choose another")
        model = self.models.model(REFERENCE, True)
        one = self.cases(state, self.models.harmonic)
        count = len(SWEEP)
        cases = CaseArrays(np.repeat(one.node, count, axis=0), np.repeat(one.force, count, axis=0), SWEEP,
                           np.full(count, state.loss_factor))
        start = time.perf_counter()
        found = response_at(model, cases, rows) @ -mesh.normals[node]  # type: ignore[arg-type]
        seconds = time.perf_counter() - start
        return {"node": node, "seconds": seconds, "method": REFERENCE}, {
            "frequency": SWEEP, "receptance": np.stack([found.real, found.imag], axis=-1),
            "natural_frequencies": natural_frequencies(model, states.FREQUENCY[1])}  # type: ignore[arg-type]


def check_finite(values: np.ndarray) -> None:
    """Raise SolverError where an answer is not finite."""
    if not np.isfinite(values).all():
        raise SolverError("there is no finite answer here, at an undamped resonance: give a loss factor above zero, or "
                          "another frequency")


def _each_force(cases: CaseArrays) -> CaseArrays:
    """A case of several forces as cases of one force each."""
    count = cases.node.shape[1]
    point = (None if values is None else np.repeat(values, count) for values in (cases.frequency, cases.loss_factor))
    return CaseArrays(cases.node.reshape(-1, 1), cases.force.reshape(-1, 1), *point)


def _parts(values: np.ndarray) -> np.ndarray:
    """(..., 2) ndarray of float32: real and imaginary parts."""
    return np.stack([values.real, values.imag], axis=-1).astype("f4")
