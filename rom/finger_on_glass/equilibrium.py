"""One load step: Newton's method on the finger's equations, strictly converged or not at all.

The pressures are updated linearly with the step, the guard against divergence is not monotone (the first residual of a
penalty contact is its stiffness times the step, whatever the step is worth), and nothing is accepted that has not
converged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rom.errors import SolverError
from rom.finger_on_glass.finger import Finger, Residual, State

FORCE_TOLERANCE = 1e-8
"""Largest residual over the reaction at the bone."""
VOLUME_TOLERANCE = 1e-9
LARGEST_STEP = 0.5
"""Of any unknown in one iteration [mm]."""
GROWTH = 5.0
"""A step is cut where the residual grows beyond this times the largest of the last three."""
CUTS = 8
PATIENCE, DAMPING = 3, 0.5
"""After so many iterations without a smaller residual, steps are shortened."""


@dataclass(frozen=True, eq=False)
class ConvergedStep:
    """An equilibrium that was found."""

    state: State
    residual: Residual
    iterations: int
    force_residual: float
    """Norm of the residual over that of the bone's reaction."""


@dataclass(frozen=True)
class FailedStep:
    """A step that did not converge, and why."""

    iterations: int
    reason: str
    state: None = None


StepResult = ConvergedStep | FailedStep


def solve_step(finger: Finger, state: State, *, plate_y: float | None = None, normal_force: float | None = None,
               plate_x: float | None = None, viscosity: float = 0.0, most_iterations: int = 25) -> StepResult:
    """The next equilibrium.

    Parameters
    ----------
    finger : Finger
    state : State
        The last equilibrium.
    plate_y : float [mm], optional
        Height of the plate; or
    normal_force : float [N/mm], optional
        with which the plate is pressed on.
    plate_x : float [mm], optional
        Position of the plate along its plane; default: as before.
    viscosity : float [MPa]
        Resistance of the skin's motion for each unit of the plate's travel: carries the finger over snaps.
    most_iterations : int

    Returns
    -------
    StepResult
    """
    plate_held = normal_force is None
    x = state.plate_x if plate_x is None else plate_x
    slid = abs(x - state.plate_x)
    drag = (viscosity / slid, state.displacement) if viscosity > 0 and slid > 0 else None
    trial = replace(state, plate_x=x, plate_y=state.plate_y if plate_y is None else plate_y)
    free = finger.free_rows[:-1] if plate_held else finger.free_rows
    found = finger.residual(trial, state.contact, normal_force, predict=slid > 0, drag=drag)
    history: list[float] = []
    for iteration in range(most_iterations):
        size = float(np.linalg.norm(found.force[free]))
        history.append(size)
        reference = max(float(np.linalg.norm(found.force[finger.held_rows])), 1e-3 * finger.tissue.c)
        converged = size <= FORCE_TOLERANCE * reference and found.volume_error <= VOLUME_TOLERANCE
        if iteration > 0 and found.usable and converged:
            done = replace(trial, contact=found.contact.history())
            return ConvergedStep(done, found, iteration, size / reference)
        if not np.isfinite(size) or size > 1e8 * reference:
            return FailedStep(iteration, "the iteration diverges")
        try:
            values = finger.tangent(found, plate_held, drag[0] if drag else 0.0)
            right = -found.condensed[finger.free_rows]
            if plate_held:
                right[-1] = 0.0
            answer = finger.solver.solve(values, right)
        except SolverError as error:
            return FailedStep(iteration, str(error))
        if not np.isfinite(answer).all():
            return FailedStep(iteration, "the tangent is singular")
        step = np.zeros(finger.n_unknowns)
        step[finger.free_rows] = answer
        pressure_step = finger.tissue.bulk * (found.dilatation + np.einsum(
            "em,em->e", found.dilatation_force, step[finger.element_rows]) / finger.element_volume) - trial.pressure
        share = min(1.0, LARGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        if iteration >= PATIENCE and min(history[-PATIENCE:]) > 0.7 * min(history[:-PATIENCE]):
            share *= DAMPING  # contact states take turns: a shorter step breaks the circle
        for _ in range(CUTS):
            next_trial = finger.moved(trial, step, share, pressure_step)
            found = finger.residual(next_trial, state.contact, normal_force, drag=drag)
            grown = float(np.linalg.norm(found.force[free]))
            if found.usable and (iteration == 0 or grown < GROWTH * max(history[-3:])):
                break
            share *= 0.5
        else:
            return FailedStep(iteration, "no share of Newton's step is usable")
        trial = next_trial
    return FailedStep(most_iterations, f"no convergence in {most_iterations} iterations")
