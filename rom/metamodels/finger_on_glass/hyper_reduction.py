"""From snapshots to a small system: bases of displacement and pressure, supremizers, and sampled points with weights.

POD of displacements and of element pressures. States that nearly keep their volume give POD modes that hardly feel a
pressure, so that each pressure mode brings one more displacement, the one that feels it most (supremizer: Rozza and
Veroy, Comput. Methods Appl. Mech. Eng. 196 (2007) 1244-1260). Energy-conserving sampling and weighting (Farhat,
Chapman, Avery, Int. J. Numer. Methods Eng. 102 (2015) 1077-1110), here of integration points instead of elements: few
of them, with non-negative weights, meet the reduced internal forces of training states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from rom.finger_on_glass.finger import Finger
from rom.metamodels.finger_on_glass.reduced_equations import (
    Constants,
    Contact,
    ReducedFinger,
    assemble,
    isochoric,
    volumes,
)
from rom.metamodels.pod_space import pod

SAMPLED_STATES = 80
"""Training states whose forces the sampled points have to meet."""
LIGHT_TOUCH = 1e-3
"""Depth to which the plate goes at least when the stiffness of a training state is made [mm]."""
SKETCH = 500
"""Random combinations of these states' force components that stand for all of them."""


@dataclass(frozen=True, eq=False)
class ReducedSpace:
    """Where a reduced finger moves.

    Parameters
    ----------
    vectors : (2 n_node, r) ndarray
        Orthonormal displacement modes, supremizers last.
    pressures : (n_quad, m) ndarray [1/mm]
        Pressure modes, orthonormal with the elements' volumes as weights.
    skin : (s,) ndarray of int
        Places, among the skin nodes, of those that may touch.
    """

    vectors: np.ndarray
    pressures: np.ndarray
    skin: np.ndarray


