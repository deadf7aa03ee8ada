"""A bound of any answer's error from its residual: the modal split.

The residual r = f - Z u_hat of an answer, wherever it comes from, makes an error e = Z^-1 r. With natural modes
(lambda_k, phi_k), k <= m, its part in their span is exact,

    e_m = sum phi_k c_k,    c_k = phi_k^T r / (lambda_k (1 + i eta) - omega^2),

and the rest is bounded by the residual r' = r - sum M phi_k phi_k^T r that is orthogonal to them,

    ||e - e_m||_K <= a ||r'||_(K^-1),    a = max_(k > m) lambda_k / |lambda_k (1 + i eta) - omega^2|,

rigorous since a Sturm count proves that no mode below lambda_(m+1) is missing; the K^-1 norm takes one static solve.
The true answer is u = (u_hat + e_m) + (e - e_m), known in the modes' span, which turns the bound into a relative one.
In statics the same solve gives e itself. Without modes (m = 0) the amplification is at most 1 / eta, attained where
omega^2 / lambda_k = 1.
"""

from __future__ import annotations

from functools import cached_property
from typing import cast

import numpy as np
import scipy.sparse as sp

from rom.fullorder import Modes, SecondOrderModel
from rom.metamodels.certificate import amplification_beyond, amplification_of, mode_defect
from rom.scenes import CaseArrays, LinearScene

MODES = 40
"""Modes that the split is made with: they reach well beyond the band of every scene."""
BLOCK = 64
"""Cases assessed at once: right-hand sides of one static solve."""
ROUGH = 1e-4
"""Error above which residuals in double precision are good enough: their rounding is about 1e-9 of the answer."""
SOLVE_SAFETY = 1e-6
"""Allowance, relative, for the rounding of the static solves in the norms they give."""


def residual_bound(scene: LinearScene) -> ResidualBound:
    """The scene's own, made once and shared by all of its metamodels."""
    if "_residual_bound" not in scene.__dict__:  # as functools.cached_property keeps its values, frozen class or not
        scene.__dict__["_residual_bound"] = ResidualBound(scene)
    return cast(ResidualBound, scene.__dict__["_residual_bound"])


