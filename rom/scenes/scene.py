"""A scene is one question: which model, which loads, which inputs vary, which outputs are wanted.

It also says what it does *not* need, and then does not build it. Every method answers the same scene: labelled
cases (`xarray.Dataset`) come in through :meth:`Scene.case_arrays`, plain arrays go out through
:meth:`Scene.label`, so that no method has conventions of its own.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rom.checks import shown
from rom.fingertip import Anatomy, Fingertip, MeshDensity
from rom.fullorder import SecondOrderModel
from rom.scenes.cases import LOAD_VARIABLES, NO_FORCE, CaseArrays, check_shapes, finite, positions_of


@dataclass(frozen=True)
class Scene(ABC):
    """What every scene shares. ``outputs`` is ``"field"`` (every node) or ``"pad"`` (the loadable surface)."""

    fingertip: Fingertip = field(default_factory=lambda: Fingertip.preset("metamodel"))
    outputs: str = "field"

    name: ClassVar[str]
    title: ClassVar[str]
    question: ClassVar[str]
    gate: ClassVar[float]
    """Largest relative error over held-out cases that a metamodel may make to be called trustworthy."""
    harmonic: ClassVar[bool]
    band_hz: ClassVar[float] = 0.0
    """Upper end of the published frequency range [Hz]."""
    max_forces: ClassVar[int]
    """Number of simultaneous forces in the published range; more are extrapolation."""
    load_variables: ClassVar[tuple[str, ...]] = LOAD_VARIABLES
    """Variables of labelled cases that describe each force, (case, force)."""
    defaults: ClassVar[dict[str, Any]] = {}
    """What stands for a variable that labelled cases may leave out."""
    inputs: ClassVar[dict[str, str]]
    needs: ClassVar[dict[str, str]]
    leaves_out: ClassVar[dict[str, str]]
    regions: ClassVar[tuple[str, ...]]
    """The parts of the hard split, in the order of the codes that :meth:`hard_region` returns from 1 up."""

    def __post_init__(self) -> None:
        if not isinstance(self.fingertip, Fingertip):
            raise ValueError(f"the fingertip is {shown(self.fingertip)}: build one with rom.fingertip.Fingertip")
        if not isinstance(self.outputs, str) or self.outputs not in ("field", "pad"):
            raise ValueError(f"outputs={shown(self.outputs)} is unknown: a scene can want 'field' or 'pad'")

    # ---- the model ------------------------------------------------------------------------------------------

    @cached_property
    def full_order(self) -> SecondOrderModel:
        """The full-order model of this scene, without a mass matrix where the scene is static."""
        mass = self.fingertip.mass if self.harmonic else None
        return SecondOrderModel(self.fingertip.stiffness, mass)

    @cached_property
    def pad_loads(self) -> np.ndarray:
        """(n_free, n_pad) ndarray [-]: unit inward normal force at each pad node."""
        loads = self.fingertip.pad_loads
        return np.asarray(loads.todense()) if hasattr(loads, "todense") else loads

    @property
    def unit_loads(self) -> np.ndarray:
        """(n_free, n_load) ndarray [-]: what the scene's forces multiply; methods need not know what they are."""
        return self.pad_loads

    @property
    def n_loads(self) -> int:
        """Number of unit loads."""
        return self.n_pad

    @cached_property
    def pad_rows(self) -> np.ndarray:
        """(3 n_pad,) ndarray of int: positions of the pad's degrees of freedom among the free ones."""
        dofs = (3 * self.fingertip.mesh.pad_nodes[:, None] + np.arange(3)).ravel()
        return np.searchsorted(self.fingertip.free_dofs, dofs)

    @cached_property
    def pad_positions(self) -> np.ndarray:
        """(n_pad, 3) ndarray [m]."""
        mesh = self.fingertip.mesh
        return mesh.nodes[mesh.pad_nodes]

    @cached_property
    def pad_normals(self) -> np.ndarray:
        """(n_pad, 3) ndarray: outward unit normals."""
        mesh = self.fingertip.mesh
        return mesh.normals[np.searchsorted(mesh.skin_nodes, mesh.pad_nodes)]

    @property
    def n_free(self) -> int:
        return len(self.fingertip.free_dofs)

    @property
    def n_pad(self) -> int:
        return len(self.fingertip.mesh.pad_nodes)

    @property
    def point_variables(self) -> tuple[str, ...]:
        """Variables of labelled cases that describe the operating point, (case,)."""
        return ("frequency", "loss_factor") if self.harmonic else ()

    @property
    def dtype(self) -> np.dtype:
        return np.dtype(np.complex128 if self.harmonic else np.float64)

    def force_vectors(self, cases: CaseArrays) -> np.ndarray:
        """(n_free, n_case) ndarray [N]: the right-hand sides, Fortran-ordered, complex where the forces are."""
        vectors = np.zeros((self.n_free, len(cases)), dtype=np.result_type(cases.force, np.float64), order="F")
        for i in range(len(cases)):
            vectors[:, i] = self.unit_loads[:, cases.node[i]] @ cases.force[i]
        return vectors

    # ---- labels in, labels out ------------------------------------------------------------------------------

    def case_arrays(self, cases: xr.Dataset) -> CaseArrays:
        """Check labelled cases and turn them into plain arrays.

        Raises
        ------
        ValueError
            For a missing variable, a value that is not finite or out of its domain, or a node that is not on the
            pad; one sentence with the value, the rule and the remedy.
        """
        loads, points = check_shapes(cases, self.name, self.load_variables, self.point_variables, self.defaults)
        force, rows = self._read_loads(loads)
        present = rows != NO_FORCE
        if not present.any(axis=1).all():
            raise ValueError(f"case {int(np.argmin(present.any(axis=1)))} has no force: give at least one pad node")
        force = np.where(present, force, 0.0)
        node = np.where(present, rows, 0)
        for name, values in points.items():
            points[name] = finite(values, name, POINT_UNITS[name])
            if (points[name] < 0).any():
                raise ValueError(f"{name} {points[name].min():g} is negative: give zero or more")
        return CaseArrays(node, force, **points)

    def _read_loads(self, loads: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Forces [N] and columns of the unit loads, or NO_FORCE, both (n_case, n_force), from checked variables."""
        return finite(loads["force_amplitude"], "force_amplitude", "N"), self._pad_index(loads["load_node"])

    def _pad_index(self, nodes: np.ndarray) -> np.ndarray:
        pad = self.fingertip.mesh.pad_nodes
        return positions_of(
            nodes, pad, f"cannot carry load: only the {len(pad)} pad nodes can, ids from {pad[0]} to "
            f"{pad[-1]} as listed in fingertip.mesh.pad_nodes")

    def cases_from(self, arrays: CaseArrays) -> xr.Dataset:
        """Labelled cases from plain arrays: the inverse of :meth:`case_arrays`."""
        data = self._label_loads(arrays)
        if arrays.frequency is not None and arrays.loss_factor is not None:
            data["frequency"] = ("case", arrays.frequency, {"long_name": "excitation frequency", "units": "Hz"})
            data["loss_factor"] = ("case", arrays.loss_factor, {
                "long_name": "loss factor eta of K (1 + i eta)", "units": "1"})
        return xr.Dataset(data, coords={"case": ("case", np.arange(len(arrays)), {"long_name": "case", "units": "1"})},
                          attrs={"scene": self.name, "scene_hash": self.content_hash})

    def _label_loads(self, arrays: CaseArrays) -> dict[str, Any]:
        """Variables of :attr:`load_variables` from plain arrays."""
        pad = self.fingertip.mesh.pad_nodes
        node = np.where(arrays.force == 0.0, NO_FORCE, pad[arrays.node]).astype(np.int32)
        return {
            "load_node": (("case", "force"), node, {
                "long_name": "mesh node that carries the normal force", "units": "1", "missing_force": NO_FORCE}),
            "force_amplitude": (("case", "force"), arrays.force, {
                "long_name": "force amplitude along the inward normal", "units": "N"}),
        }

    def label(self, cases: xr.Dataset, values: np.ndarray, outputs: str | None = None) -> xr.Dataset:
        """Attach names, units and positions to answers.

        Parameters
        ----------
        cases : xr.Dataset
        values : (n_case, n_free) or (n_case, 3 n_pad) ndarray [m]
            Displacement at the free degrees of freedom, or at the pad's.
        outputs : {"field", "pad"}, optional
            Default: the scene's own.
        """
        outputs = outputs or self.outputs
        mesh = self.fingertip.mesh
        if outputs == "pad":
            node, full = mesh.pad_nodes, values
        else:
            node = np.arange(len(mesh.nodes))
            full = self.on_all_nodes(values)
        # a stored dataset may come in as cases: its truth, and nodes that are not asked for, stay behind
        answer = cases.drop_dims(["node", "component"], errors="ignore").drop_vars(TRUTH_VARIABLES, errors="ignore")
        answer["displacement"] = (("case", "node", "component"), full.reshape(len(values), len(node), 3), {
            "long_name": self.displacement_name, "units": "m"})
        return answer.assign_coords(self.field_coordinates(node))

    @property
    def displacement_name(self) -> str:
        """What the displacement is in words."""
        return "displacement amplitude" if self.harmonic else "displacement"

    def field_coordinates(self, node: np.ndarray) -> dict[str, tuple]:
        """Coordinates of a field at the mesh nodes ``node``: ids, components, positions [m]."""
        mesh = self.fingertip.mesh
        return {
            "node": ("node", node, {"long_name": "mesh node", "units": "1"}),
            "component": ("component", ["x", "y", "z"], {"long_name": "component of the displacement"}),
            **{f"node_{axis}": ("node", mesh.nodes[node, i], {"long_name": text, "units": "m"})
               for i, (axis, text) in enumerate(AXES.items())}}

    def on_all_nodes(self, values: np.ndarray) -> np.ndarray:
        """(n_case, n_node, 3) ndarray [m] from (n_case, n_free): held nodes stay at zero."""
        n_node = len(self.fingertip.mesh.nodes)
        full = np.zeros((len(values), 3 * n_node), dtype=values.dtype)
        full[:, self.fingertip.free_dofs] = values
        return full.reshape(-1, n_node, 3)

    def values(self, answer: xr.Dataset) -> np.ndarray:
        """(n_case, n_free) ndarray [m]: displacement at the free degrees of freedom of a full-field answer."""
        array = answer["displacement"].transpose("case", "node", "component").values
        return array.reshape(len(array), -1)[:, self.fingertip.free_dofs]

    # ---- identity -------------------------------------------------------------------------------------------

    @property
    def content_hash(self) -> str:
        """Changes with everything that changes the truth: anatomy, tissues, mesh, formulation, boundary, loads."""
        return self.fingertip.content_hash

    def to_json(self) -> str:
        """Enough to build this scene again with :func:`rom.scenes.scene_from_json`."""
        tip = self.fingertip
        return json.dumps({
            "scene": self.name, "outputs": self.outputs, "formulation": tip.formulation, "rear": tip.rear,
            "anatomy": tip.anatomy.to_dict(), "density": tip.density.to_dict(), "options": self.options},
            sort_keys=True)

    @property
    def options(self) -> dict[str, Any]:
        """JSON-able arguments that a scene takes beside fingertip and outputs."""
        return {}

    @classmethod
    def fingertip_from(cls, record: dict[str, Any]) -> Fingertip:
        """The fingertip of a record written by :meth:`to_json`."""
        return Fingertip(Anatomy.from_dict(record["anatomy"]), MeshDensity.from_dict(record["density"]),
                         formulation=record["formulation"], rear=record["rear"])

    # ---- what each scene decides ----------------------------------------------------------------------------

    @abstractmethod
    def sample(self, count: int, seed: int = 0) -> CaseArrays:
        """``count`` distinct cases within the published ranges, every pad node equally often."""

    @abstractmethod
    def sample_beyond(self, count: int, seed: int = 0) -> CaseArrays:
        """``count`` cases outside the published ranges, for the extrapolation part of the hard split."""

    @abstractmethod
    def hard_region(self, arrays: CaseArrays, seed: int = 0) -> np.ndarray:
        """(n_case,) ndarray of int: 0 where a case belongs to hard training, k where to ``regions[k - 1]``."""

    @property
    def n_published(self) -> int | None:
        """Number of cases that the published ranges hold, amplitudes apart; None where they are not counted."""
        return None

    def published_number(self, arrays: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray of int: the place of each case within the ranges among the :attr:`n_published` ones."""
        raise NotImplementedError(f"the cases of {self.name} are not counted")

    def groups(self, arrays: CaseArrays) -> list[np.ndarray]:
        """Index arrays of cases that one factorization serves."""
        if not self.harmonic:
            return [np.arange(len(arrays))]
        points = np.column_stack([arrays.frequency, arrays.loss_factor])
        _, inverse = np.unique(points, axis=0, return_inverse=True)
        order = np.argsort(inverse, kind="stable")
        return np.split(order, np.flatnonzero(np.diff(inverse[order])) + 1)

    def held_out_nodes(self, seed: int = 0, fraction: float = 0.1) -> np.ndarray:
        """Rows of the pad nodes that the hard split keeps from training, drawn from ``seed``."""
        rng = np.random.default_rng([seed, 239])
        return np.sort(rng.choice(self.n_pad, size=max(1, round(fraction * self.n_pad)), replace=False))


POINT_UNITS = {"frequency": "Hz", "loss_factor": "1"}
TRUTH_VARIABLES = ("residual", "solve_seconds")
"""What a dataset says of its direct solves; no other method's answer may carry it."""
AXES = {"x": "distance from the joint towards the tip", "y": "lateral position", "z": "position, dorsal positive"}