def learn_space(finger: Finger, displacement: np.ndarray, stretch_z: np.ndarray, bulk: np.ndarray, touched: np.ndarray,
                rank: int, pressure_rank: int) -> ReducedSpace:
    """Bases from converged states.

    Parameters
    ----------
    finger : Finger
    displacement : (n_state, 2 n_node) ndarray [mm]
    stretch_z : (n_state,) ndarray
    bulk : (n_state,) ndarray [MPa]
    touched : (n_skin,) ndarray of bool
        Whether a skin node touched in any state.
    rank, pressure_rank : int

    Returns
    -------
    ReducedSpace
    """
    pressures = pressure_modes(finger, element_pressures(finger, displacement, stretch_z, bulk), pressure_rank)
    # errors are judged relative to each state: small ones, early on the path, count as much as large ones
    size = np.linalg.norm(displacement, axis=1, keepdims=True)
    vectors = principal_directions(displacement / np.maximum(size, 1e-12), rank)
    margin = max(3, finger.rays // 12)
    near = np.zeros(len(touched), bool)
    for shift in range(-margin, margin + 1):
        near |= np.roll(touched, shift)
    near[0] = True  # the lowest point: where the plate touches
    middle = len(near) // 2  # in the order of the skin, the side towards the nail last and first
    order = np.roll(np.arange(len(near)), middle)
    return ReducedSpace(orthonormal(vectors, supremizers(finger, pressures)), pressures, order[near[order]])


def element_pressures(finger: Finger, displacement: np.ndarray, stretch_z: np.ndarray, bulk: np.ndarray) -> np.ndarray:
    """(n_state, n_quad) ndarray [MPa]: of converged states, where they are the bulk modulus times the dilatation."""
    found = np.empty((len(displacement), len(finger.mesh.quads)))
    weights = finger.shape_functions[1]
    for i, u in enumerate(displacement):
        g = point_gradients(finger, u[:, None])[..., 0]
        in_plane = (1 + g[:, :, 0]) * (1 + g[:, :, 3]) - g[:, :, 1] * g[:, :, 2]
        found[i] = bulk[i] * (stretch_z[i] * (weights * in_plane).sum(axis=1) / finger.element_volume - 1)
    return found


def principal_directions(rows: np.ndarray, rank: int) -> np.ndarray:
    """(n, rank) ndarray: POD modes of the rows of a (n_state, n) array, at most as many as they span.

    Rows are not scaled: a state counts by its size, as in the errors that the basis is judged by.
    """
    return pod(rows, rank, noise=1e-14, alike=False).vectors


def pressure_modes(finger: Finger, rows: np.ndarray, rank: int) -> np.ndarray:
    """(n_quad, rank) ndarray: POD modes of element pressures (n_state, n_quad) in the norm of the section."""
    root = np.sqrt(finger.element_volume)
    return principal_directions(rows * root, rank) / root[:, None]


def supremizers(finger: Finger, pressures: np.ndarray) -> np.ndarray:
    """(2 n_node, m) ndarray: displacement that each pressure mode drives in the undeformed isotropic tissue."""
    nodes = 2 * len(finger.mesh.nodes)
    rows = finger.element_rows[:, :8]
    gradients, weights = finger.shape_functions
    # gradient-of-displacement inner product, the natural norm of the displacement
    block = np.einsum("eq,eqai,eqbi->eab", weights, gradients, gradients)
    values = np.zeros((len(rows), 8, 8))
    values[:, 0::2, 0::2] = values[:, 1::2, 1::2] = block
    stiffness = sp.csc_matrix((values.ravel(), (np.repeat(rows, 8, axis=1).ravel(), np.tile(rows, (1, 8)).ravel())),
                              shape=(nodes, nodes))
    widening = np.einsum("eq,eqai->eai", weights, gradients).reshape(-1, 8)
    load = np.stack([np.bincount(rows.ravel(), (widening * p[:, None]).ravel(), nodes) for p in pressures.T], axis=1)
    free = finger.free_rows[finger.free_rows < nodes]
    found = np.zeros_like(load)
    found[free] = spl.splu(stiffness[free][:, free].tocsc()).solve(load[free])
    return found


def orthonormal(vectors: np.ndarray, more: np.ndarray) -> np.ndarray:
    """``vectors`` and what ``more`` adds to them, orthonormal columns."""
    extra = more / np.linalg.norm(more, axis=0)
    for _ in range(2):  # twice is enough
        extra = extra - vectors @ (vectors.T @ extra)
    return np.column_stack([vectors, np.linalg.qr(extra)[0]])


def point_gradients(finger: Finger, vectors: np.ndarray) -> np.ndarray:
    """(n_quad, 4, 4, r) ndarray [1/mm]: gradients of the modes at the integration points, du_x/dX ... du_y/dY."""
    corner = vectors.reshape(len(finger.mesh.nodes), 2, -1)[finger.mesh.quads]
    found = np.einsum("eqai,eajr->eqjir", finger.shape_functions[0], corner, optimize=True)
    return found.reshape(*found.shape[:2], 4, -1)


def reduce(finger: Finger, space: ReducedSpace) -> ReducedFinger:
    """The reduced finger that keeps every integration point.

    Parameters
    ----------
    finger : Finger
        Its geometry, mesh and fibres count; material, plate and out-of-plane stiffness do not.
    space : ReducedSpace

    Returns
    -------
    ReducedFinger
    """
    r, m = space.vectors.shape[1], space.pressures.shape[1]
    gradients, weights = point_gradients(finger, space.vectors), finger.shape_functions[1]
    widening = gradients[:, :, 0] + gradients[:, :, 3]
    linear = np.einsum("eq,em,eqr->mr", weights, space.pressures, widening, optimize=True)
    quadratic = np.zeros((m, r * r))
    for start in range(0, len(weights), 256):
        part = slice(start, start + 256)
        g, w = gradients[part], weights[part]
        # sum of the two diagonal products' symmetric parts: the in-plane Jacobian's second order
        det = (np.einsum("eq,eqi,eqj->eij", w, g[:, :, 0], g[:, :, 3], optimize=True)
               - np.einsum("eq,eqi,eqj->eij", w, g[:, :, 1], g[:, :, 2], optimize=True))
        quadratic += space.pressures[part].T @ (0.5 * (det + det.transpose(0, 2, 1))).reshape(len(det), -1)
    skin = finger.mesh.skin_nodes[space.skin]
    moved = [space.vectors[2 * finger.mesh.skin_nodes + i] for i in (0, 1)]
    drag = sum(part.T @ (finger.skin_length[:, None] * part) for part in moved)
    whole = np.ascontiguousarray
    return ReducedFinger(
        whole(gradients.reshape(-1, r)), whole(weights.ravel()),
        whole(finger.fibres.reshape(-1, *finger.fibres.shape[2:])),
        finger.element_volume @ space.pressures, whole(linear), whole(quadratic.reshape(m * r, r)),
        whole(space.vectors[2 * skin]), whole(space.vectors[2 * skin + 1]), whole(finger.mesh.nodes[skin, 1]),
        whole(finger.skin_length[space.skin]), whole(drag))


def sampled(whole: ReducedFinger, points: np.ndarray, weights: np.ndarray) -> ReducedFinger:
    """The reduced finger that keeps ``points`` (n,) with ``weights`` (n,) alone."""
    r = whole.gradients.shape[1]
    return whole._replace(
        gradients=np.ascontiguousarray(whole.gradients.reshape(-1, 4, r)[points].reshape(-1, r)),
        weights=np.ascontiguousarray(weights), fibres=np.ascontiguousarray(whole.fibres[points]))


def displacement_shares(whole: ReducedFinger, constants: list[Constants], q: np.ndarray, stretch_z: np.ndarray,
                        plate_y: np.ndarray) -> np.ndarray:
    """Each point's share of the reduced isochoric forces, in the metric of the displacement that they cause.

    A wrong force matters by the displacement that it causes: forces of a state are multiplied by the inverse of its
    reduced tangent (skin held normally where it touches, free to slip), and divided by the size of what all of them
    cause.

    Parameters
    ----------
    whole : ReducedFinger
    constants : list of Constants
        Of each state.
    q : (n_state, r) ndarray [mm]
    stretch_z : (n_state,) ndarray
    plate_y : (n_state,) ndarray [mm]

    Returns
    -------
    (n_state (r + 1), n) ndarray
        For unit weights.
    """
    n, r, s = len(whole.weights), q.shape[1], len(whole.height)
    stress, tangent = np.empty((n, 5)), np.empty((n, 5, 5))
    rows = np.empty((len(q), r + 1, n))
    gradients = whole.gradients.reshape(n, 4, r)
    unit, no = np.ones(n), np.zeros(s, bool)
    untouched = Contact(np.ones(s), np.zeros(s), np.zeros(s), no, no)
    for i, given in enumerate(constants):
        z = float(stretch_z[i])
        change, _ = volumes(whole, q[i], z)
        # the modes may miss a light touch, without which nothing would hold the plate
        height = max(float(plate_y[i]), float((whole.height + whole.skin_y @ q[i]).min()) + LIGHT_TOUCH)
        found = assemble(whole, given._replace(friction=0.0), untouched, q[i], z, height, 0.0,
                         given.bulk * change, 0.0, False, 0.0, q[i])
        isochoric(whole.gradients @ q[i], z, whole.fibres, unit, given.c, given.k1, given.k2, stress, tangent)
        rows[i, :r] = np.einsum("nkr,nk->rn", gradients, stress[:, :4], optimize=True)
        rows[i, r] = stress[:, 4]
        # the plate follows under given force: its row and column stay
        right = np.zeros((r + 2, n))
        right[:r + 1] = rows[i]
        rows[i] = np.linalg.solve(found[2], right)[:r + 1]
        rows[i] /= np.linalg.norm(rows[i] @ whole.weights)  # a state close to a snap would outweigh all others
    return rows.reshape(-1, n)


def select_points(whole: ReducedFinger, constants: list[Constants], q: np.ndarray, stretch_z: np.ndarray,
                  plate_y: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights that meet :data:`SAMPLED_STATES` of the training states, always the same ones.

    Parameters
    ----------
    whole : ReducedFinger
        With every point.
    constants, q, stretch_z, plate_y
        As in :func:`displacement_shares`.
    tolerance : float
        As in :func:`sparse_weights`.

    Returns
    -------
    points, weights : (n_kept,) ndarray
    """
    chosen = np.random.default_rng(0).permutation(len(q))[:SAMPLED_STATES]
    shares = displacement_shares(whole, [constants[i] for i in chosen], q[chosen], stretch_z[chosen], plate_y[chosen])
    return sparse_weights(shares, whole.weights, tolerance)


def sparse_weights(shares: np.ndarray, weights: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Few points with non-negative weights that meet the training forces (ECSW's sparse non-negative least squares).

    Lawson and Hanson's active set, stopped as soon as the sum is met to ``tolerance`` (Chapman, Avery, Collins, Farhat,
    Int. J. Numer. Methods Eng. 109 (2017) 1623-1654).

    Parameters
    ----------
    shares : (n_row, n) ndarray
        For unit weights.
    weights : (n,) ndarray
        Of all points: their sum is the right-hand side.
    tolerance : float
        ||shares (found - weights)|| / ||shares weights||.

    Returns
    -------
    points, weights : (n_kept,) ndarray
    """
    right = shares @ weights
    every, whole = shares, right
    if len(shares) > SKETCH:  # random combinations of the rows keep distances, and the points are far fewer than they
        mixing = np.random.default_rng(1).standard_normal((SKETCH, len(shares))) / np.sqrt(SKETCH)
        shares, right = mixing @ shares, mixing @ right
    scale = np.linalg.norm(shares, axis=0) + 1e-300
    columns = shares / scale
    projected = columns.T @ right
    total = float(right @ right)
    goal = tolerance**2 * total
    kept: list[int] = []
    gram: dict[int, np.ndarray] = {}
    refused: list[int] = []
    best, last = -1, np.inf
    x = np.zeros(columns.shape[1])
    while True:
        missing = right - columns[:, kept] @ x[kept]
        left, gradient = float(missing @ missing), columns.T @ missing
        if left <= goal:
            if np.linalg.norm(every[:, kept] @ (x[kept] / scale[kept]) - whole) <= tolerance * np.linalg.norm(whole):
                break
            goal = 0.8 * left  # the random combinations are a little kinder than the rows themselves
        if left >= last:  # rounding: the last point brought nothing
            refused.append(best)
        else:
            refused, last = [], left
        gradient[kept + refused] = -np.inf
        best = int(np.argmax(gradient))
        if gradient[best] <= 1e-14 * np.sqrt(total):
            break
        kept.append(best)
        gram[best] = columns.T @ columns[:, best]
        while True:
            inner = np.array([gram[i][kept] for i in kept])
            # the ridge is far below the tolerance; what is still missing is computed without it
            trial = sla.solve(inner + 1e-13 * np.eye(len(kept)), projected[kept], assume_a="sym")
            if (trial > 0).all():
                x[kept] = trial
                break
            now = x[kept]
            falling = trial <= 0
            share = float((now[falling] / (now[falling] - trial[falling] + 1e-300)).min())
            x[kept] = now + share * (trial - now)
            gone = [i for i, low in zip(kept, falling, strict=True) if low and x[i] <= 1e-14 * x[kept].max()]
            if not gone:
                gone = [min((i for i, low in zip(kept, falling, strict=True) if low), key=lambda i: x[i])]
            x[gone] = 0.0
            kept = [i for i in kept if i not in gone]
    points = np.sort(np.array(kept, dtype=np.int64))
    return points, x[points] / scale[points]
