"""A proven bound of any answer's error from its residual: theorems 1 and 2 of :mod:`rom.metamodels.bounds`.

The residual r = f - Z u_hat of an answer, wherever it comes from, makes an error e = Z^-1 r. With the scene's modes
its part in their span is known but for their defects: with s = X^T r and q_k = s_k / (c theta_k - w),

    e = X q + e',    Z e' = r - M X s - c D q =: r'.

Theorem 2 bounds e' by ``||r'||*``, which takes one static solve; along the modes r' is only what they lack of
orthogonality. The true answer u = u_hat + X q + e' splits alike: with e' = X a + v and u_hat + X q = X b + y (X^T K y
= 0),

    ||e||^2 <= (||X q|| + ||X a||)^2 + ||v||^2,    ||u||^2 >= (||X b|| - ||X a||)^2 + (||y|| - ||v||)^2,

which makes the bound relative. In statics the solve gives e itself. Residuals are summed in extended precision where
answers are good, and what their rounding may hide is added (:mod:`rom.fullorder.energy_norm`).
"""

from __future__ import annotations

from functools import cached_property
from typing import cast

import numpy as np

from rom.fullorder import Modes, SecondOrderModel
from rom.fullorder.energy_norm import SUMS, UNIT, EnergyNorm, gamma, unit_roundoff
from rom.fullorder.poles import Poles, operating_points
from rom.metamodels.bounds import split_error
from rom.metamodels.mode_split import STEPS, ModeSplit
from rom.relative import relative
from rom.scenes import CaseArrays, LinearScene

