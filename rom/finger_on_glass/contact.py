"""Contact with a rigid flat plate and Coulomb friction, at the nodes of the skin.

Penalty for the gap and for sticking, return mapping for slipping. A node that touches during a step sticks where it
*touched*: its slip is counted from the point of touch, interpolated between the converged states, and the tangent knows
how that point moves; counted from the last converged state instead, Newton's iteration runs in circles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rom.checks import real_number


@dataclass(frozen=True)
class Glass:
    """The plate that the finger is pressed on, rigid and flat.

    Parameters
    ----------
    friction : float
        Coulomb coefficient.
    normal_stiffness, tangential_stiffness : float [MPa/mm]
        Penalties: pressure for each mm of penetration, shear for each mm of elastic slip.

    Raises
    ------
    ValueError
    """

    friction: float = 1.0
    normal_stiffness: float = 20.0
    tangential_stiffness: float = 5.0

    def __post_init__(self) -> None:
        for name, least in (("friction", 0.0), ("normal_stiffness", 1e-3), ("tangential_stiffness", 1e-3)):
            object.__setattr__(self, name, real_number(name, getattr(self, name), least, 1e6))


@dataclass(frozen=True, eq=False)
class ContactHistory:
    """What the last converged state left at the skin nodes, each (n_skin,) ndarray."""

    gap: np.ndarray
    """Distance to the plate, zero where closed [mm]."""
    shear: np.ndarray
    """Traction that the plate's motion pulls along [MPa]."""
    relative: np.ndarray
    """Position along the plate [mm]."""
    closed: np.ndarray
    slipping: np.ndarray

    @classmethod
    def open(cls, gap: np.ndarray) -> ContactHistory:
        """No node touches."""
        return cls(gap, np.zeros(len(gap)), np.zeros(len(gap)), np.zeros(len(gap), bool), np.zeros(len(gap), bool))


@dataclass(frozen=True, eq=False)
class ContactResponse:
    """Tractions and their derivatives at the skin nodes, each (n_skin,) ndarray."""

    gap: np.ndarray
    pressure: np.ndarray
    shear: np.ndarray
    relative: np.ndarray
    closed: np.ndarray
    slipping: np.ndarray
    pressure_by_gap: np.ndarray
    shear_by_x: np.ndarray
    shear_by_gap: np.ndarray

    def history(self) -> ContactHistory:
        """What the next step has to know."""
        return ContactHistory(np.maximum(self.gap, 0.0), self.shear, self.relative, self.closed, self.slipping)


def contact_response(glass: Glass, history: ContactHistory, gap: np.ndarray, relative: np.ndarray,
                     predict: bool = False) -> ContactResponse:
    """Pressure and shear at every skin node.

    Parameters
    ----------
    glass : Glass
    history : ContactHistory
    gap : (n_skin,) ndarray [mm]
        Negative where a node has gone through the glass.
    relative : (n_skin,) ndarray [mm]
        Displacement of the node along the plate minus the plate's own.
    predict : bool
        Nodes slip that slipped in the last converged state, and only those: the first iteration of a tangential step,
        where the plate has moved and the skin has not yet followed.

    Returns
    -------
    ContactResponse
        ``shear`` acts against the node's motion along the plate; pressures in MPa, derivatives in MPa/mm.
    """
    closed = gap < 0
    pressure = np.where(closed, -glass.normal_stiffness * gap, 0.0)
    touching = closed & ~history.closed
    travel = np.where(touching, history.gap - gap, 1.0)
    share = np.where(touching, -gap / travel, 1.0)  # of this step's motion, after the touch
    moved = relative - history.relative
    trial = np.where(closed, history.shear + glass.tangential_stiffness * share * moved, 0.0)
    limit = glass.friction * pressure
    if predict:
        slipping = closed & history.slipping
        direction = np.sign(history.shear)
    else:
        slipping = closed & (np.abs(trial) > limit)
        direction = np.sign(trial)
    sticking = closed & ~slipping
    return ContactResponse(
        gap, pressure, np.where(slipping, limit * direction, trial), relative, closed, slipping,
        pressure_by_gap=np.where(closed, -glass.normal_stiffness, 0.0),
        shear_by_x=np.where(sticking, glass.tangential_stiffness * share, 0.0),
        shear_by_gap=np.where(slipping, -glass.friction * glass.normal_stiffness * direction, np.where(
            sticking & touching, -glass.tangential_stiffness * moved * history.gap / travel**2, 0.0)))
