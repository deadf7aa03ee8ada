"""What the reduced equations of a finger are made of: arrays, constants, and the contact that they remember."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class ReducedFinger(NamedTuple):
    """What the online stage needs: r displacement modes, m pressure modes, n points, s skin nodes.

    gradients : (4 n, r) ndarray [1/mm]
        Of the modes at the sampled points: du_x/dX, du_x/dY, du_y/dX, du_y/dY of each point in turn.
    weights : (n,) ndarray [mm^2]
    fibres : (n, n_family, 2) ndarray
    volume, volume_linear, volume_quadratic : (m,), (m, r), (m r, r) ndarray
        Integral over the section of a pressure mode times the in-plane Jacobian, by powers of q.
    skin_x, skin_y : (s, r) ndarray
        Modes at the skin nodes that may touch.
    height, skin_length : (s,) ndarray [mm]
    drag : (r, r) ndarray [mm]
        The whole skin's resistance for each unit of viscosity.
    """

    gradients: np.ndarray
    weights: np.ndarray
    fibres: np.ndarray
    volume: np.ndarray
    volume_linear: np.ndarray
    volume_quadratic: np.ndarray
    skin_x: np.ndarray
    skin_y: np.ndarray
    height: np.ndarray
    skin_length: np.ndarray
    drag: np.ndarray


class Constants(NamedTuple):
    """Of one case; stiffness per mm of length.

    ``give`` and ``dent`` [mm/MPa] are what each unit of shear and of pressure moves a node further than the full
    model's plate would let it: few modes cannot hold every node where a stiff plate wants it, so that the reduced plate
    may be softer.
    """

    c: float
    k1: float
    k2: float
    bulk: float
    out_of_plane: float
    friction: float
    normal_stiffness: float
    tangential_stiffness: float
    give: float = 0.0
    dent: float = 0.0


class Contact(NamedTuple):
    """What the last converged state left at the skin nodes (see ``ContactHistory``), each (s,) ndarray."""

    gap: np.ndarray
    shear: np.ndarray
    relative: np.ndarray
    closed: np.ndarray
    slipping: np.ndarray
