"""How the modal family bounds its own error, without a solve.

The residual of every answer of the family is orthogonal to the kept modes, so that

    ||e||_K <= max_(k > m) lambda_k / |lambda_k (1 + i eta) - omega^2| * ||r||_(K^-1).

Each method knows ||r||_(K^-1) as a quadratic form in one number a force, with a matrix over all pairs of loads that is
made offline: of what the modes leave of the loads (`modal`), or of the vector that would come next (the others). What
the modes leave of the loads bounds the true answer from below, ||u||_K^2 >= sum lambda_k |c_k|^2 + ||f'||^2_(K^-1) /
max_(k > m) |1 + i eta - omega^2 / lambda_k|^2, and so makes the bound relative. Rounding and the computed modes' own
defects are added; a resonance of the kept modes amplifies them.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import ClassVar

import numpy as np

from rom.fullorder import Modes
from rom.metamodels.certificate import (
    UNIT_ROUNDOFF,
    amplification_beyond,
    gram,
    mode_defect,
    quadratic,
    rounding_size,
)
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.stored import Stored
from rom.metamodels.validity import Assessment, joined
from rom.scenes import CaseArrays


class ModalCertificate(Metamodel):
    """The certificate of a method that keeps the lowest modes; the parent of `Modal`."""

    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("rest_gram", ("load", "other_load"), "K^-1 products of what the modes leave of the loads", "J N-2"),
        Stored("defect", ("mode",), "defect", "J0.5 kg-0.5 m-1"),
        Stored("shape_size", ("mode",), "rounding size", "J0.5 kg-0.5 m-1"))

    eigenvalue: np.ndarray
    """(m,) ndarray [rad^2/s^2]"""
    next_eigenvalue_bound: float
    """No mode below this is missing [rad^2/s^2]."""
    rest_gram: np.ndarray
    """(n_load, n_load) ndarray [J N^-2]: K^-1 products of what the modes leave of the unit loads."""
    shape_size: np.ndarray
    """(m,) ndarray: :func:`rounding_size` of each stored mode, for the share of rounding in the bound."""
    defect: np.ndarray
    """(m,) ndarray: :func:`mode_defect` of each mode."""

    participation: np.ndarray
    """(n_load, m) ndarray: mode shape times unit load [N kg^-1/2]."""

    @staticmethod
    def _force_sum(per_load: np.ndarray, cases: CaseArrays) -> np.ndarray:
        if cases.node.shape[1] == 1:
            return per_load[cases.node[:, 0]] * cases.force
        return np.einsum("cf,cfk->ck", cases.force, per_load[cases.node])

    def _prepare_certificate(self, modes: Modes, fields: np.ndarray, rest: np.ndarray) -> None:
        """Keep what the bound needs of modes, their stored ``fields`` (m, n) and ``rest`` (n_load, n).

        ``rest`` holds the static responses to the unit loads, less what the modes carry of them.
        """
        model = self.scene.model
        self.rest_gram = gram(rest, model.stiffness)
        self.defect = mode_defect(model, modes)
        self.shape_size = rounding_size(model.stiffness, fields)
        self.__dict__.pop("_weights", None)

    def _residual_norm(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
        """||r||_(K^-1) of each answer, and what rounding adds from vectors beside the modes, both (n_case,) [J^1/2]."""
        return quadratic(self.rest_gram, cases.node, cases.force), np.zeros(len(cases))

    def error_bound(self, cases: CaseArrays) -> np.ndarray:
        """Rigorous bound of the energy norm of the error.

        Parameters
        ----------
        cases : CaseArrays

        Returns
        -------
        (n_case,) ndarray [J^1/2]
            ``sqrt(e^H K e) <= bound``: truncation, rounding of the stored fields, defects of the computed modes.
        """
        return self._bounds(cases)[0]

    def relative_bound(self, cases: CaseArrays) -> np.ndarray:
        """(n_case,) ndarray: rigorous bound of ``sqrt(e^H K e) / sqrt(u^H K u)``; infinite where there is none."""
        bound, least = self._bounds(cases)
        found = np.divide(bound, least, out=np.full(len(cases), np.inf), where=least > 0)
        found[(bound == 0) & (least == 0)] = 0.0
        return np.where(np.isfinite(found), found, np.inf)

    def _bounds(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
        """Bound of the error, and least energy norm of the true answer, both (n_case,) [J^1/2]."""
        if cases.node.size == 1:
            return self._bounds_of_one(cases)
        stiffness, inertia = 1.0 + 1j * cases.loss_factor, (2.0 * np.pi * cases.frequency) ** 2
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            beyond = amplification_beyond(self.next_eigenvalue_bound, stiffness, inertia)
            each = 1.0 / np.abs(stiffness[:, None] - inertia[:, None] / self.eigenvalue)
            modal = np.abs(self._force_sum(self.participation, cases)) * each / self.eigenvalue  # |coordinates|
            # forces that nearly cancel leave rounding of the size of each alone, not of their sum
            added = modal
            if cases.node.shape[1] > 1:
                apart = CaseArrays(cases.node, np.abs(cases.force), cases.frequency, cases.loss_factor)
                added = self._force_sum(np.abs(self.participation), apart) * each / self.eigenvalue
            lost = 4 * cases.node.shape[1] * UNIT_ROUNDOFF["float64"]
            residual, size = self._residual_norm(cases)
            terms = len(self.eigenvalue) + 2 * cases.node.shape[1] + 8
            shape_size, defect, doubt = self._weights
            damped = np.abs(stiffness)
            unsure = damped * ((each * modal) @ doubt)
            # a defect is orthogonal to no mode, so a resonance of the kept ones amplifies it too
            anywhere = np.maximum(beyond, each.max(axis=1))
            bound = beyond * residual + damped * anywhere * (modal @ defect) + unsure + (
                terms * UNIT_ROUNDOFF[self.settings["precision"]] * (size + added @ shape_size))
            spread = np.maximum(damped, np.abs(stiffness - inertia / self.next_eigenvalue_bound))
            rest = quadratic(self.rest_gram, cases.node, cases.force, below=True) / spread
            sure = np.maximum(modal - lost * added, 0.0)
            least = np.sqrt((sure * sure) @ self.eigenvalue + rest * rest) - unsure
            bound[np.isnan(bound)] = np.inf
            return bound, np.where(np.isfinite(least), np.maximum(least, 0.0), 0.0)

    def _bounds_of_one(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray]:
        """The same for one case of one force, in as few steps as can be: a bound must cost less than its answer."""
        node, force = int(cases.node[0, 0]), complex(cases.force[0, 0])
        omega = 2.0 * math.pi * float(cases.frequency[0])
        stiffness, inertia = complex(1.0, cases.loss_factor[0]), omega * omega
        shape_size, defect, doubt = self._weights
        with np.errstate(all="ignore"):
            distance = np.abs(stiffness - inertia / self.eigenvalue)
            modal = np.abs(self.participation[node]) / (self.eigenvalue * distance)
            residual, size = self._residual_of_one(node, force, stiffness, inertia)
            strength, damped = abs(force), abs(stiffness)
            gap = abs(stiffness - min(inertia / self.next_eigenvalue_bound, 1.0))
            beyond = 1.0 / gap if gap > 0 else math.inf
            nearest = float(distance.min(initial=math.inf))
            anywhere = max(beyond, 1.0 / nearest if nearest > 0 else math.inf)
            unsure = damped * strength * float((modal / distance) @ doubt)
            rounding = (len(modal) + 10) * UNIT_ROUNDOFF[self.settings["precision"]]
            bound = beyond * residual + damped * anywhere * strength * float(modal @ defect) + unsure + rounding * (
                size + strength * float(modal @ shape_size))
            spread = max(damped, abs(stiffness - inertia / self.next_eigenvalue_bound))
            rest = strength * math.sqrt(max(float(self.rest_gram[node, node]), 0.0)) / spread
            least = math.sqrt(strength * strength * float((modal * modal) @ self.eigenvalue) + rest * rest) - unsure
        return (np.array([math.inf if math.isnan(bound) else bound]),
                np.array([max(least, 0.0) if math.isfinite(least) else 0.0]))

    def _residual_of_one(self, node: int, force: complex, stiffness: complex, inertia: float) -> tuple[float, float]:
        """:meth:`_residual_norm` of one case of one force."""
        return abs(force) * math.sqrt(max(float(self.rest_gram[node, node]), 0.0)), 0.0

    @cached_property
    def _weights(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """By mode: rounding of the stored shape, defect, and the rounding of phi^T K phi in the eigenvalue."""
        return (self.shape_size, self.defect,
                UNIT_ROUNDOFF["float64"] * self.shape_size ** 2 / np.sqrt(self.eigenvalue))

    def indicators(self, cases: CaseArrays) -> dict[str, tuple]:
        bound, least = self._bounds(cases)
        relative = np.divide(bound, least, out=np.full(len(cases), np.inf), where=least > 0)
        return {
            "energy_error_bound": (("case",), bound, {
                "long_name": "rigorous bound of sqrt(e^H K e)", "units": "J0.5"}),
            "relative_energy_error_bound": (("case",), relative, {
                "long_name": "rigorous bound of sqrt(e^H K e) / sqrt(u^H K u)", "units": "1"})}

    def reasons(self, cases: CaseArrays) -> np.ndarray:
        highest = np.sqrt(self.next_eigenvalue_bound) / (2 * np.pi)
        found = np.where(cases.frequency >= highest,
                         f"frequency beyond the modes kept, which reach {highest:.4g} Hz", "")
        nearest = np.abs((2.0 * np.pi * cases.frequency[:, None]) ** 2 / self.eigenvalue - 1.0).min(axis=1)
        return joined(found, np.where((cases.loss_factor == 0.0) & (nearest < 1e-6),
                                      "undamped and within a millionth of a resonance", ""))

    def quick_assessment(self, cases: CaseArrays) -> Assessment:
        return Assessment(self.relative_bound(cases), "bound", self.reasons(cases)).with_large_errors_named()

    def assess(self, cases: CaseArrays, values: np.ndarray | None = None) -> Assessment:
        return self.quick_assessment(cases)
