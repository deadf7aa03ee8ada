"""Networks that multiply what they know of the node with what they know of frequency and loss factor.

(1 + i eta) u(node, f, eta) / F = v(node, s) + sum_q T_q(f, eta) sum_r B_qr(position, normal) V_r:

trunk functions T_q (:mod:`rom.metamodels.networks.trunks`), coefficients B_qr, a linear layer of Fourier features of
the load's position and normal, fields V_r, principal directions of what is to be learned, and v, what is known of
mechanics: nothing, the load's static response, or that and what natural modes add to it. (DeepONet, Lu et al. 2021,
with POD fields, Lu et al. 2022.) Such a product is what the mechanics has, it trains by small least-squares problems,
and a whole published set of cases costs two small matrices a node. The scene loads pad nodes alone, so the coefficients
are evaluated once at each of them and kept.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray as xr

from rom.datasets.reduced import ReducedField
from rom.datasets.storage import open_netcdf
from rom.fullorder.blas import blas_threads
from rom.fullorder.poles import Poles, operating_points
from rom.metamodels.basis import Basis, combine
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.linear import not_harmonic
from rom.metamodels.networks.network import WEIGHT, Network
from rom.metamodels.networks.output_layer import SCALES, choose_heads, gather
from rom.metamodels.networks.sizes import LARGE, TRAINED, trained_here
from rom.metamodels.networks.unit_answers import (
    AnswersInMemory,
    AnswersOnDisk,
    NodeCases,
    UnitAnswers,
    random_validation,
    split_validation,
)
from rom.metamodels.pod_space import NOISE
from rom.metamodels.trained import TrainedRange
from rom.scenes import CaseArrays, LinearScene, Scene

if TYPE_CHECKING:
    import torch

POINTS_OF = 12
"""Nodes over whose operating points trunk functions are made orthonormal."""
FEATURES = 256
BLOCK = 64


class SeparableNetwork(Network):
    """Parent of the networks that are a product of node and operating point.

    Parameters
    ----------
    scene : Scene
    rank : int, optional
        Number of fields V_r; default: all that the answers span where they are fewer than the class's own number.
    steps : int
        Of training the trunk.
    storage : {"float32", "float16"}
        Of fields and coefficients in a file; half precision halves it and adds 2e-4 to an error.
    seed : int
    precision : {"float64", "float32"}
        Of the fields in memory.
    **settings
        Named in each class.

    """

    static_part: ClassVar[bool]
    default_rank: ClassVar[int]
    static_reason: ClassVar[str]
    """Why it does not apply in statics."""

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        reason = not_harmonic(scene, cls.static_reason) or scene.not_spatial()  # type: ignore[attr-defined]
        if reason is None and scene.max_forces > 1:  # type: ignore[attr-defined]
            reason = "is the published network, or stands beside it, for one force at a time"
        return reason

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        if not trained_here(cls.name, scene):
            return Curve()
        sizes = ({TRAINED: "small"}, {TRAINED: "medium"}, LARGE, {**LARGE, "precision": "float64"}, {})
        return Curve(sizes, headline=sizes.index(LARGE))

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(stiffness=cls.static_part, responses=cls.static_part, network=True)

    def __init__(self, scene: LinearScene, rank: int | None, steps: int, storage: str, seed: int, precision: str,
                 **settings: Any) -> None:
        super().__init__(scene, seed, precision, rank=rank, steps=steps, storage=storage, **settings)

    @property
    def model_bytes(self) -> int:
        return super().model_bytes + self._heads.nbytes + self._participation.nbytes

    @property
    def online_bytes(self) -> int:
        rows = self._n_field + len(self._eigenvalue) + int(self.static_part)
        return self._module_bytes + self._heads[0].nbytes + (rows + 2) * self._basis.field[0].nbytes

    # ---- learning -------------------------------------------------------------------------------------------

    def fit_stored(self, path: str | Path, cases: np.ndarray) -> Self:
        """Learn from cases of a dataset that is stored reduced, node by node, without a whole answer in memory.

        Parameters
        ----------
        path : path
            Of a dataset that :func:`rom.datasets.whole.make_whole_dataset` made.
        cases : (n,) ndarray of int
            Positions of the training cases; nothing else is looked at.

        Raises
        ------
        SchemaError
            Where the dataset is damaged or of another scene or mesh.
        """
        start = time.perf_counter()
        with open_netcdf(path) as data:
            self.scene.check_origin(data, str(path))
        field, cases = ReducedField(path), np.asarray(cases)
        self.trained = TrainedRange.of(self.scene, field.arrays(cases))
        self.borrowed_seconds = 0.0
        self._solve_known()
        self._learn(AnswersOnDisk(self.scene, field, cases, self._known_shapes, self.settings["seed"]))
        self.fitted = True
        self.offline_seconds = time.perf_counter() - start
        return self

    def _fit(self, train: xr.Dataset) -> None:
        self._solve_known()
        answers = AnswersInMemory(self.scene, train, self._known_shapes)
        self.borrowed_seconds = answers.seconds
        self._learn(answers)

    @property
    def _known_shapes(self) -> np.ndarray:
        return np.concatenate([self._modes, self._static])

    def _learn(self, answers: UnitAnswers) -> None:
        from rom.metamodels.networks.determinism import reproducible

        self._known = self._static @ answers.vectors, self._modes @ answers.vectors
        validation = split_validation(answers, self.settings["seed"])
        with reproducible(self.settings["seed"]), blas_threads(1):
            trunk = self._trunk()
            self._train_trunk(trunk, answers)
            mix = self._orthonormal(trunk, answers)
            learned, held, spread = gather(
                answers, self._unknown, lambda point: self._trunk_values(trunk, point) @ mix, validation, mix.shape[1])
            value, direction = np.linalg.eigh(spread)
            rank = self._rank(int((value > NOISE * value[-1]).sum()))
            direction = direction[:, ::-1][:, :rank]
            heads = choose_heads(learned.in_basis(direction), held.in_basis(direction), answers.cases_by_node,
                                 self._features)
        fields = (answers.vectors @ direction).T
        self._take(trunk, mix, heads, np.concatenate([fields, self._modes]))
        del self._known, self._modes, self._static

    def _unknown(self, node: int, cases: NodeCases) -> np.ndarray:
        """(n, R) ndarray: what is known of mechanics taken from the answers of one node."""
        static, shapes = self._known
        rest = cases.answer - static[node] if len(static) else cases.answer.copy()
        if len(shapes):
            rest -= (self._modal_terms(cases.point) * self._participation[node]) @ shapes
        return rest

    def _modal_terms(self, point: np.ndarray) -> np.ndarray:
        """(n, m) ndarray: s / (lambda_k (lambda_k - s)), what a mode of unit participation adds to its static share."""
        stiffness, inertia = operating_points(*point.T)  # s is their ratio
        return Poles.of_modes(self._eigenvalue).at(inertia / self._eigenvalue, stiffness, inertia)

    def _train_trunk(self, trunk: Any, answers: UnitAnswers) -> None:
        from rom.metamodels.networks.sketch import make_sketch
        from rom.metamodels.networks.variable_projection import learn_trunk

        seed = self.settings["seed"]
        sketch = make_sketch(answers, self._unknown, random_validation(answers, seed), self._features(SCALES[0]),
                             trunk.size, seed)
        self.history = learn_trunk(trunk, sketch, self.settings["steps"], self.progress,
                                   self._checkpoint(answers.digest))

    def _orthonormal(self, trunk: torch.nn.Module, answers: UnitAnswers) -> np.ndarray:
        """(q, q) ndarray: turns trunk functions into orthonormal ones over the first nodes' points."""
        nodes = np.flatnonzero(answers.cases_by_node)
        points = np.concatenate([answers.of_node(node).point for node in nodes[:POINTS_OF]])
        value = self._trunk_values(trunk, points)
        rows = np.concatenate([value.real, value.imag])
        # singular vectors: functions that the points cannot tell apart are left out
        _, singular, vt = np.linalg.svd(rows, full_matrices=False)
        keep = singular > 1e-11 * singular[0]
        return vt[keep].T / singular[keep] * np.sqrt(len(points))

    @staticmethod
    def _trunk_values(trunk: torch.nn.Module, points: np.ndarray) -> np.ndarray:
        """(n, q) ndarray, complex."""
        import torch

        from rom.metamodels.networks.determinism import one_thread

        with one_thread(), torch.no_grad():
            return trunk(torch.from_numpy(np.ascontiguousarray(points))).numpy()

    def _features(self, scale: float) -> np.ndarray:
        """(n_load, h) ndarray: Fourier features of position and normal at every pad node."""
        rng = np.random.default_rng([self.settings["seed"], 34])
        phase = self._places() @ (rng.standard_normal((6, FEATURES)) * ([[scale]] * 3 + [[0.25 * scale]] * 3))
        return np.concatenate([np.cos(phase), np.sin(phase)], axis=1) / np.sqrt(FEATURES)

    def _trunk(self) -> torch.nn.Module:
        """A trunk, untrained, with ``size`` complex functions."""
        raise NotImplementedError

    # ---- answering ------------------------------------------------------------------------------------------

    @property
    def shared_rows(self) -> np.ndarray:
        """(m, n_free) ndarray: shapes that answers to all loads are made of."""
        return self._basis.field[:self._n_field + len(self._eigenvalue)]

    def own_rows(self, node: int) -> np.ndarray:
        """(1 or 0, n_free) ndarray [m N^-1]: static response of the pad node in row ``node``, where it is known."""
        row = len(self.shared_rows) + node
        return self._basis.field[row:row + int(self.static_part)]

    def coefficients(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients of the cases' answers.

        Parameters
        ----------
        cases : CaseArrays

        Returns
        -------
        shared : (n_case, m) ndarray, complex
            Of :attr:`shared_rows`.
        own : (n_case, n_force) ndarray, complex [N]
            Of :meth:`own_rows` of each force's node; no column where no static response is known.
        """
        stiffness = (1.0 + 1j * cases.loss_factor)[:, None]
        point = np.column_stack([cases.frequency, cases.loss_factor])
        trunk = self._trunk_values(self._module, point) @ self._mix
        share = cases.force / stiffness
        shared = np.zeros((len(cases), self._n_field), dtype=complex)
        for start in range(0, len(cases), BLOCK):
            part = slice(start, start + BLOCK)
            for j in range(cases.node.shape[1]):
                heads, term = self._heads[cases.node[part, j]], trunk[part] * share[part, j:j + 1]
                both = np.stack([term.real, term.imag], axis=1).astype(np.float32) @ heads
                shared[part] += both[:, 0] + 1j * both[:, 1]
        if len(self._eigenvalue):
            modal = np.einsum("cf,cfm->cm", cases.force, self._participation[cases.node])
            shared = np.concatenate([shared, modal * self._modal_terms(point) / stiffness], axis=1)
        return shared, share if self.static_part else share[:, :0]

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        shared, own = self.coefficients(cases)
        rows, n_shared = self._basis.rows(outputs), shared.shape[1]
        out = combine(shared, rows[:n_shared], out)
        own = own.astype(out.dtype)
        for i, j in np.argwhere(own):
            row = rows[n_shared + cases.node[i, j]]
            out.real[i] += own[i, j].real * row
            out.imag[i] += own[i, j].imag * row
        return out

    def best_approximation(self, cases: CaseArrays, values: np.ndarray) -> np.ndarray | None:
        return None if self.static_part else super().best_approximation(cases, values)  # each load has a response

    # ---- what is kept ---------------------------------------------------------------------------------------

    def _rank(self, most: int) -> int:
        """Number of fields; ValueError where the answers do not span as many as are asked for."""
        asked = self.settings["rank"]
        if asked is not None and asked > most:
            raise ValueError(f"rank {asked} is out of reach: these answers span {most} dimensions above rounding "
                             "noise; ask for less or make more cases")
        return asked or min(self.default_rank, most)

    def _solve_known(self) -> None:
        """Natural modes (m, n_free) and static responses (n_load, n_free) [m N^-1] that need no learning, or none."""
        self._eigenvalue, self._participation = np.empty(0), np.empty((self.scene.n_loads, 0))
        self._modes, self._static = np.empty((0, self.scene.n_free)), self._static_rows()

    def _static_rows(self) -> np.ndarray:
        """(n_load, n_free) ndarray [m N^-1], or no row where the class knows none."""
        if not self.static_part:
            return np.empty((0, self.scene.n_free))
        return self.scene.model.solve_static(self.scene.unit_loads).T

    def _take(self, trunk: torch.nn.Module, mix: np.ndarray, heads: np.ndarray, rows: np.ndarray) -> None:
        """Round what is learned as the file will hold it, and keep it for answering."""
        self._hold({**self._rounded("basis", rows), **self._rounded("heads", heads), "mix": mix,
                    "eigenvalue": self._eigenvalue, "participation": self._participation}, self._static)
        self._keep(trunk)

    def _take_arrays(self, arrays: dict[str, np.ndarray]) -> None:
        # static responses are solved for again, at the price of one factorization: a file holds what was learned
        self._hold(arrays, self._static_rows())

    def _hold(self, arrays: dict[str, np.ndarray], static: np.ndarray) -> None:
        self._file_arrays = {name: array for name, array in arrays.items() if not name.startswith(WEIGHT)}
        rows = np.concatenate([arrays["basis"] * arrays["basis_size"], static])
        self._basis = Basis(rows, self.scene.part_rows, self.settings["precision"])
        self._heads = (arrays["heads"] * arrays["heads_size"]).astype(np.float32)
        self._mix, self._n_field = arrays["mix"], arrays["heads"].shape[2]
        self._eigenvalue, self._participation = arrays["eigenvalue"], arrays["participation"]

    def _keep(self, module: torch.nn.Module) -> None:
        super()._keep(module.requires_grad_(False))

    def _build(self, weights: dict[str, torch.Tensor]) -> torch.nn.Module:
        return self._trunk()
