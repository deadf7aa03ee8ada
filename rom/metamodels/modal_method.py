"""What the modal methods share: modes, vectors of each load's own beside them, and the certificate."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import xarray as xr

from rom.fullorder import Modes
from rom.fullorder.load_vectors import load_vectors
from rom.fullorder.poles import Poles, operating_points
from rom.metamodels.basis import Basis, check_precision, room
from rom.metamodels.facts import Needs
from rom.metamodels.known_loads import KnownLoads
from rom.metamodels.linear import not_harmonic
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.modal_bound import ModalBound, OwnDefects
from rom.metamodels.mode_split import ModeSplit
from rom.metamodels.residual_bound import residual_bound
from rom.metamodels.stored import Stored
from rom.metamodels.validity import Assessment, joined
from rom.relative import relative
from rom.scenes import CaseArrays, LinearScene, Scene


class MeasuredModes(NamedTuple):
    """Modes and what theorem 2 needs to know of them."""

    modes: Modes
    split: ModeSplit


class ModalMethod(Metamodel):
    """A sum of natural modes and, where ``vectors`` is above 0, of vectors of each load's own; with its certificate.

    Parameters
    ----------
    modes : int, optional
        Number of modes; default: all within the scene's band.
    precision : {"float64", "float32"}
        Of the stored shapes; the modal coordinates are always double.
    loads : iterable of int, optional
        Columns of the scene's unit loads that cases will name; default: all.
    """

    static_reason: ClassVar[str]
    galerkin: ClassVar[bool] = True
    """Whether each load's own vectors vibrate, or answer as they would at 0 Hz."""
    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("shapes", ("mode", "dof"), "mass-orthonormal mode shape", "kg-0.5"),
        Stored("eigenvalue", ("mode",), "squared angular frequency", "rad2 s-2"),
        Stored("participation", ("load", "mode"), "mode shape times unit load", "N kg-0.5"),
        Stored("certificate", part=ModalBound))
    with_vectors: ClassVar[tuple[Stored, ...]] = (
        *stored, Stored("own_shapes", ("load", "vector", "dof"), "load-dependent vector, K-orthonormal", "m J-0.5"),
        Stored("theta", ("load", "vector"), "reciprocal Ritz value; 0 where the vector answers statically", "s2"),
        Stored("first", ("load", "vector"), "share of the load", "J0.5 N-1"),
        Stored("share", ("load", "vector"), "share of the residual", "s2"),
        Stored("own_defects", part=OwnDefects))

    shapes: Basis
    """The kept modes."""
    eigenvalue: np.ndarray
    """(m,) ndarray [rad^2/s^2]"""
    participation: np.ndarray
    """(n_load, m) ndarray [N kg^-1/2]: mode shape times unit load."""
    certificate: ModalBound
    own_shapes: Basis
    """Each load's own vectors."""
    theta: np.ndarray
    first: np.ndarray
    share: np.ndarray
    """(n_load, p) ndarray: of the vectors, see :mod:`rom.metamodels.modal_bound`."""
    own_defects: OwnDefects | None = None
    _judged: tuple[CaseArrays, tuple[np.ndarray, np.ndarray]] | None = None

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_harmonic(scene, cls.static_reason)

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(modes=True, responses=True)

    def __init__(self, scene: LinearScene, modes: int | None = None, precision: str = "float64",
                 loads: Iterable[int] | None = None) -> None:
        if modes is not None and modes < 1:
            raise ValueError(f"modes={modes} is too few: keep at least one mode, or leave it out for the scene's band")
        super().__init__(scene, modes=modes, precision=check_precision(precision))
        self.known = KnownLoads(scene, loads)
        if self.known.setting is not None:
            self.settings["loads"] = self.known.setting

    @property
    def n_vectors(self) -> int:
        """Load-dependent vectors of each load."""
        return 0

    @property
    def next_eigenvalue_bound(self) -> float:
        """No mode below this is missing [rad^2/s^2]."""
        return self.certificate.split.next_bound

    @property
    def model_bytes(self) -> int:
        held = self.shapes.nbytes + self.participation.nbytes
        return held + (self.own_shapes.nbytes + self.theta.nbytes + self.first.nbytes if self.n_vectors else 0)

    @property
    def fields(self) -> tuple[int, int] | None:
        """Full fields that the online stage holds, and that an answer of one force reads; None if the band decides."""
        modes, own = self.settings["modes"], self.n_vectors
        return None if modes is None else (modes + own * self.scene.n_loads, modes + own)

    @property
    def online_bytes(self) -> int:
        field = self.shapes.field
        return field.nbytes + 2 * field[0].nbytes + (self.own_shapes.field[0].nbytes if self.n_vectors else 0)

    # ---- offline --------------------------------------------------------------------------------------------

    def _fit(self, train: xr.Dataset | None) -> None:
        count, model = self.settings["modes"], self.scene.model
        modes = model.natural_modes(**({"below_hz": self.scene.band_hz} if count is None else {"count": count}))
        self._make(MeasuredModes(modes, ModeSplit.of(residual_bound(self.scene).energy, modes)))

    def fit_on(self, measured: MeasuredModes) -> Self:
        """Fit on modes that are there already."""
        start = time.perf_counter()
        self._make(measured)
        self.fitted, self.offline_seconds = True, time.perf_counter() - start
        return self

    def measured_modes(self) -> MeasuredModes | None:
        """The kept modes, for other methods to build on; None where they are stored in single precision."""
        if self.settings["precision"] != "float64":
            return None
        m, bound = len(self.eigenvalue), self.next_eigenvalue_bound
        modes = Modes(self.eigenvalue, np.ascontiguousarray(self.shapes.field.T), np.zeros(m), m, bound, bound)
        return MeasuredModes(modes, self.certificate.split)

    def _make(self, measured: MeasuredModes) -> None:
        modes, model, loads = measured.modes, self.scene.model, self.known.columns
        if model.loss_stiffness is not None:
            raise ValueError(f"{self.name} cannot answer a body with a loss stiffness beside its loss factor: modes "
                             "do not take the equation apart; use direct, or one loss factor for the whole body")
        kind, rows = self.settings["precision"], self.scene.part_rows
        self.eigenvalue, self.participation = modes.eigenvalue, loads.T @ modes.shape
        self.shapes = Basis(modes.shape.T, rows, kind)
        if self.n_vectors:
            found = load_vectors(model, modes, loads, self.n_vectors)
            self.theta, self.first, self.share = found.theta, found.first, found.beta[:, None] * found.last
            following = found.following
            if not self.galerkin:  # K^-1 M v = theta v + share n is all that is left, omega^2 y times
                following = found.theta[:, :1] * found.vectors[:, 0] + self.share * following
                self.theta, self.share = np.zeros_like(found.theta), np.ones_like(found.theta)
            self.own_shapes = Basis(found.vectors, rows, kind)
            rest = np.einsum("lp,lpn->ln", self.first, found.vectors)
        else:
            rest = model.solve_static(loads).T - (self.participation / modes.eigenvalue) @ modes.shape.T
        energy = residual_bound(self.scene).energy
        self.certificate = ModalBound.of(energy, measured.split, modes, self.shapes.field, loads, self.participation,
                                         rest)
        if self.n_vectors:
            self.own_defects = self.certificate.measure_own(
                energy, modes, self.own_shapes.field, found.vectors, self.first, self.theta, self.share, following)

    # ---- online ---------------------------------------------------------------------------------------------

    def _force_sum(self, cases: CaseArrays) -> np.ndarray:
        if cases.node.shape[1] == 1:
            return self.participation[cases.node[:, 0]] * cases.force
        return np.einsum("cf,cfk->ck", cases.force, self.participation[cases.node])

    def coordinates(self, cases: CaseArrays) -> np.ndarray:
        """(n_case, m) ndarray, complex: modal coordinates phi_k^T f / (lambda_k (1 + i eta) - omega^2)."""
        return self._coordinates(self.known.placed(cases), *operating_points(cases.frequency, cases.loss_factor))

    def _coordinates(self, cases: CaseArrays, stiffness: np.ndarray, inertia: np.ndarray) -> np.ndarray:
        return Poles.of_modes(self.eigenvalue).at(self._force_sum(cases), stiffness, inertia)

    def own_coordinates(self, place: Any, force: Any, stiffness: Any, inertia: Any) -> np.ndarray:
        """(n_case, p) ndarray, complex: coordinates of one force's own vectors; ``place`` among the known loads."""
        numerator = self.first[place] * np.asarray(force)[..., None]
        return Poles.of_vectors(self.theta[place]).at(numerator, stiffness, inertia)

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        from rom.metamodels.field_sums import sum_of_many, sum_of_one

        cases, shapes = self.known.placed(cases), self.shapes.rows(outputs)
        point = operating_points(cases.frequency, cases.loss_factor)
        modal = self._coordinates(cases, *point)
        own, of_forces = np.empty((0, 0, shapes.shape[1]), shapes.dtype), np.empty((*cases.node.shape, 0), complex)
        if self.n_vectors:
            own, of_forces = self.own_shapes.rows(outputs), self._own_of_forces(cases, *point)
        out = room(out, len(cases), shapes.shape[1], np.result_type(shapes.dtype, np.complex64))
        if len(cases) == 1 or (self.n_vectors and cases.node.shape[1] > 1):
            node = cases.node if self.n_vectors else cases.node[:, :0]
            for i in range(len(cases)):
                sum_of_one(modal[i], shapes, of_forces[i], own, node[i], out[i])
        elif not self.n_vectors:
            sum_of_many(modal, shapes, np.arange(len(cases)), out)
        else:
            # one matrix product a load: the modes stay in cache, each load's own vectors are read once
            coordinates, node = np.concatenate([modal, of_forces[:, 0]], axis=1), cases.node[:, 0]
            stack = np.concatenate([shapes, own[0]])
            order = np.argsort(node, kind="stable")
            for group in np.split(order, np.flatnonzero(np.diff(node[order])) + 1):
                stack[len(shapes):] = own[node[group[0]]]
                sum_of_many(coordinates[group], stack, group, out)
        return out

    def energy_norm(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray: ``sqrt(u^H K u)`` of the answer, exact for one force, an upper bound for several."""
        cases, point = self.known.placed(cases), operating_points(cases.frequency, cases.loss_factor)
        modal = np.sqrt((np.abs(self._coordinates(cases, *point)) ** 2) @ self.eigenvalue)
        if not self.n_vectors:
            return modal
        return np.hypot(modal, np.linalg.norm(np.abs(self._own_of_forces(cases, *point)), axis=2).sum(axis=1))

    def _own_of_forces(self, cases: CaseArrays, stiffness: np.ndarray, inertia: np.ndarray) -> np.ndarray:
        """(n_case, n_force, p) ndarray, complex: coordinates of every force's own vectors."""
        return self.own_coordinates(cases.node, cases.force, stiffness[:, None], inertia[:, None])

    # ---- the certificate ------------------------------------------------------------------------------------

    def _bounds(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
        """Bound of the error, and least energy norm of the true answer, both (n_case,) [J^1/2]."""
        cases, point = self.known.placed(cases), operating_points(cases.frequency, cases.loss_factor)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            modal = self._coordinates(cases, *point)
            if not self.n_vectors:
                return self.certificate.bounds(cases, *point, modal)
            return self.certificate.bounds(cases, *point, modal, self.own_defects, self._own_of_forces(cases, *point),
                                           self.share)

    def error_bound(self, cases: CaseArrays) -> np.ndarray:
        """Proven bound of the energy norm of the error.

        Parameters
        ----------
        cases : CaseArrays

        Returns
        -------
        (n_case,) ndarray [J^1/2]
            ``sqrt(e^H K e) <= bound``: truncation, defects of modes and vectors, rounding.
        """
        return self._bounds(cases)[0]

    def relative_bound(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray: proven bound of ``sqrt(e^H K e) / sqrt(u^H K u)``; infinite where there is none."""
        return relative(*self._bounds(cases))

    def indicators(self, cases: CaseArrays) -> dict[str, tuple]:
        judged, self._judged = self._judged, None
        bound, least = judged[1] if judged is not None and judged[0] is cases else self._bounds(cases)
        return {
            "energy_error_bound": (("case",), bound, {
                "long_name": "proven bound of sqrt(e^H K e)", "units": "J0.5"}),
            "relative_energy_error_bound": (("case",), relative(bound, least), {
                "long_name": "proven bound of sqrt(e^H K e) / sqrt(u^H K u)", "units": "1"})}

    def reasons(self, cases: CaseArrays) -> np.ndarray:
        highest = np.sqrt(self.next_eigenvalue_bound) / (2 * np.pi)
        found = np.where(cases.frequency >= highest,
                         f"frequency beyond the modes kept, which reach {highest:.4g} Hz", "")
        nearest = np.abs((2.0 * np.pi * cases.frequency[:, None]) ** 2 / self.eigenvalue - 1.0).min(axis=1)
        return joined(found, np.where((cases.loss_factor == 0.0) & (nearest < 1e-6),
                                      "undamped and within a millionth of a resonance", ""))

    def quick_assessment(self, cases: CaseArrays) -> Assessment:
        self._judged = cases, self._bounds(cases)  # which `predict` asks for once more
        return Assessment(relative(*self._judged[1]), "bound", self.reasons(cases)).with_large_errors_named()

    def assess(self, cases: CaseArrays, values: np.ndarray | None = None) -> Assessment:
        return self.quick_assessment(cases)
