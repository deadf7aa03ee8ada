"""What is read off an equilibrium beside forces: stretches, strains where receptors lie, tractions along the plate.

Stretches are those of lines that ran along and across the gradient of the distance to the bone in the undeformed
section, |F e_r| and |F e_theta|, as in the publication's figure 5. Strains are Green's, (F^T F - 1) / 2, in the same
directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rom.checks import shown
from rom.finger_on_glass.finger import Finger, State
from rom.finger_on_glass.section import CORNERS

RECEPTOR_DEPTH = 0.5
"""Below the skin [mm]: where the publication has the shallowest receptors."""


def deformation_gradients(finger: Finger, state: State, quads: np.ndarray, local: np.ndarray) -> np.ndarray:
    """In-plane deformation gradient at one point of each of some elements.

    Parameters
    ----------
    finger : Finger
    state : State
    quads : (n,) ndarray of int
    local : (n, 2) ndarray
        Coordinates from -1 to 1, first from bone to skin, then around the bone.

    Returns
    -------
    (n, 2, 2) ndarray
    """
    corner = finger.mesh.quads[quads]
    slope = 0.25 * np.stack([CORNERS[:, 0] * (1 + local[:, 1:] * CORNERS[:, 1]),
                             CORNERS[:, 1] * (1 + local[:, :1] * CORNERS[:, 0])], axis=-1)
    jacobian = np.einsum("qak,qai->qik", slope, finger.mesh.nodes[corner])
    moved = np.einsum("qak,qai->qik", slope, state.displacement[corner])
    return np.eye(2) + moved @ np.linalg.inv(jacobian)


def _points(finger: Finger, quads: np.ndarray, local: np.ndarray) -> np.ndarray:
    """(n, 2) ndarray [mm]: where these points lie in the undeformed section."""
    shape = 0.25 * (1 + local[:, :1] * CORNERS[:, 0]) * (1 + local[:, 1:] * CORNERS[:, 1])
    return np.einsum("qa,qai->qi", shape, finger.mesh.nodes[finger.mesh.quads[quads]])


def _frame(finger: Finger, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors away from the bone, and around it counter-clockwise, each (n, 2) ndarray."""
    radial = finger.section.radial_directions(points)
    return radial, np.column_stack([-radial[:, 1], radial[:, 0]])


def stretches(finger: Finger, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Radial and circumferential stretch at the middle of every element.

    Returns
    -------
    lambda_r, lambda_theta : (n_quad,) ndarray
    """
    quads = np.arange(len(finger.mesh.quads))
    middle = np.zeros((len(quads), 2))
    gradient = deformation_gradients(finger, state, quads, middle)
    radial, around = (np.linalg.norm(np.einsum("qij,qj->qi", gradient, direction), axis=1)
                      for direction in _frame(finger, _points(finger, quads, middle)))
    return radial, around


@dataclass(frozen=True, eq=False)
class ReceptorStrain:
    """Strain at one depth below the skin, half way between neighbouring mesh lines, each (n_ray,) ndarray."""

    position: np.ndarray
    """Along the undeformed skin from the pad's middle, positive towards +x [mm]."""
    points: np.ndarray
    """(n_ray, 2) ndarray [mm]: in the undeformed section."""
    radial: np.ndarray
    """Green strain E_rr."""
    circumferential: np.ndarray
    """Green strain E_tt."""
    shear: np.ndarray
    """Green strain E_rt."""
    lambda_r: np.ndarray
    lambda_theta: np.ndarray


def receptor_strain(finger: Finger, state: State, depth: float = RECEPTOR_DEPTH) -> ReceptorStrain:
    """Green strain and stretches at a receptor's depth, all around the finger from its upper side.

    Parameters
    ----------
    finger : Finger
    state : State
    depth : float [mm]
        Below the undeformed skin, along the mesh lines.

    Returns
    -------
    ReceptorStrain

    Raises
    ------
    ValueError
        For a depth that does not lie between skin and bone.
    """
    mesh = finger.mesh
    bone, skin = (0.5 * (line + np.roll(line, -1, axis=0)) for line in (
        mesh.nodes[mesh.bone_nodes], mesh.nodes[mesh.skin_nodes]))
    thickness = np.linalg.norm(skin - bone, axis=1)
    if isinstance(depth, bool) or not isinstance(depth, int | float) or not 0 <= depth < thickness.min():
        raise ValueError(f"depth={shown(depth)} does not lie between skin and bone: give 0 mm or more, below the "
                         f"thinnest tissue's {thickness.min():.2f} mm")
    share = (1 - depth / thickness) * mesh.layers
    layer = np.minimum(share.astype(int), mesh.layers - 1)
    order = np.roll(np.arange(mesh.rays), mesh.rays // 2)
    quads = (np.arange(mesh.rays) * mesh.layers + layer)[order]
    local = np.column_stack([2 * (share - layer) - 1, np.zeros(mesh.rays)])[order]
    points = _points(finger, quads, local)
    radial, around = _frame(finger, points)
    gradient = deformation_gradients(finger, state, quads, local)
    r, t = np.einsum("qij,qj->qi", gradient, radial), np.einsum("qij,qj->qi", gradient, around)
    piece = np.linalg.norm(np.roll(mesh.nodes[mesh.skin_nodes], -1, axis=0) - mesh.nodes[mesh.skin_nodes], axis=1)
    along = np.cumsum(piece) - 0.5 * piece
    along = np.where(np.arange(mesh.rays) < mesh.rays // 2, along, along - piece.sum())[order]
    return ReceptorStrain(along, points, 0.5 * ((r * r).sum(axis=1) - 1), 0.5 * ((t * t).sum(axis=1) - 1),
                          0.5 * (r * t).sum(axis=1), np.linalg.norm(r, axis=1), np.linalg.norm(t, axis=1))


def smoothed(x: np.ndarray, values: np.ndarray, at: np.ndarray, window: float) -> np.ndarray:
    """Moving average over a window of fixed length, of the line through the points.

    Parameters
    ----------
    x, values : (n,) ndarray
        Ascending positions and values there; zero beyond.
    at : (m,) ndarray
        Where the average is wanted.
    window : float
        Its length, in the units of ``x``.

    Returns
    -------
    (m,) ndarray
    """
    fine = np.linspace(at[0] - window, at[-1] + window, 8 * len(at) + 1)
    ascending = np.maximum.accumulate(x)
    line = np.interp(fine, ascending, values, left=0.0, right=0.0)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (line[1:] + line[:-1]) * np.diff(fine))])
    return (np.interp(at + window / 2, fine, total) - np.interp(at - window / 2, fine, total)) / window
