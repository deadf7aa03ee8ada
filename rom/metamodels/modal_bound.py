"""How the modal methods bound their own error, without a solve: theorems 2 and 4 of :mod:`rom.metamodels.bounds`.

With the stored participations p = sum F_j p_j, the answer u_hat = X q + sum_j V_j y_j, q_k = p_k / z_k, z_k = c
theta_k - w, leaves the residual

    r = sum_j F_j f'_j - c D q + M X (p - Z q),                           f'_j = b_j - M X p_j   (`modal`)

and with vectors v_ji of each load's own, whatever they are, that satisfy f'_j = K sum_i first_ji v_ji + h_j0 and
M v_ji = theta_ji K v_ji + share_ji K n_j + h_ji with measured defects h and a next vector n_j,

    r = w sum_j (share_j . y_j) K n_j + w sum_ji y_ji h_ji + sum_j F_j h_j0 - c D q + M X (p - Z q)
        + K sum_ji v_ji (first_ji F_j - (c - w theta_ji) y_ji).

The first sum counts, once for all pairs of loads, as an energy of the vectors n_j; the rest is small: defects, and
the rounding of the coordinates, at most 13 u of each numerator and of each term of its pole. A vector h is as small
along the modes as it is, ``|Theta^-1/2 X^T h|_2 <= sqrt(1 + kappa_K) ||h||*``; of n_j this part is measured. The load
may be summed in double precision: q forces leave ``(q + 3) u sum |F_j| (||b_j||* + sum_k |p_jk| ||M x_k||*)`` in all.
What finite precision makes of the stored shapes and of the sum comes last (theorem 5).
"""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from rom.fullorder import Modes
from rom.fullorder.energy_norm import SUMS, UNIT, EnergyNorm, block_product, gamma
from rom.metamodels.bounds import rounding_size, split_error, underflow
from rom.metamodels.energy_form import EnergyForm, merged
from rom.metamodels.mode_split import STEPS, ModeSplit
from rom.metamodels.stored import Stored
from rom.scenes import CaseArrays

UNIT_SINGLE = 2.0 ** -24 * (1.0 + 2.0 ** -20)
"""Unit roundoff of single precision, of a number that was itself rounded to double."""


class OwnDefects:
    """What load-dependent vectors lack: measured, whatever made them.

    Parameters
    ----------
    theta, share : (n_load, p) ndarray [s^2]
        See :mod:`rom.metamodels.modal_bound`.
    norm : (n_load, p) ndarray
        Bounds of ``||v||``.
    defect : (n_load, p) ndarray [s^2]
        Bounds of ``||h||*``, rounding of coordinates included as far as it grows with omega^2.
    size : (n_load, p) ndarray
        `rounding_size` of each stored vector.
    single : (n_load, 2, p, p) ndarray
        See :func:`single_forms`; empty in double precision.
    next : EnergyForm
        Of the vectors n_j.
    leak : (n_load,) ndarray
        ``|Theta^-1/2 X^T K n_j|_2``, at most.
    """

    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("norm", ("load", "vector"), "bound of the energy norm"),
        Stored("defect", ("load", "vector"), "bound of the defect", "s2"),
        Stored("size", ("load", "vector"), "rounding size"), Stored("single"),
        Stored("leak", ("load",), "share of the next vector along the modes"), Stored("next", part=EnergyForm))

    norm: np.ndarray
    defect: np.ndarray
    size: np.ndarray
    single: np.ndarray
    leak: np.ndarray
    next: EnergyForm

    @cached_property
    def of_vectors(self) -> np.ndarray:
        """(n_load, p, 3) ndarray: what a unit of each coordinate adds times c, times omega^2, and its rounding size."""
        return np.stack([STEPS * UNIT * self.norm, self.defect, self.size], axis=2)