MODES = 40
"""Modes that the split is made with: they reach well beyond the band of every scene."""
BLOCK = 64
"""Cases assessed at once: right-hand sides of one static solve."""
ROUGH = 1e-4
"""Error above which residuals in double precision are good enough: their rounding is about 1e-9 of the answer."""


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
    def energy(self) -> EnergyNorm:
        """Norms of the model, rounding included."""
        return EnergyNorm(self.model)

    @cached_property
    def modes(self) -> Modes:
        """The modes of the split."""
        return self.model.natural_modes(count=max(1, min(MODES, self.model.n // 4)))

    @cached_property
    def split(self) -> ModeSplit:
        """What is known of their quality."""
        return ModeSplit.of(self.energy, self.modes)

    @property
    def has_modes(self) -> bool:
        """Whether the modes are there already."""
        return "modes" in self.__dict__

    @cached_property
    def _mass_shape(self) -> np.ndarray:
        return self.model.mass @ self.modes.shape

    @cached_property
    def load_size(self) -> np.ndarray:
        """(n_load,) ndarray [J^1/2 N^-1]: bound of ``||b||*`` of each unit load."""
        return self.energy.plain_dual(np.ascontiguousarray(self.scene.unit_loads.T))

    def load_rounding(self, cases: CaseArrays) -> np.ndarray:
        """What summing the load in double precision may change of the answer, resonance aside.

        The load differs from the sum of its forces by ``|df| <= (q + 3) u sum |F_j b_j|`` for q forces. Forces that
        nearly cancel leave it as large as each of them makes it.

        Returns
        -------
        (n_case,) ndarray [J^1/2]
        """
        return (cases.node.shape[1] + 3) * UNIT * self._whole_load(cases)

    def _whole_load(self, cases: CaseArrays) -> np.ndarray:
        return np.einsum("cf,cf->c", np.abs(cases.force), self.load_size[cases.node])

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
        field, matrices = values.T, self.energy.matrices(kind)
        force = self.scene.force_vectors(cases)
        if not self.scene.harmonic:
            return np.asarray(force - matrices[0] @ np.ascontiguousarray(field, dtype=kind), dtype=float)
        one = kind(1.0)
        inertia = (2.0 * np.pi * cases.frequency) ** 2 * one
        eta = cases.loss_factor * one
        real: np.ndarray = np.ascontiguousarray(field.real, dtype=kind)
        imag: np.ndarray = np.ascontiguousarray(field.imag, dtype=kind)
        k_real, k_imag = (matrices[0] @ part for part in (real, imag))
        left_real = force.real - (k_real - eta * k_imag - inertia * (matrices[1] @ real))
        left_imag = force.imag - (k_imag + eta * k_real - inertia * (matrices[1] @ imag))
        if self.model.loss_stiffness is not None:
            lossy = self.model.loss_stiffness.astype(kind)
            left_real, left_imag = left_real + lossy @ imag, left_imag - lossy @ real
        return left_real.astype(float) + 1j * left_imag.astype(float)

    def _residual_rounding(self, cases: CaseArrays, values: np.ndarray, residual: np.ndarray, kind: type) -> np.ndarray:
        """(n_case,) ndarray: what rounding may hide in residuals (n_case, n), in the norm ||.||*."""
        stiffness, mass = np.ones(len(cases)), np.zeros(len(cases))
        if self.scene.harmonic:
            stiffness, mass = np.sqrt(1.0 + cases.loss_factor ** 2), (2.0 * np.pi * cases.frequency) ** 2
        hidden = self.energy.product_error(self.energy.size(values), stiffness, mass, terms=6, kind=kind)
        if self.model.loss_stiffness is not None and self.scene.harmonic:
            hidden = hidden + self.energy.reach * gamma(self.energy.row_length + 9, kind) * self._loss_spread * \
                self.energy.size(values)
        return (hidden + 4 * unit_roundoff(kind) * self._whole_load(cases) + 2 * UNIT * self.energy.plain_dual(residual)
                + self.load_rounding(cases))

    @cached_property
    def _loss_spread(self) -> float:
        return self.energy.spread_of(self.model.loss_stiffness)

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
        step = self._static
        if self.scene.harmonic:
            step = self._harmonic if self.model.loss_stiffness is None else self._lossy
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
        return _ratio(*self.static_errors(cases, values, kind))

    def static_errors(self, cases: CaseArrays, values: np.ndarray, kind: type = np.longdouble
                      ) -> tuple[np.ndarray, np.ndarray]:
        """Theorem 1: bound of the error, and least energy norm of the true answer, both (n_case,) [J^1/2]."""
        residual = np.ascontiguousarray(self.residuals(cases, values, kind).T)
        response, miss, norm = self.energy.dual(residual)
        hidden = self._residual_rounding(cases, values, residual, kind)
        true = values + response
        return (norm + hidden) * SUMS, self.energy.norms(true)[0] - self._sum_rounding(true, 1) - miss - hidden

    def _sum_rounding(self, fields: np.ndarray, terms: int) -> np.ndarray:
        """(k,) ndarray: energy norm of the rounding of fields (k, n) that were summed, as far as they are no smaller
        than what was summed."""
        return gamma(terms + 2) * np.sqrt(self.energy.spread) * self.energy.size(fields) * SUMS

    def _lossy(self, cases: CaseArrays, values: np.ndarray, kind: type) -> np.ndarray:
        """Beside a loss stiffness only the uniform loss factor is sure to take energy (theorem 2, without modes)."""
        residual = np.ascontiguousarray(self.residuals(cases, values, kind).T)
        norm = self.energy.dual(residual)[2] + self._residual_rounding(cases, values, residual, kind)
        with np.errstate(divide="ignore", invalid="ignore"):
            miss = norm * SUMS / cases.loss_factor
        return _ratio(miss, self.energy.norms(values)[0] - miss)

    def _harmonic(self, cases: CaseArrays, values: np.ndarray, kind: type) -> np.ndarray:
        energy, split, shape = self.energy, self.split, self.modes.shape
        theta, size = split.eigenvalue, energy.size(np.ascontiguousarray(shape.T))
        stiffness, inertia = operating_points(cases.frequency, cases.loss_factor)
        c, w = np.abs(stiffness[:, 0]), inertia[:, 0]
        residual = np.ascontiguousarray(self.residuals(cases, values, kind).T)
        hidden = self._residual_rounding(cases, values, residual, kind)
        along = residual @ shape  # s as computed: q follows from it, whatever its rounding
        together = float(np.sqrt(np.sum(size ** 2 / theta)))
        seen = gamma(len(shape) + 2) * together * energy.size(residual / energy.diagonal)
        seen = seen + split.mass_deviation * np.sqrt(np.abs(along) ** 2 @ theta)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            share = Poles.of_modes(theta).at(along, stiffness, inertia)
            strength = np.abs(share)
            rest = residual - along @ self._mass_shape.T
            norm = energy.dual(rest)[2] + 2 * UNIT * energy.plain_dual(rest) + energy.product_error(
                np.abs(along) @ size, 0.0, 1.0, terms=len(theta) + 2)
            small = hidden + c * (strength @ split.defect) + STEPS * UNIT * (
                c * (strength @ (theta * split.norm)) + w * (strength @ split.norm))
            beyond, each, coupling, off = split.amplifications(stiffness, inertia)
            deviation = np.sqrt(1.0 + split.stiff_deviation)
            outside, inside = split_error(beyond, each.max(axis=1), coupling, off, norm + small,
                                          seen + deviation * small)
            inside = inside * deviation
            known = share @ shape.T
            lost = gamma(len(theta) + 3) * np.sqrt(energy.spread) * (strength @ size)
            miss = np.hypot(energy.norms(known)[1] + lost + inside, outside) * SUMS
            # the true answer, X (b + a) + (y + v): what is left of each part
            true = values + known
            image = energy.image(true)
            least = energy.norms(true, image)[0]
            lost = lost + self._sum_rounding(true, 1)
            kept = np.linalg.norm((image @ shape) / np.sqrt(theta), axis=1)
            doubt = energy.inner_doubt * energy.size(true) * together + lost
            tilt = 2.0 * split.stiff_deviation
            kept_most = (kept + doubt) * (1.0 + tilt) * SUMS
            outer = np.sqrt(np.maximum(least * least - kept_most * kept_most, 0.0))
            true_size = np.hypot(np.maximum((kept - doubt) * (1.0 - tilt) - inside, 0.0),
                                 np.maximum(outer - outside - lost, 0.0)) / SUMS
            found = _ratio(miss, true_size)
        return np.where(np.isfinite(found) & (split.stiff_deviation < 0.25), found, np.inf)


def _ratio(miss: np.ndarray, size: np.ndarray) -> np.ndarray:
    return relative(miss, np.maximum(np.nan_to_num(size, nan=0.0), 0.0))
