"""Modal superposition with hysteretic damping, and what must be added to it for loads at a point.

With K* = K (1 + i eta) and mass-orthonormal modes, u = sum phi_k (phi_k^T f) / (lambda_k (1 + i eta) - omega^2):
`modal` truncates that sum, `modal-static` adds the residual flexibility (what the left-out modes answer at 0 Hz),
`modal-krylov` adds further load-dependent vectors of each load (:mod:`rom.fullorder.load_vectors`).

The error of all three is certified (:mod:`rom.metamodels.modal_certificate`): a rigorous bound, once a Sturm count says
that no mode below the last kept was missed, at the price of a few operations a case.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import xarray as xr

from rom.fullorder import Modes
from rom.fullorder.load_vectors import LoadVectors, load_vectors
from rom.metamodels.basis import BLOCK, Basis, check_precision, combine, planes, room
from rom.metamodels.certificate import gram, quadratic, rounding_size
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.linear import not_harmonic, within
from rom.metamodels.modal_certificate import ModalCertificate
from rom.metamodels.stored import Stored
from rom.scenes import CaseArrays, LinearScene, Scene


class Modal(ModalCertificate):
    """Plain modal superposition.

    Parameters
    ----------
    modes : int, optional
        Number of modes; default: all within the scene's band.
    precision : {"float64", "float32"}
        Of the stored shapes; the modal coordinates are always double.
    """

    name: ClassVar[str] = "modal"
    summary: ClassVar[str] = "sums the natural modes within a band, nothing else"
    colour: ClassVar[str] = "#CC6677"
    static_reason: ClassVar[str] = ("a static answer has no resonance to sum over; unit-load responses are exact and "
                                    "cheaper")
    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("shapes", ("mode", "dof"), "mass-orthonormal mode shape", "kg-0.5"),
        Stored("eigenvalue", ("mode",), "squared angular frequency", "rad2 s-2"),
        Stored("participation", ("load", "mode"), "mode shape times unit load", "N kg-0.5"),
        Stored("next_eigenvalue_bound"), *ModalCertificate.stored)
    shapes: Basis
    """The kept modes."""

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_harmonic(scene, cls.static_reason)

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve(({}, *({"modes": within(scene, count)} for count in (40, 120))), headline=0)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"modes": within(scene, 6)}, {}))

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(modes=True, responses=True)

    def __init__(self, scene: LinearScene, modes: int | None = None, precision: str = "float64") -> None:
        if modes is not None and modes < 1:
            raise ValueError(f"modes={modes} is too few: keep at least one mode, or leave it out for the scene's band")
        super().__init__(scene, modes=modes, precision=check_precision(precision))

    @property
    def model_bytes(self) -> int:
        return self.shapes.nbytes + self.participation.nbytes

    @property
    def online_bytes(self) -> int:
        return self.shapes.field.nbytes + 2 * self.shapes.field[0].nbytes

    def _fit(self, train: xr.Dataset) -> None:
        modes = self._natural_modes()
        self._keep(modes)
        static = self.scene.model.solve_static(self._unit_loads()).T
        rest = static - (self.participation / modes.eigenvalue) @ modes.shape.T
        self._prepare_certificate(modes, self.shapes.field, rest)

    def _unit_loads(self) -> np.ndarray:
        """(n_free, n_load) ndarray: the loads that cases may name."""
        return self.scene.unit_loads

    def _natural_modes(self) -> Modes:
        """As many as the setting says, or those within the scene's band."""
        count = self.settings["modes"]
        return self.scene.model.natural_modes(
            **({"below_hz": self.scene.band_hz} if count is None else {"count": count}))

    def kept_modes(self) -> Modes | None:
        """The kept modes, for other methods to build on; None where they are stored in single precision."""
        if self.settings["precision"] != "float64":
            return None
        shape = np.ascontiguousarray(self.shapes.field.T)
        return Modes(self.eigenvalue, shape, np.zeros(len(self.eigenvalue)), len(self.eigenvalue),
                     self.next_eigenvalue_bound, self.next_eigenvalue_bound)

    def _keep(self, modes: Modes) -> None:
        self.eigenvalue = modes.eigenvalue
        self.next_eigenvalue_bound = modes.next_eigenvalue_bound
        self.participation = self._unit_loads().T @ modes.shape
        self.shapes = Basis(modes.shape.T, self.scene.part_rows, self.settings["precision"])

    def coordinates(self, cases: CaseArrays) -> np.ndarray:
        """(n_case, m) ndarray, complex: modal coordinates phi_k^T f / (lambda_k (1 + i eta) - omega^2)."""
        load = self._force_sum(self.participation, cases)
        stiffness, inertia = _point(cases)
        return load / (self.eigenvalue * stiffness - inertia)

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        return combine(self.coordinates(cases), self.shapes.rows(outputs), out)