class ResidualBound:
    """Bounds of answers to the cases of one scene; factor of K and modes are made when first needed."""

    def __init__(self, scene: LinearScene) -> None:
        self.scene = scene

    @property
    def model(self) -> SecondOrderModel:
        """The full-order model, whose factor of K serves all norms."""
        return self.scene.model

    @cached_property
    def modes(self) -> Modes:
        """The modes of the split."""
        return self.model.natural_modes(count=min(MODES, self.model.n // 4))

    @cached_property
    def _mass_shape(self) -> np.ndarray:
        return self.model.mass @ self.modes.shape

    @cached_property
    def _defect(self) -> np.ndarray:
        return mode_defect(self.model, self.modes)

    @cached_property
    def _long(self) -> list[sp.csr_array]:
        """K, and M where there is one, in extended precision (double where the machine has none)."""
        return [matrix.astype(np.longdouble) for matrix in self._matrices(float)]

    def _matrices(self, kind: type) -> list[sp.csr_array]:
        if kind is not float:
            return self._long
        return [self.model.stiffness] + ([self.model.mass] if self.scene.harmonic else [])

    def rounding(self, kind: type = np.longdouble) -> float:
        """What rounding of the residual may add to the relative error in the energy norm, resonance aside.

        Unit roundoff of its sums times the condition number of K.
        """
        return float(np.finfo(kind).eps) * self._condition

    @cached_property
    def _condition(self) -> float:
        largest = float(abs(self.model.stiffness).sum(axis=1).max())
        return largest / self._smallest

    @cached_property
    def _smallest(self) -> float:
        """Smallest eigenvalue of K [N/m], on the safe side."""
        vector = np.random.default_rng(0).standard_normal(self.model.n)
        for _ in range(6):
            vector = self.model.solve_static(vector / np.linalg.norm(vector))
        return float(0.5 / np.linalg.norm(vector))  # a Rayleigh quotient comes from above: half of it is safe

    @cached_property
    def _load_size(self) -> np.ndarray:
        """(n_load,) ndarray [J^1/2 N^-1]: ``||b||_(K^-1)`` of each unit load at most, whatever its entries' signs."""
        return np.linalg.norm(self.scene.unit_loads, axis=0) / np.sqrt(self._smallest)

    def load_rounding(self, cases: CaseArrays) -> np.ndarray:
        """What summing the load in double precision may change of the answer, resonance aside.

        The load differs from the sum of its forces by ``|df| <= (q + 1) u sum |F_j b_j|`` for q forces, which moves
        the static answer by ``||df||_(K^-1)``. Forces that nearly cancel leave it as large as each of them makes it.

        Returns
        -------
        (n_case,) ndarray [J^1/2]
        """
        terms = (cases.node.shape[1] + 1) * 2.0 ** -53
        return terms * np.einsum("cf,cf->c", np.abs(cases.force), self._load_size[cases.node])

    def residuals(self, cases: CaseArrays, values: np.ndarray, kind: type = np.longdouble) -> np.ndarray:
        """f - Z u_hat, summed in extended precision, rounded once.

        Parameters
        ----------
        cases : CaseArrays
        values : (n_case, n_free) ndarray [m]
        kind : type
            Precision of the sums: extended, or float for answers so rough that it makes no difference.

        Returns
        -------
        (n_free, n_case) ndarray [N]
        """
        field = values.T
        if not self.scene.harmonic:
            product = self._matrices(kind)[0] @ np.ascontiguousarray(field, dtype=kind)
            return np.asarray(self.scene.force_vectors(cases) - product, dtype=float)
        stiff, inert = self._matrices(kind)
        one = kind(1.0)
        inertia = (2.0 * np.pi * cases.frequency) ** 2 * one
        eta = cases.loss_factor * one
        real: np.ndarray = np.ascontiguousarray(field.real, dtype=kind)
        imag: np.ndarray = np.ascontiguousarray(field.imag, dtype=kind)
        k_real, k_imag = stiff @ real, stiff @ imag
        force = self.scene.force_vectors(cases)
        left_real = force.real - (k_real - eta * k_imag - inertia * (inert @ real))
        left_imag = force.imag - (k_imag + eta * k_real - inertia * (inert @ imag))
        return left_real.astype(float) + 1j * left_imag.astype(float)

    def bound(self, cases: CaseArrays, values: np.ndarray) -> np.ndarray:
        """Bound of the relative error in the energy norm.

        Parameters
        ----------
        cases : CaseArrays
        values : (n_case, n_free) ndarray [m]
            Answers, full field.

        Returns
        -------
        (n_case,) ndarray
            Infinite where nothing can be bounded, as at an undamped resonance.
        """
        out = np.empty(len(cases))
        step = self._harmonic if self.scene.harmonic else self._static
        for start in range(0, len(cases), BLOCK):
            block, field = cases.take(slice(start, start + BLOCK)), np.asarray(
                values[start:start + BLOCK], dtype=self.scene.dtype)
            found = step(block, field, float)
            fine = found < ROUGH
            if fine.any():
                found[fine] = step(block.take(fine), field[fine], np.longdouble)
            out[start:start + BLOCK] = found
        return out

    def _static(self, cases: CaseArrays, values: np.ndarray, kind: type) -> np.ndarray:
        residual = self.residuals(cases, values, kind)
        error = self.model.static_factorization.solve(residual)
        miss = np.sqrt(np.maximum(np.einsum("nc,nc->c", residual, error), 0.0))
        true = energy_norms(values.T + error, self.model.stiffness)
        load = self.load_rounding(cases)
        return _relative(miss * (1.0 + SOLVE_SAFETY) + load, true * (1.0 - SOLVE_SAFETY) - load) + (
            self.rounding(kind) * (true > 0))

    def _harmonic(self, cases: CaseArrays, values: np.ndarray, kind: type) -> np.ndarray:
        modes = self.modes
        stiffness, inertia = 1.0 + 1j * cases.loss_factor, (2.0 * np.pi * cases.frequency) ** 2
        residual = self.residuals(cases, values, kind)
        force = modes.shape.T @ residual
        with np.errstate(divide="ignore", invalid="ignore"):
            share = force / (modes.eigenvalue[:, None] * stiffness - inertia)
            known = np.sqrt(modes.eigenvalue @ np.abs(share) ** 2)
            rest = residual - self._mass_shape @ force
            norm = np.sqrt(np.maximum(np.einsum(
                "nc,nc->c", rest.conj(), self.model.static_factorization.solve(rest)).real, 0.0))
            # no mode at all above the last when all are kept: the bound is infinite, the amplification that of statics
            beyond = amplification_beyond(modes.next_eigenvalue_bound, stiffness, inertia)
            anywhere = np.maximum(beyond, amplification_of(modes.eigenvalue, stiffness, inertia))
            left = beyond * norm + anywhere * np.abs(stiffness) * (self._defect @ np.abs(share))
            left = left * (1.0 + SOLVE_SAFETY) + anywhere * self.load_rounding(cases)
            # u's part in the modes is known, and the rest of u is at least that of u_hat less what is left
            inside = self._mass_shape.T @ values.T
            outer = energy_norms(values.T - modes.shape @ inside, self.model.stiffness)
            kept = np.sqrt(modes.eigenvalue @ np.abs(inside + share) ** 2)
            least = np.hypot(kept, np.maximum(outer - left, 0.0))
            found = _relative(np.hypot(known, left), least) + anywhere * self.rounding(kind) * (least > 0)
        return np.where(np.isfinite(found), found, np.inf)


def energy_norms(fields: np.ndarray, stiffness: sp.sparray) -> np.ndarray:
    """(n_case,) ndarray: ``sqrt(u^H K u)`` of the columns of ``fields`` (n, n_case) [J^1/2]."""
    parts = (fields.real, fields.imag) if np.iscomplexobj(fields) else (fields,)
    return np.sqrt(np.maximum(sum(np.einsum("nc,nc->c", part, stiffness @ np.ascontiguousarray(part))
                                  for part in parts), 0.0))


def _relative(miss: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Their ratio; 0 for nothing missed, infinite where the size is not positive."""
    ratio = np.divide(miss, size, out=np.full(len(miss), np.inf), where=size > 0)
    return np.where(miss == 0.0, 0.0, ratio)