class ModalBound:
    """The certificate that a modal method has.

    Made by :meth:`of`; :meth:`bounds` judges answers.
    """

    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("split", part=ModeSplit), Stored("rest", part=EnergyForm),
        Stored("rest_defect", ("load",), "bound of what the rests miss of the loads", "J0.5 N-1"),
        Stored("rest_leak", ("load",), "share of the loads' rests along the modes", "J0.5 N-1"),
        Stored("load_size", ("load",), "bound of the load's K^-1 norm", "J0.5 N-1"),
        Stored("modal_size", ("load",), "bound of the modal part's K^-1 norm", "J0.5 N-1"),
        Stored("size", ("mode",), "rounding size", "J0.5 kg-0.5 m-1"), Stored("single"),
        Stored("grain", (), "rounding size of a field of ones"))

    split: ModeSplit
    rest: EnergyForm
    """Of the static responses to what the modes leave of the unit loads."""
    rest_defect: np.ndarray
    rest_leak: np.ndarray
    load_size: np.ndarray
    modal_size: np.ndarray
    size: np.ndarray
    single: np.ndarray
    grain: float

    @classmethod
    def of(cls, energy: EnergyNorm, split: ModeSplit, modes: Modes, stored: np.ndarray, loads: np.ndarray,
           participation: np.ndarray, rest: np.ndarray) -> Self:
        """Measure what a method keeps.

        Parameters
        ----------
        energy : EnergyNorm
        split : ModeSplit
            Of the modes.
        modes : Modes
        stored : (m, n) ndarray
            The shapes as they are kept, in single or double precision.
        loads : (n, n_load) ndarray
        participation : (n_load, m) ndarray
            As it is kept.
        rest : (n_load, n) ndarray
            Static responses to the loads, less what the modes carry of them.
        """
        self = cls()
        self.split = split
        theta, norm = split.eigenvalue, split.norm
        strength = np.abs(participation)
        mode_size = energy.size(modes.shape.T)
        b_size = np.sqrt(np.einsum("nl,nl,n->l", loads, loads, 1.0 / energy.diagonal)) * SUMS
        self.load_size = energy.plain_dual(loads.T)
        self.modal_size = strength @ norm * SUMS
        rest_size = energy.size(rest)
        left = loads - energy.model.mass @ (modes.shape @ participation.T) - energy.model.stiffness @ rest.T
        self.rest_defect = energy.plain_dual(left.T) + 6 * UNIT * self.load_size + energy.product_error(
            rest_size, 1.0, terms=3) + energy.product_error(strength @ mode_size, 0.0, 1.0, terms=len(theta) + 3)
        # rounding of the stored participations, and what the modes lack of orthogonality
        self.rest_leak = (gamma(len(rest.T) + 2) * b_size * np.sqrt(np.sum(mode_size ** 2 / theta))
                          + split.mass_deviation * np.sqrt(participation ** 2 @ theta)) * SUMS
        self.rest = EnergyForm.of(energy, rest)
        self.size = rounding_size(energy.model.stiffness, stored)
        self.single = single_forms(energy, stored, modes.shape.T)
        self.grain = float(np.sqrt(abs(energy.model.stiffness).sum()))
        return self

    def measure_own(self, energy: EnergyNorm, modes: Modes, stored: np.ndarray, vectors: np.ndarray, first: np.ndarray,
                    theta: np.ndarray, share: np.ndarray, following: np.ndarray) -> OwnDefects:
        """Measure vectors of each load's own.

        Parameters
        ----------
        stored, vectors : (n_load, p, n) ndarray
            As kept, and in double precision.
        first, theta, share : (n_load, p) ndarray
        following : (n_load, n) ndarray
            n_j.
        """
        own = OwnDefects()
        n_load, p = vectors.shape[:2]
        own.norm, own.defect = np.empty((n_load, p)), np.empty((n_load, p))
        own.size = rounding_size(energy.model.stiffness, stored)
        stiffness, mass = energy.matrices()
        next_image, next_size = stiffness @ following.T, energy.size(following)
        next_norm = energy.norms(following)[1]
        root = np.sqrt(energy.spread)
        for load in range(n_load):
            rows, weight = vectors[load], np.abs(share[load])
            image, size = stiffness @ rows.T, energy.size(rows)
            left = mass @ rows.T - theta[load] * image - share[load] * next_image[:, [load]]
            own.norm[load] = energy.norms(rows, image.T)[1]
            own.defect[load] = energy.plain_dual(left.T) + energy.product_error(
                size, theta[load], 1.0, terms=3) + energy.product_error(next_size[load] * weight, 1.0, terms=3)
            own.defect[load] += UNIT * (STEPS * theta[load] * own.norm[load] + (p + 12) * weight * next_norm[load])
            # the rest's response was summed from these vectors
            self.rest_defect[load] += gamma(p + 2) * root * float(np.abs(first[load]) @ size) * SUMS
        own.single = np.array([single_forms(energy, *both) for both in zip(stored, vectors, strict=True)])
        along, terms = block_product(np.ascontiguousarray(modes.shape.T), next_image)
        scale = np.sqrt(modes.eigenvalue)
        doubt = (gamma(terms + energy.row_length + 3) * energy.spread + energy.asymmetry) * next_size * np.linalg.norm(
            energy.size(modes.shape.T) / scale)
        own.leak = (np.linalg.norm(along / scale[:, None], axis=0) + doubt) * SUMS
        own.next = EnergyForm.of(energy, following)
        return own

    def bounds(self, cases: CaseArrays, stiffness: np.ndarray, inertia: np.ndarray, coordinates: np.ndarray,
               own: OwnDefects | None = None, own_coordinates: np.ndarray | None = None,
               share: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Bound of the error, and least energy norm of the true answer.

        Parameters
        ----------
        cases : CaseArrays
            Their nodes are places among the loads that were measured.
        stiffness, inertia : (n_case, 1) ndarray
            c and w.
        coordinates : (n_case, m) ndarray, complex
            q.
        own : OwnDefects, optional
        own_coordinates : (n_case, n_force, p) ndarray, complex, optional
            y.
        share : (n_load, p) ndarray, optional

        Returns
        -------
        bound, least : (n_case,) ndarray [J^1/2]
        """
        split, node = self.split, cases.node
        deviation, force = np.sqrt(1.0 + split.stiff_deviation), np.abs(cases.force)
        c, w = np.abs(stiffness[:, 0]), inertia[:, 0]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            modal = np.abs(coordinates)
            beyond, each, coupling, off = split.amplifications(stiffness, inertia)
            kept = each.max(axis=1)
            with_c, with_w, defect, stored = (modal @ self._of_modes).T
            rounded = c * with_c + w * with_w
            load, of_modes, missed = np.einsum("cf,cfk->kc", force, self._of_loads[node])
            summed = (node.shape[1] + 3) * UNIT
            load, of_modes = summed * load, summed * of_modes
            missed = missed + load
            small = c * defect + rounded + of_modes + missed
            number = merged(node, cases.force)
            rest_leak = np.einsum("cf,cf->c", np.abs(number), self.rest_leak[node])
            rest_least, rest_most = self.rest.norms(node, number)
            terms, sizes = modal.shape[1] + 2, self.size.sum()
            single = _forms(self.single, coordinates) if self.single.size else 0.0
            if own is None or own_coordinates is None or share is None:
                main, leak = rest_most, rest_leak
            else:
                y = np.abs(own_coordinates)
                shares = merged(node, np.einsum("cfp,cfp->cf", share[node], own_coordinates))
                main = w * own.next.norms(node, shares)[1]
                leak = w * np.einsum("cf,cf->c", np.abs(shares), own.leak[node])
                with_c, with_w, size = np.einsum("cfp,cfpk->kc", y, own.of_vectors[node])
                small += c * with_c + w * with_w
                stored = stored + size
                terms += y.shape[1] * (y.shape[2] + 1)
                if self.single.size:
                    sizes = sizes + own.size[node].sum(axis=(1, 2))
                    for j in range(y.shape[1]):
                        single = single + _forms(own.single[node[:, j]], own_coordinates[:, j])
            outside, inside = split_error(beyond, kept, coupling, off, main + small, leak + deviation * small)
            bound = np.hypot(deviation * inside, outside) + gamma(terms) * stored
            if self.single.size:
                bound += single + underflow(sizes, self.grain)
            # theorem 4
            answer = np.sqrt((modal * modal) @ split.eigenvalue)
            along = rest_leak + rounded + of_modes + deviation * load
            tilted = (modal / each) @ split.defect
            most_outside, most_inside = split_error(beyond, kept, coupling, off, rest_most + missed + tilted,
                                                    answer / kept + along)
            spread = np.maximum(c, np.abs(stiffness[:, 0] - w / split.next_bound)) if split.next_bound > 0 else np.inf
            inner = np.maximum(answer - kept * (along + off * most_inside + coupling * most_outside), 0.0)
            outer = np.maximum(rest_least - missed - along / np.sqrt(1.0 - split.stiff_deviation) - tilted
                               - coupling * most_inside, 0.0) / spread
            least = np.sqrt((1.0 - split.stiff_deviation) * inner * inner + outer * outer) / SUMS
        bound = np.where(np.isfinite(bound), bound * SUMS, np.inf)
        return bound, np.where(np.isfinite(least), least, 0.0)

    @cached_property
    def _of_loads(self) -> np.ndarray:
        return np.stack([self.load_size, self.modal_size, self.rest_defect], axis=1)

    @cached_property
    def _of_modes(self) -> np.ndarray:
        split = self.split
        rounding = STEPS * UNIT * split.norm
        return np.stack([split.eigenvalue * rounding, rounding, split.defect, self.size], axis=1)


def single_forms(energy: EnergyNorm, stored: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """(2, k, k) ndarray: squares of what single precision costs a sum of fields (k, n), as forms of its coordinates.

    The first is the energy of what storage lost of the fields, the second that of the sum's last rounding (theorem 5).
    Empty where fields are stored in double precision.
    """
    k = len(exact)
    if stored.dtype == exact.dtype:
        return np.empty((0, k, k))
    stored = stored.astype(float)
    lost, weight = stored - exact, energy.row_sums
    n, size = len(weight), energy.size(lost)
    forms = np.stack([lost @ energy.image(lost).T, UNIT_SINGLE ** 2 * (stored * weight) @ stored.T])
    # rounding of an entry counts k times its own place
    forms[0] += k * energy.inner_doubt * np.diag(size * size)
    forms[1] += k * gamma(n + 8) * np.diag(forms[1].diagonal())
    return forms + k * 1e-12 * np.apply_along_axis(np.diag, 1, np.diagonal(forms, axis1=1, axis2=2))


def _forms(forms: np.ndarray, coordinates: np.ndarray) -> np.ndarray:
    """(n_case,) ndarray: sum of the roots of the forms (..., i, k, k) of coordinates (n_case, k)."""
    square = (coordinates.conj()[:, None, None] @ (forms @ coordinates[:, None, :, None])).real[:, :, 0, 0]
    return np.sqrt(np.maximum(square, 0.0)).sum(axis=1)
