"""What one sees of an equilibrium: forces, contact, energy."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rom.finger_on_glass.equilibrium import ConvergedStep
from rom.finger_on_glass.finger import Finger, State, tributary


@dataclass(frozen=True, eq=False)
class Observation:
    """An equilibrium on a path, in the units of measurement."""

    state: State
    normal_force: float
    """[N]"""
    tangential_force: float
    """That moves the plate along [N]."""
    normal_displacement: float
    """Of the plate since it touched [mm]."""
    tangential_displacement: float
    """Of the plate [mm]."""
    edges: tuple[float, float]
    """Ends of the contact along the plate [mm]; NaN without contact."""
    pressure: np.ndarray
    """(n_skin,) ndarray [MPa]: over the deformed skin."""
    shear: np.ndarray
    """(n_skin,) ndarray [MPa]: with which the plate drags the skin along, over the deformed skin."""
    largest_fibre: float
    """Largest lambda^2 - 1 of any fibre at any integration point."""
    slipping: int
    touching: int
    energy: float
    """Stored in tissue, out-of-plane spring and penalties [N mm]."""
    work: float
    """Done by the plate since the start of the path [N mm]."""
    dissipated: float
    """By friction and by the viscous resistance since the start of the path [N mm]."""
    viscosity: float
    """With which the last step was made [MPa]."""
    iterations: int
    """Newton iterations since the start of the path, failed steps included."""
    steps: int

    @property
    def width(self) -> float:
        """Of the contact [mm]."""
        return self.edges[1] - self.edges[0]

    @property
    def area(self) -> float:
        """pi W^2 / 4 [mm^2]: the publication's, a circle as wide as the contact."""
        return 0.25 * np.pi * self.width**2


