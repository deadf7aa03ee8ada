"""A linear scene: forces on named loads of a body, at rest or at a frequency."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from rom.bodies import Body, Grid, Loads
from rom.errors import SolverError
from rom.fullorder import SecondOrderModel
from rom.relative import relative_errors
from rom.scenes.cases import CaseArrays
from rom.scenes.inputs import Quantity
from rom.scenes.labelled_cases import LoadLabels
from rom.scenes.labels import positions
from rom.scenes.linear_labels import label_cases, read_cases
from rom.scenes.population import CASES_PER_POINT, Population, RangePopulation
from rom.scenes.question import Question, default_question
from rom.scenes.scene import Answers, Scene

RESIDUAL_LIMIT = 1e-10
"""Largest relative residual ||Z u - f|| / ||f|| with which an answer is stored as truth."""
SMALLEST_SINGLE = 1e-25
"""Displacement [m] below which float32 answers are refused: coordinates a million times smaller lose digits there."""
PIECE_CASES = 64
"""Cases, about, that are solved together when a dataset is made."""
RECORD = {"residual": Quantity((), "1", "relative residual ||Z u - f|| / ||f|| of the direct solve")}


class LinearScene(Scene):
    """Forces on named loads of a linear body.

    Parameters
    ----------
    body : Body
    loads : Loads or callable
        What the forces act on; a callable makes them when they are first needed.
    question : Question, optional
        Default: one harmonic force (static where the body has no mass) over the ranges given here.
    frequency, loss_factor : (float, float)
        Sampled ranges of the default question [Hz], [-].
    population : Population, optional
        Which cases are drawn and held out; default: uniformly from the ranges of the inputs.
    outputs : str
        What the lean calls give: "field", or the name of the part.
    part : sequence or callable, optional
        Degrees of freedom of the smaller output: their names in the body, or their positions by a callable.
    identity : callable, optional
        ``identity() -> str``, in place of a digest of body and loads.
    parameters : callable, optional
        ``parameters() -> dict``, JSON-able: what the scene's registered factory needs to make it again.

    Raises
    ------
    ValueError
        For outputs that the scene has not, or degrees of freedom that the body has not.
    """

    record = RECORD
    has_residual = True

    def __init__(self, body: Body, loads: Loads | Callable[[], Loads], question: Question | None = None, *,
                 name: str | None = None, frequency: tuple[float, float] = (1.0, 300.0),
                 loss_factor: tuple[float, float] = (0.1, 0.5), population: Population | None = None,
                 outputs: str = "field", part: Any = None, identity: Callable[[], str] | None = None,
                 parameters: Callable[[], dict[str, Any]] | None = None) -> None:
        self.body = body
        if question is None:
            question = default_question(body, loads, name, frequency, loss_factor, part is not None)
        self.asked = question
        self._loads, self._part, self._identity, self._parameters = loads, part, identity, parameters
        self.population = RangePopulation() if population is None else population
        self.name, self.title, self.question = question.name, question.title, question.question
        self.gate = question.gate
        self.inputs, self.harmonic, self.max_forces = question.inputs, question.harmonic, question.max_forces
        self.needs, self.leaves_out = dict(question.needs), dict(question.leaves_out)
        self.part, self.part_words = question.part, question.part_words
        self.regions = self.population.regions
        self.recommended = "modal-krylov" if self.harmonic else "superposition"  # it bounds its own error; it is exact
        self.outputs = self.check_outputs(outputs)

    def __repr__(self) -> str:
        return f"<{self.name}: {self.body.name}, outputs {self.outputs}>"

    def afresh(self, outputs: str | None = None) -> LinearScene:
        """The same scene on a model of its own, with nothing factorised yet; it may want other outputs."""
        return LinearScene(self.body.afresh(), self._loads, self.asked, population=self.population,
                           outputs=outputs or self.outputs, part=self._part, identity=self._identity,
                           parameters=self._parameters)

    # ---- the model ------------------------------------------------------------------------------------------

    @property
    def model(self) -> SecondOrderModel:
        """The full-order model."""
        return self.body.model

    @property
    def grid(self) -> Grid | None:  # type: ignore[override]
        """Nodes and cells of the body, where there are any."""
        return self.body.grid

    @cached_property
    def loads(self) -> Loads:
        """What the forces act on."""
        return self._loads() if callable(self._loads) else self._loads

    @property
    def unit_loads(self) -> np.ndarray:
        """(n_free, n_load) ndarray [-]: what the scene's forces multiply."""
        return self.loads.columns

    @property
    def n_loads(self) -> int:
        """Number of unit loads."""
        return len(self.loads)

    @property
    def n_free(self) -> int:
        """Number of degrees of freedom that can move."""
        return self.model.n if self.grid is None else len(self.grid.free)

    @cached_property
    def part_rows(self) -> np.ndarray:
        """(n_part,) ndarray of int: positions of the part's degrees of freedom among the free ones."""
        if self._part is None:
            return np.empty(0, dtype=np.int64)
        if callable(self._part):
            return np.asarray(self._part())
        order = positions(self.body.dof_names, np.asarray(self._part), "the degree of freedom", "the body")
        return np.arange(len(self._part)) if order is None else order

    def n_outputs(self, outputs: str) -> int:
        """Number of degrees of freedom of "field" or of the part."""
        return self.n_free if outputs == "field" else len(self.part_rows)

    def not_spatial(self) -> str | None:
        """Why a method that interpolates over the places of loads does not apply, or None."""
        return None if self.asked.spatial else "interpolates over places and normals, which this scene's loads have not"

    @property
    def band_hz(self) -> float:
        """Upper end of the sampled frequencies [Hz]; 0 in statics."""
        return self.input("frequency").range[1] if self.harmonic else 0.0  # type: ignore[index]

    @property
    def dtype(self) -> np.dtype:
        return np.dtype(np.complex128 if self.harmonic else np.float64)

    def force_vectors(self, cases: CaseArrays) -> np.ndarray:
        """(n_free, n_case) ndarray [N]: the right-hand sides, Fortran-ordered, complex where the forces are."""
        vectors = np.zeros((self.n_free, len(cases)), dtype=np.result_type(cases.force, np.float64), order="F")
        for i in range(len(cases)):
            vectors[:, i] = self.unit_loads[:, cases.node[i]] @ cases.force[i]
        return vectors

    # ---- labels in ------------------------------------------------------------------------------------------

    def read(self, cases: xr.Dataset) -> CaseArrays:
        return read_cases(self, cases)

    @cached_property
    def load_labels(self) -> LoadLabels:
        """From labels to columns of the unit loads."""
        return LoadLabels(self.loads.labels)

    def load_index(self, *labels: Any) -> int:
        """Column of the unit load with these labels, in the order of ``loads.labels``: what ``CaseArrays.node`` holds.

        Raises
        ------
        ValueError
            Where no load has them.
        """
        given = xr.Dataset({name: ("case", [label]) for name, label in zip(self.loads.labels, labels, strict=True)})
        return int(self.load_labels.columns(given)[0, 0])

    # ---- labels out -----------------------------------------------------------------------------------------

    def cases_from(self, cases: CaseArrays) -> xr.Dataset:
        return label_cases(self, cases)

    @cached_property
    def quantities(self) -> dict[str, Quantity]:  # type: ignore[override]
        dims = ("dof",) if self.grid is None else ("node", "component")
        return {"displacement": Quantity(dims, "m", "displacement amplitude" if self.harmonic else "displacement")}

    def label(self, cases: xr.Dataset, answers: np.ndarray, outputs: str | None = None) -> xr.Dataset:
        part = (outputs or self.outputs) != "field"
        coordinates = self._part_coordinates if part else self._whole_coordinates
        answer = self.stripped(self.batched(cases))
        quantity = self.quantities["displacement"]
        if not part:
            answers = self.whole(answers)
        elif self.grid is not None:
            answers = answers.reshape(len(answers), -1, len(self.grid.components))
        answer["displacement"] = (("case", *quantity.dims), answers, quantity.attributes)
        return answer.assign_coords(coordinates)

    def stripped(self, cases: xr.Dataset) -> xr.Dataset:
        """Cases without what a stored dataset holds beside: its truth, and nodes that are not asked for."""
        return cases.drop_dims(["node", "component", "dof"], errors="ignore").drop_vars(
            [*self.record, "solve_seconds"], errors="ignore")

    def coordinates(self) -> dict[str, tuple]:
        return self._whole_coordinates

    @cached_property
    def _whole_coordinates(self) -> dict[str, tuple]:
        if self.grid is None:
            return {"dof": ("dof", self.body.dof_names, {"long_name": "degree of freedom"})}
        return self.grid.coordinates(np.arange(self.grid.n_node))

    @cached_property
    def _part_coordinates(self) -> dict[str, tuple]:
        if self.grid is None:
            return {"dof": ("dof", self.body.dof_names[self.part_rows], {"long_name": "degree of freedom"})}
        count = len(self.grid.components)
        places = self.grid.free[self.part_rows].reshape(-1, count)
        return self.grid.coordinates(places[:, 0] // count)

    def values(self, answer: xr.Dataset) -> np.ndarray:
        """(n_case, n_free) ndarray [m]: displacement at the free degrees of freedom of a full-field answer."""
        array = self.plain(answer)["displacement"]
        return array if self.grid is None else self.grid.at_free(array)

    # ---- what methods learn from ------------------------------------------------------------------------------

    def kinds(self, cases: CaseArrays) -> np.ndarray:
        return np.where(cases.force != 0.0, cases.node, -1)

    def numbers(self, cases: CaseArrays) -> dict[str, np.ndarray]:
        return {"frequency": cases.frequency, "loss_factor": cases.loss_factor} if self.harmonic else {}

    @property
    def doubts(self) -> tuple[str, ...]:  # type: ignore[override]
        return self.body.doubts

    def check_answers(self, cases: CaseArrays, answers: np.ndarray, method: str) -> dict[str, tuple]:
        bad = ~np.isfinite(answers).all(axis=1)
        if bad.any():
            raise SolverError(f"case {int(np.argmax(bad))} has no finite answer by {method}: an undamped resonance or "
                              "an overflow; give a loss factor above zero, or a smaller force")
        if answers.dtype.itemsize < np.result_type(answers.dtype, np.float64).itemsize:
            lost = (np.abs(answers).max(axis=1) < SMALLEST_SINGLE) & (cases.force != 0.0).any(axis=1)
            if lost.any():
                raise ValueError(f"case {int(np.argmax(lost))} moves less than {SMALLEST_SINGLE:g} m, which single "
                                 "precision cannot resolve: give precision='float64', or a larger force")
        return {}

    # ---- the truth ------------------------------------------------------------------------------------------

    def begin_piece(self) -> None:
        self.model.forget_harmonic()

    def whole(self, values: np.ndarray) -> np.ndarray:
        return values if self.grid is None else self.grid.on_all_nodes(values)

    def groups(self, cases: CaseArrays) -> list[np.ndarray]:
        """Index arrays of cases that one factorization serves."""
        if not self.harmonic:
            return [np.arange(len(cases))]
        points = np.column_stack([cases.frequency, cases.loss_factor])
        _, inverse = np.unique(points, axis=0, return_inverse=True)
        order = np.argsort(inverse, kind="stable")
        return np.split(order, np.flatnonzero(np.diff(inverse[order])) + 1)

    def thinned(self, rows: np.ndarray, every: int) -> np.ndarray:
        chosen = (rows // CASES_PER_POINT) % every == 0  # neighbours in the sampling share an operating point
        return chosen if chosen.any() else np.ones(len(rows), dtype=bool)

    @property
    def solver(self) -> str:  # type: ignore[override]
        kind = "complex" if self.harmonic else "real"
        return f"{self.model.backend}, {kind} symmetric, symbolic phase reused"

    def pieces(self, cases: CaseArrays) -> list[np.ndarray]:
        """Whole groups gathered into pieces of about PIECE_CASES cases; a larger group is cut."""
        pieces: list[np.ndarray] = []
        gathered: list[np.ndarray] = []
        for group in self.groups(cases):
            for part in np.array_split(group, max(1, -(-len(group) // PIECE_CASES))):
                gathered.append(part)
                if sum(map(len, gathered)) >= PIECE_CASES:
                    pieces.append(np.concatenate(gathered))
                    gathered = []
        return pieces + ([np.concatenate(gathered)] if gathered else [])

    def solve(self, cases: CaseArrays) -> tuple[Answers, dict[str, np.ndarray]]:
        """Direct answers and their relative residuals, one factorization a group.

        Returns
        -------
        answers : Answers
            ``displacement`` (n_case, n_free) [m].
        record : dict
            ``residual`` (n_case,).

        Raises
        ------
        SolverError
            Where a residual stays above :data:`RESIDUAL_LIMIT`.
        """
        values = np.empty((len(cases), self.n_free), dtype=self.dtype)
        residual = np.empty(len(cases))
        for group in self.groups(cases):
            block = cases.take(group)
            force, point = self.force_vectors(block), self.point(block)
            answer = self.model.solve_harmonic(force, *point) if point else self.model.solve_static(force)
            residual[group] = self.model.residual(answer, force, *point)
            values[group] = answer.T
        if not (residual <= RESIDUAL_LIMIT).all():
            worst = int(np.argmax(residual))
            raise SolverError(f"case {worst} was solved with relative residual {residual[worst]:.1e}, above "
                              f"{RESIDUAL_LIMIT:g}: the matrix is too ill-conditioned for a direct truth")
        return {"displacement": values}, {"residual": residual}

    def point(self, cases: CaseArrays) -> tuple[float, ...]:
        """Frequency [Hz] and loss factor of the first case; nothing in statics."""
        return (float(cases.frequency[0]), float(cases.loss_factor[0])) if self.harmonic else ()

    def errors(self, cases: CaseArrays, answers: np.ndarray, truth: np.ndarray) -> dict[str, np.ndarray]:
        return {"displacement": relative_errors(answers, truth)}

    # ---- which cases ----------------------------------------------------------------------------------------

    def sample(self, count: int, seed: int = 0) -> CaseArrays:
        return self.population.sample(self, count, seed)

    def sample_beyond(self, count: int, seed: int = 0) -> CaseArrays:
        return self.population.sample_beyond(self, count, seed)

    def hard_region(self, cases: CaseArrays, seed: int = 0) -> np.ndarray:
        return self.population.hard_region(self, cases, seed)

    @property
    def n_published(self) -> int | None:
        return self.population.count(self)

    def published_number(self, cases: CaseArrays) -> np.ndarray:
        return self.population.number(self, cases)

    def held_out_loads(self, seed: int = 0) -> np.ndarray:
        """Columns of the loads that the hard split keeps from training, drawn from ``seed``."""
        return self.population.held_out_loads(self, seed)

    # ---- identity -------------------------------------------------------------------------------------------

    @cached_property
    def content_hash(self) -> str:  # type: ignore[override]
        if self._identity is not None:
            return self._identity()
        digest = hashlib.sha256(self.body.content_hash.encode())
        digest.update(np.ascontiguousarray(self.loads.columns).tobytes())
        digest.update(json.dumps([self.name, self.loads.names]).encode())
        return digest.hexdigest()

    @property
    def mesh_hash(self) -> str:
        """Changes with the mesh; that of the body where it has no grid."""
        return self.body.content_hash if self.grid is None else self.grid.mesh_hash

    def to_json(self) -> str:
        parameters = self._parameters() if self._parameters else {}
        return json.dumps({"scene": self.name, "outputs": self.outputs, **parameters}, sort_keys=True)