class ModalWithLoadVectors(Modal):
    """Modes plus vectors of each load's own; the parent of `modal-static` and `modal-krylov`."""

    stored: ClassVar[tuple[Stored, ...]] = (
        *Modal.stored,
        Stored("own_shapes", ("load", "vector", "dof"), "load-dependent vector, K-orthonormal", "m J-0.5"),
        Stored("theta", ("load", "vector"), "reciprocal Ritz value", "s2"),
        Stored("first", ("load", "vector"), "share of the load", "J0.5 N-1"),
        Stored("last", ("load", "vector"), "share of the residual"),
        Stored("beta", ("load",), "norm of the next vector", "s2"),
        Stored("next_gram", ("load", "other_load"), "K products of the residuals' vectors"),
        Stored("own_size", ("load", "vector"), "rounding size"))
    own_shapes: Basis
    """Each load's own vectors."""
    own_size: np.ndarray
    """(n_load, p) ndarray: :func:`rounding_size` of each load's own vectors."""
    next_gram: np.ndarray
    """(n_load, n_load) ndarray [J]: K products of the vectors that residuals of different loads are multiples of."""

    @property
    def model_bytes(self) -> int:
        return super().model_bytes + self.own_shapes.nbytes + self.theta.nbytes + self.first.nbytes

    @property
    def online_bytes(self) -> int:
        return super().online_bytes + self.own_shapes.field[0].nbytes

    @property
    def n_vectors(self) -> int:
        return self.settings["vectors"]

    def _fit(self, train: xr.Dataset) -> None:
        model, modes = self.scene.model, self._natural_modes()
        self._keep(modes)
        found = load_vectors(model, modes, self._unit_loads(), self.n_vectors)
        self.theta, self.first, self.last, self.beta = found.theta, found.first, found.last, found.beta
        self.own_shapes = Basis(found.vectors, self.scene.part_rows, self.settings["precision"])
        self._prepare_certificate(modes, self.shapes.field, np.einsum("lp,lpn->ln", found.first, found.vectors))
        self.next_gram = self._gram_of_residuals(found)
        self.own_size = rounding_size(model.stiffness, self.own_shapes.field)

    def own_coordinates(self, node, force, stiffness, inertia) -> np.ndarray:
        """(n_case, p) ndarray, complex: coordinates of one force's own vectors."""
        raise NotImplementedError

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        shapes, own = self.shapes.rows(outputs), self.own_shapes.rows(outputs)
        stiffness, inertia = _point(cases)
        modal = self.coordinates(cases)
        kind = shapes.dtype
        out = room(out, len(cases), shapes.shape[1], np.result_type(kind, np.complex64))
        if cases.node.size == 1:  # one case, one force: two reads of m + p rows and nothing else
            node = cases.node[0, 0]
            y = self.own_coordinates(cases.node[:, 0], cases.force[:, 0], stiffness, inertia)[0]
            for plane, q, own_q in ((out.real, modal[0].real, y.real), (out.imag, modal[0].imag, y.imag)):
                np.add(q.astype(kind) @ shapes, own_q.astype(kind) @ own[node], out=plane[0])
            return out
        if cases.node.shape[1] == 1:
            self._evaluate_by_load(cases, modal, shapes, own, out)
        else:
            for i in range(len(cases)):
                out[i] = combine(modal[i:i + 1], shapes)[0]
                for j in range(cases.node.shape[1]):
                    y = self.own_coordinates(cases.node[i:i + 1, j], cases.force[i:i + 1, j], stiffness[i], inertia[i])
                    out[i] += combine(y, own[cases.node[i, j]])[0]
        return out

    def _evaluate_by_load(self, cases: CaseArrays, modal: np.ndarray, shapes: np.ndarray, own: np.ndarray,
                          out: np.ndarray) -> None:
        """One matrix product a load: the modes stay in cache, each load's own vectors are read once."""
        node = cases.node[:, 0]
        coordinates = np.concatenate([modal, self.own_coordinates(node, cases.force[:, 0], *_point(cases))], axis=1)
        m, kind = len(shapes), shapes.dtype
        stack = np.empty((m + own.shape[1], shapes.shape[1]), dtype=kind)
        stack[:m] = shapes
        order = np.argsort(node, kind="stable")
        for group in np.split(order, np.flatnonzero(np.diff(node[order])) + 1):
            stack[m:] = own[node[group[0]]]
            for start in range(0, len(group), BLOCK):
                part = group[start:start + BLOCK]
                plane = planes(coordinates[part], kind) @ stack
                for i, row in enumerate(part):  # row by row: contiguous, where an indexed assignment would copy twice
                    out[row].real, out[row].imag = plane[i], plane[len(part) + i]

    # ---- the certificate ------------------------------------------------------------------------------------

    def _gram_of_residuals(self, found: LoadVectors) -> np.ndarray:
        """(n_load, n_load) ndarray: see :attr:`next_gram`."""
        return gram(found.following, self.scene.model.stiffness)

    def _residual_norm(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
        stiffness, inertia = _point(cases)
        share, size = np.empty(cases.node.shape, dtype=complex), np.zeros(len(cases))
        for j in range(cases.node.shape[1]):
            node = cases.node[:, j]
            y = self.own_coordinates(node, cases.force[:, j], stiffness, inertia)
            share[:, j] = self._residual_share(node, y)
            size += np.einsum("cp,cp->c", np.abs(y), self.own_size[node])
        return inertia[:, 0] * quadratic(self.next_gram, cases.node, share), self.n_vectors * size

    def _residual_of_one(self, node: int, force: complex, stiffness: complex, inertia: float) -> tuple[float, float]:
        y = self.own_coordinates(node, force, stiffness, inertia)
        share, size = np.abs(self._residual_share(node, y)), max(float(self.next_gram[node, node]), 0.0)
        return inertia * float(share) * math.sqrt(size), self.n_vectors * float(np.abs(y) @ self.own_size[node])

    def _residual_share(self, node, y) -> np.ndarray:
        """(n_case,) ndarray: one force's residual, K^-1 r over omega^2, in units of the vector of `next_gram`."""
        raise NotImplementedError

    def energy_norm(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray: ``sqrt(u^H K u)`` of the answer, exact for one force, an upper bound for several."""
        stiffness, inertia = _point(cases)
        modal = np.sqrt((np.abs(self.coordinates(cases)) ** 2) @ self.eigenvalue)
        own = sum(np.linalg.norm(self.own_coordinates(cases.node[:, j], cases.force[:, j], stiffness, inertia), axis=1)
                  for j in range(cases.node.shape[1]))
        return np.hypot(modal, own)


class ModalStatic(ModalWithLoadVectors):
    """Modes plus residual flexibility: the left-out modes answer as they would at 0 Hz. Setting: ``modes``."""

    name: ClassVar[str] = "modal-static"
    summary: ClassVar[str] = "modes plus residual flexibility: each load's own static response of the left-out modes"
    colour: ClassVar[str] = "#882255"
    static_reason: ClassVar[str] = "its static part alone is already the exact answer: that is `superposition`"
    n_vectors = 1

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve(tuple({"modes": within(scene, count)} for count in (20, 60, 160)))

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"modes": within(scene, 20)},))

    def own_coordinates(self, node, force, stiffness, inertia) -> np.ndarray:
        return (self.first[node] * np.asarray(force)[..., None]) / stiffness

    def _gram_of_residuals(self, found: LoadVectors) -> np.ndarray:
        # K^-1 r = omega^2 K^-1 M q_1 y = omega^2 (theta q_1 + beta q_2) y
        rows = found.theta[:, :1] * found.vectors[:, 0] + found.beta[:, None] * found.following
        return gram(rows, self.scene.model.stiffness)

    def _residual_share(self, node, y) -> np.ndarray:
        return y[..., 0]


class ModalKrylov(ModalWithLoadVectors):
    """Modes plus a few load-dependent vectors of each load, Galerkin on both. Settings: ``modes``, ``vectors``."""

    name: ClassVar[str] = "modal-krylov"
    summary: ClassVar[str] = "modes plus a few load-dependent (Krylov) vectors of each load, with an error certificate"

    colour: ClassVar[str] = "#332288"
    static_reason: ClassVar[str] = "its first vector alone is already the exact answer: that is `superposition`"

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        few, many = within(scene, 20), within(scene, 40)
        single = {"modes": many, "precision": "float32"}
        return Curve(({"modes": few, "vectors": 3}, {"modes": few, "vectors": 5},
                      *({"vectors": vectors, **single} for vectors in (6, 8, 10)), {"modes": many, "vectors": 10}),
                     headline=4)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        few = within(scene, 20)
        return Curve(({"modes": few, "vectors": 3}, {"modes": few, "vectors": 6}))

    def __init__(self, scene: LinearScene, modes: int | None = 40, vectors: int = 6, precision: str = "float64"
                 ) -> None:
        if vectors < 1:
            raise ValueError(f"vectors={vectors} is too few: give one or more, or use the method `modal`")
        super().__init__(scene, modes, precision)
        self.settings["vectors"] = vectors

    def own_coordinates(self, node, force, stiffness, inertia) -> np.ndarray:
        return (self.first[node] * np.asarray(force)[..., None]) / (stiffness - inertia * self.theta[node])

    def _residual_share(self, node, y) -> np.ndarray:
        return self.beta[node] * (self.last[node] * y).sum(axis=-1)


def _point(cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
    """1 + i eta and omega^2, each (n_case, 1)."""
    omega = 2.0 * np.pi * cases.frequency
    return (1.0 + 1j * cases.loss_factor)[:, None], (omega * omega)[:, None]
