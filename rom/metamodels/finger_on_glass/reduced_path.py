"""A load path of the reduced finger, compiled: Newton's steps and their adaption are those of the full model.

Positions, first touch, step sizes, viscous fall-back and guards follow :mod:`rom.finger_on_glass.path` and
:mod:`rom.finger_on_glass.equilibrium`; only the reference of the residual is the force on the plate, since a reduced
model has no reaction at the bone.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from rom.finger_on_glass.equilibrium import CUTS, DAMPING, GROWTH, LARGEST_STEP, PATIENCE
from rom.finger_on_glass.path import FIRST_TOUCH, QUICK_ITERATIONS
from rom.finger_on_glass.tissue import FIBRE_CAP
from rom.metamodels.finger_on_glass.reduced_equations import assemble
from rom.metamodels.finger_on_glass.reduced_finger import Contact

MOST_ITERATIONS = 25
CONVERGED, DIVERGES, SINGULAR, UNUSABLE, PATIENCE_LOST, FIBRE_TORN, UNTOUCHED = range(7)
REASONS = ("", "the iteration diverges", "the tangent is singular", "no share of Newton's step is usable",
           f"no convergence in {MOST_ITERATIONS} iterations", f"a fibre is stretched beyond the cap of {FIBRE_CAP:g}",
           "the plate cannot touch the finger gently")


class Controls(NamedTuple):
    """How strictly and how finely a path is followed.

    tolerance : float
        Largest reduced residual over the force on the plate.
    volume_tolerance : float
        Largest relative change of volume that the pressures do not stand for.
    largest_force_step : float
        Share of the last normal force.
    largest_travel_step : float [mm]
    """

    tolerance: float = 1e-6
    volume_tolerance: float = 1e-7
    largest_force_step: float = 0.25
    largest_travel_step: float = 0.2


class ReducedPath(NamedTuple):
    """A path as far as it went: p positions, of which the first ``reached`` are filled.

    q : (p, r) ndarray [mm]
    stretch_z, plate_y : (p,) ndarray
        The height without what a softer plate lets the skin sink in on average.
    pressure_coordinates : (p, m) ndarray
    pressure, shear : (p, s) ndarray [MPa]
        Over undeformed skin, at the skin nodes that may touch.
    viscosity : (p,) ndarray [MPa]
    largest_fibre : (p,) ndarray
    end : float
        Force [N/mm] or travel [mm] that was reached last.
    reason : int
        Place in :data:`REASONS`.
    """

    reached: int
    q: np.ndarray
    stretch_z: np.ndarray
    plate_y: np.ndarray
    pressure_coordinates: np.ndarray
    pressure: np.ndarray
    shear: np.ndarray
    viscosity: np.ndarray
    largest_fibre: np.ndarray
    steps: int
    iterations: int
    end: float
    reason: int


@numba.njit(cache=True)
def reduced_step(finger, constants, controls, history, q0, stretch_z0, plate_y0, plate_x0, s0, plate_held, normal_force,
                 plate_x, viscosity):
    """The next reduced equilibrium, as `rom.finger_on_glass.equilibrium.solve_step`.

    Returns
    -------
    code : int
        Place in :data:`REASONS`.
    iterations : int
    q, stretch_z, plate_y, s, contact, largest_fibre
        The state; unusable where ``code`` is not 0.
    """
    r = len(q0)
    slid = abs(plate_x - plate_x0)
    drag = viscosity / slid if slid > 0 else 0.0
    q, stretch_z, plate_y, s = q0.copy(), stretch_z0, plate_y0, s0.copy()
    own, condensed, tangent, change, slope, contact, largest = assemble(
        finger, constants, history, q, stretch_z, plate_y, plate_x, s, normal_force, slid > 0, drag, q0)
    n_free = r + 1 if plate_held else r + 2
    rigid = np.isinf(constants.out_of_plane)
    sizes = np.empty(MOST_ITERATIONS + 1)
    for iteration in range(MOST_ITERATIONS):
        if rigid:
            own[r], condensed[r] = 0.0, 0.0
            tangent[r, :], tangent[:, r] = 0.0, 0.0
            tangent[r, r] = 1.0
        size = np.sqrt(np.sum(own[:n_free] ** 2))
        sizes[iteration] = size
        reference = max(np.dot(finger.skin_length, contact[2]), 1e-3 * constants.c)
        volume_error = np.abs(change - s / constants.bulk).max()
        converged = size <= controls.tolerance * reference and volume_error <= controls.volume_tolerance
        if iteration > 0 and converged and not np.isnan(largest):
            return CONVERGED, iteration, q, stretch_z, plate_y, s, contact, largest
        if not np.isfinite(size) or size > 1e8 * reference:
            return DIVERGES, iteration, q, stretch_z, plate_y, s, contact, largest
        if plate_held:
            tangent[r + 1, :] = 0.0
            tangent[r + 1, r + 1] = 1.0
            condensed[r + 1] = 0.0
        if not solve_in_place(tangent, condensed):
            return SINGULAR, iteration, q, stretch_z, plate_y, s, contact, largest
        step = -condensed
        s_step = constants.bulk * (change + np.dot(slope, step[:r + 1])) - s
        share = min(1.0, LARGEST_STEP / max(np.abs(step).max(), 1e-300))
        lately = max(iteration + 1 - PATIENCE, 1)
        if iteration >= PATIENCE and sizes[lately:iteration + 1].min() > 0.7 * sizes[:lately].min():
            share *= DAMPING  # contact states take turns: a shorter step breaks the circle
        usable = False
        for _ in range(CUTS):
            q_new, s_new = q + share * step[:r], s + share * s_step
            stretch_new, plate_new = stretch_z + share * step[r], plate_y + share * step[r + 1]
            own, condensed, tangent, change, slope, contact, largest = assemble(
                finger, constants, history, q_new, stretch_new, plate_new, plate_x, s_new, normal_force, False, drag,
                q0)
            if rigid:
                own[r] = 0.0
            grown = np.sqrt(np.sum(own[:n_free] ** 2))
            least = GROWTH * sizes[max(0, iteration - 2):iteration + 1].max()
            if not np.isnan(largest) and (iteration == 0 or grown < least):
                usable = True
                break
            share *= 0.5
        if not usable:
            return UNUSABLE, iteration, q, stretch_z, plate_y, s, contact, largest
        q, stretch_z, plate_y, s = q_new, stretch_new, plate_new, s_new
    return PATIENCE_LOST, MOST_ITERATIONS, q, stretch_z, plate_y, s, contact, largest


@numba.njit(cache=True)
def solve_in_place(matrix, right):
    """Gaussian elimination with row exchanges; False where a pivot vanishes. Both arrays are overwritten."""
    n = len(right)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivot = matrix[best, k]
        if not abs(pivot) > 1e-300:
            return False
        if best != k:
            for j in range(k, n):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
            right[k], right[best] = right[best], right[k]
        inverse = 1.0 / pivot
        for i in range(k + 1, n):
            factor = matrix[i, k] * inverse
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        value = right[k]
        for j in range(k + 1, n):
            value -= matrix[k, j] * right[j]
        right[k] = value / matrix[k, k]
    return True


@numba.njit(cache=True)
def history_of(contact):
    """What the next step has to know."""
    return Contact(np.maximum(contact[0], 0.0), contact[3], contact[1], contact[6], contact[7])


@numba.njit(cache=True)
def reduced_path(finger, constants, controls, normal_force, travel, viscosities):
    """Follow a path from the undeformed finger, as `rom.finger_on_glass.path.follow`.

    Parameters
    ----------
    finger : ReducedFinger
    constants : Constants
    controls : Controls
    normal_force : (n_force,) ndarray [N/mm]
        Ascending.
    travel : (n_travel,) ndarray [mm]
        Ascending.
    viscosities : (n,) ndarray [MPa]
        Tried in turn.

    Returns
    -------
    ReducedPath
    """
    r, m, n_skin = finger.skin_x.shape[1], len(finger.volume), len(finger.height)
    n_position = len(normal_force) + len(travel)
    q_out, s_out = np.full((n_position, r), np.nan), np.full((n_position, m), np.nan)
    pressure_out, shear_out = np.full((n_position, n_skin), np.nan), np.full((n_position, n_skin), np.nan)
    scalars = np.full((4, n_position), np.nan)
    q, s, stretch_z, plate_x, lag = np.zeros(r), np.zeros(m), 1.0, 0.0, 0.0
    lowest = finger.height.min()
    plate_y = lowest
    no = np.zeros(n_skin, np.bool_)
    history = Contact(finger.height - lowest, np.zeros(n_skin), np.zeros(n_skin), no, no)
    full = normal_force[-1]
    steps, iterations, level, code, filled = 0, 0, 0, UNTOUCHED, 0
    reached, largest = 0.0, 0.0

    approach = FIRST_TOUCH
    for _ in range(40):
        code, n, q1, stretch1, plate1, s1, contact, largest = reduced_step(
            finger, constants, controls, history, q, stretch_z, lowest + approach, 0.0, s, True, 0.0, 0.0, 0.0)
        iterations += n
        if code == CONVERGED:
            reached = np.dot(finger.skin_length, contact[2])
            if 0 < reached < normal_force[0]:
                break
            code = UNTOUCHED
        approach *= 0.5
    if code != CONVERGED:
        return ReducedPath(0, q_out, scalars[0], scalars[1], s_out, pressure_out, shear_out, scalars[2], scalars[3], 0,
                           iterations, 0.0, code)
    q, stretch_z, plate_y, s, history, steps = q1, stretch1, plate1, s1, history_of(contact), 1

    for position in range(n_position):
        sliding = position >= len(normal_force)
        if position == 0:
            step, most, least = 0.05 * full, controls.largest_force_step * full, 1e-5 * full
        if position == len(normal_force):
            step, most, least, reached = 0.05, controls.largest_travel_step, 1e-4, 0.0
        target = travel[position - len(normal_force)] if sliding else normal_force[position]
        while target - reached > 1e-12:
            size = min(step, target - reached)
            if target - reached - size < 0.2 * size:  # no sliver for the last step
                size = target - reached
            force = full if sliding else reached + size
            x = reached + size + lag if sliding else plate_x
            code, n, q1, stretch1, plate1, s1, contact, largest = reduced_step(
                finger, constants, controls, history, q, stretch_z, plate_y, plate_x, s, False, force, x,
                viscosities[level])
            iterations += n
            if code == CONVERGED and largest > FIBRE_CAP:
                code = FIBRE_TORN
            if code != CONVERGED:
                step = 0.5 * size
                if step < least:
                    if level + 1 < len(viscosities) and sliding:
                        level += 1
                        step = 0.05
                        continue
                    return ReducedPath(filled, q_out, scalars[0], scalars[1], s_out, pressure_out, shear_out,
                                       scalars[2], scalars[3], steps, iterations, reached, code)
                continue
            reached += size
            q, stretch_z, plate_y, plate_x, s, history = q1, stretch1, plate1, x, s1, history_of(contact)
            steps += 1
            # the plate goes on by what sticking nodes give way on average beyond the full model's
            lag = -constants.give * np.dot(finger.skin_length, contact[3]) / np.sum(finger.skin_length[contact[6]])
            if n <= QUICK_ITERATIONS:
                step = min(1.5 * max(step, size), most)
        reached = target
        q_out[position], s_out[position] = q, s
        pressure_out[position], shear_out[position] = contact[2], contact[3]
        sunk = constants.dent * np.dot(finger.skin_length, contact[2]) / np.sum(finger.skin_length[contact[6]])
        scalars[0, position], scalars[1, position] = stretch_z, plate_y - sunk
        scalars[2, position], scalars[3, position] = viscosities[level], largest
        filled = position + 1
    return ReducedPath(filled, q_out, scalars[0], scalars[1], s_out, pressure_out, shear_out, scalars[2], scalars[3],
                       steps, iterations, reached, CONVERGED)