@dataclass
class Balance:
    """Work and dissipation since the start of a path, for each mm of length.

    Work is the integral of the parabola through the forces at the last three equilibria, as forces grow faster than
    linearly; the trapezoidal rule where there are no three, or where the plate has just begun to slide.
    """

    work: float = 0.0
    dissipated: float = 0.0
    passed: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Height, position [mm] and forces [N/mm] of the plate at the last equilibria."""

    def add(self, finger: Finger, before: State, step: ConvergedStep, viscosity: float) -> None:
        """Account for the step from ``before``."""
        after, contact = step.state, step.residual.contact
        normal, tangential = plate_forces(finger, contact.pressure, contact.shear)
        if not self.passed:
            self.passed.append((before.plate_y, before.plate_x, 0.0, 0.0))
        if before.plate_x == self.passed[0][1] < after.plate_x:  # a corner of the path
            self.passed = self.passed[-1:]
        self.passed = [*self.passed[-2:], (after.plate_y, after.plate_x, normal, tangential)]
        y, x, f_y, f_x = np.transpose(self.passed)
        self.work += last_piece(y, f_y) + last_piece(x, f_x)
        history, plate = before.contact, finger.plate
        moved = np.where(contact.closed & ~history.closed, contact.gap / np.where(
            contact.gap < history.gap, contact.gap - history.gap, 1.0), 1.0) * (contact.relative - history.relative)
        slip = np.where(contact.slipping, moved - (contact.shear - history.shear) / plate.tangential_stiffness, 0.0)
        # what resisted when the slip began: as now where the node stuck until then
        first = np.where(history.slipping | ~history.closed, np.abs(history.shear), np.abs(contact.shear))
        resistance = 0.5 * (first + np.abs(contact.shear)) * np.sign(contact.shear)
        self.dissipated += float(finger.skin_length @ (resistance * slip))
        # a node that leaves the plate loses what its elastic slip had stored
        gone = history.closed & ~contact.closed
        self.dissipated += float(finger.skin_length[gone] @ history.shear[gone] ** 2) / (2 * plate.tangential_stiffness)
        slid = abs(after.plate_x - before.plate_x)
        if viscosity > 0 and slid > 0:
            motion = (after.displacement - before.displacement)[finger.mesh.skin_nodes]
            self.dissipated += viscosity / slid * float(finger.skin_length @ (motion**2).sum(axis=1))


def last_piece(x: np.ndarray, y: np.ndarray) -> float:
    """Integral over the last interval of two points (their line) or three (their parabola).

    Parameters
    ----------
    x, y : (2,) or (3,) ndarray
        Where ``x`` does not go on in one direction, the line is taken.
    """
    h = float(x[-1] - x[-2])
    line = 0.5 * h * float(y[-1] + y[-2])
    if len(x) < 3 or not (x[-2] - x[-3]) * h > 0:
        return line
    slopes = (y[-1] - y[-2]) / h, (y[-2] - y[-3]) / (x[-2] - x[-3])
    return line - h**3 / 6 * float((slopes[0] - slopes[1]) / (x[-1] - x[-3]))


def plate_forces(finger: Finger, pressure: np.ndarray, shear: np.ndarray) -> tuple[float, float]:
    """Normal force on the plate and the force that moves it along [N/mm], from tractions over undeformed skin [MPa]."""
    return float(finger.skin_length @ pressure), -float(finger.skin_length @ shear)


def stored_energy(finger: Finger, step: ConvergedStep) -> float:
    """Of tissue, out-of-plane spring and penalties [N]: N mm for each mm of length."""
    state, found = step.state, step.residual
    contact, plate = found.contact, finger.plate
    energy = found.energy + 0.5 * float(finger.element_volume @ state.pressure**2) / finger.tissue.bulk
    if np.isfinite(finger.out_of_plane.stiffness):
        energy += 0.5 * finger.out_of_plane.stiffness * (state.stretch_z - 1) ** 2
    return energy + 0.5 * float(finger.skin_length @ (
        contact.pressure**2 / plate.normal_stiffness + contact.shear**2 / plate.tangential_stiffness))


EDGE_NODES = 3
"""On either side of an edge, from which it is found."""


def contact_edges(x: np.ndarray, height: np.ndarray, pressure: np.ndarray) -> tuple[float, float]:
    """Where the contact ends, inside the elements.

    Near the end of a smooth contact (Hertz) the pressure falls like the square root of the distance, and outside the
    gap grows like its power 3/2: the square of the one and the power 2/3 of the other run straight to zero at the edge.
    It is taken in the middle of where the two lines, each through three nodes, meet zero; a line that does not do so
    near the interval between the last node in contact and the first outside is left out.

    Parameters
    ----------
    x : (n,) ndarray [mm]
        Along the plate, ascending around the contact.
    height : (n,) ndarray [mm]
        Of the skin.
    pressure : (n,) ndarray [MPa]
        Zero where there is no contact.

    Returns
    -------
    left, right : float [mm]
        NaN where no node touches.
    """
    touching = np.flatnonzero(pressure > 0)
    if not len(touching):
        return float("nan"), float("nan")
    first, last = int(touching[0]), int(touching[-1])
    left = -_right_edge(-x[::-1], height[::-1], pressure[::-1], len(x) - 1 - first)
    return left, _right_edge(x, height, pressure, last)


def _right_edge(x: np.ndarray, height: np.ndarray, pressure: np.ndarray, last: int) -> float:
    inside = slice(max(last - EDGE_NODES + 1, 0), last + 1)
    outside = slice(last + 1, last + 1 + EDGE_NODES)
    gap = np.maximum(height[outside] - height[last], 0.0) ** (2 / 3)
    nearest = x[min(last + 1, len(x) - 1)]
    room = 0.5 * abs(nearest - x[last])
    both = _zero(x[inside], pressure[inside] ** 2, -1), _zero(x[outside], gap, 1)
    found = [zero for zero in both if zero is not None and x[last] - room <= zero <= nearest + room]
    return float(np.mean(found)) if found else float(0.5 * (x[last] + nearest))


def _zero(x: np.ndarray, y: np.ndarray, sign: int) -> float | None:
    """Where the line through the points meets zero; None for fewer than two, or a line that runs the other way."""
    if len(x) < 2:
        return None
    slope, level = np.polyfit(x - x[0], y, 1)
    return float(x[0] - level / slope) if slope * sign > 0 else None


def along_plate(pressure: np.ndarray) -> np.ndarray:
    """(n_skin // 2,) ndarray of int: the half of the skin nodes that faces the plate, from its left to its right.

    Parameters
    ----------
    pressure : (n_skin,) ndarray
        Its centre is the middle: a finger that rolls brings other skin to the plate.
    """
    n = len(pressure)
    turn = np.angle(pressure @ np.exp(2j * np.pi * np.arange(n) / n)) / (2 * np.pi)
    middle = round(float(turn) * n)
    return (np.arange(-(n // 4), n // 4 + 1) + middle) % n


def observe(finger: Finger, step: ConvergedStep, balance: Balance, viscosity: float, iterations: int, steps: int
            ) -> Observation:
    """Everything that is reported of a converged step."""
    state, contact = step.state, step.residual.contact
    skin = finger.mesh.skin_nodes
    position = finger.mesh.nodes[skin] + state.displacement[skin]
    stretched = finger.skin_length / tributary(position)
    order = along_plate(contact.pressure)
    normal, tangential = plate_forces(finger, contact.pressure, contact.shear)
    length = finger.out_of_plane.effective_length
    return Observation(
        state, normal * length, tangential * length, state.plate_y - finger.lowest, state.plate_x,
        contact_edges(position[order, 0], position[order, 1], contact.pressure[order]), contact.pressure * stretched,
        -contact.shear * stretched, step.residual.largest_fibre, int(contact.slipping.sum()), int(contact.closed.sum()),
        stored_energy(finger, step) * length, balance.work * length, balance.dissipated * length, viscosity, iterations,
        steps)
