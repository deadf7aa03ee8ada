"""Nodal values from a coarser fingertip mesh to a finer one.

Both meshes sample the same logical map (`rom.fingertip.shell`), so a fine node has a definite place in a
coarse cell: bilinear in the cap's or a ring's cell, times linear through the thickness, tissue by tissue.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from rom.fingertip.mesh import FingertipMesh
from rom.fingertip.shell import CAP_EXTENT, Floats, Ints, MeshDensity, ring_nodes

_ROUNDING = 1e-12


def interpolation_from(coarse: FingertipMesh, fine: FingertipMesh) -> sparse.csr_matrix:
    """Matrix that interpolates nodal values of one mesh at the nodes of another of the same family.

    Parameters
    ----------
    coarse, fine : FingertipMesh
        Any two densities; the anatomies may differ, as places are logical.

    Returns
    -------
    interpolation : (n_fine, n_coarse) csr_matrix [-]
        Rows sum to one.  For displacements stored as (n, 3) arrays: ``fine_values = matrix @ coarse_values``.
    """
    in_shell = _in_shell(coarse.density, fine.logical[: fine.nodes_per_shell, :2])
    through = _through_thickness(coarse.density.layer_levels, fine.density.layer_levels)
    matrix = sparse.csr_matrix(sparse.kron(through, in_shell, format="csr"))
    matrix.eliminate_zeros()
    return matrix


def _through_thickness(coarse: Floats, fine: Floats) -> sparse.csr_matrix:
    below, part = _bracket(coarse, fine)
    return _rows(np.stack([below, below + 1]), np.stack([1 - part, part]), len(coarse))


def _in_shell(density: MeshDensity, logical: Floats) -> sparse.csr_matrix:
    """Interpolate from a shell's nodes at logical points: (n_points, nodes_per_shell)."""
    cap = np.abs(logical).max(axis=1) <= CAP_EXTENT * (1 + _ROUNDING)
    columns, weights = np.empty((4, len(logical)), dtype=np.int64), np.empty((4, len(logical)))
    columns[:, cap], weights[:, cap] = _in_cap(density, logical[cap])
    columns[:, ~cap], weights[:, ~cap] = _in_rings(density, logical[~cap])
    return _rows(columns, weights, density.nodes_per_shell)


def _in_cap(density: MeshDensity, logical: Floats) -> tuple[Ints, Floats]:
    a, b = density.cap
    i, s = _bracket(np.arange(a + 1), (logical[:, 0] / CAP_EXTENT + 1) * a / 2)
    j, t = _bracket(np.arange(b + 1), (logical[:, 1] / CAP_EXTENT + 1) * b / 2)
    first = i * (b + 1) + j
    return np.stack([first, first + b + 1, first + b + 2, first + 1]), _bilinear(s, t)


def _in_rings(density: MeshDensity, logical: Floats) -> tuple[Ints, Floats]:
    rho = np.abs(logical).max(axis=1)
    u, v = (logical / rho[:, None]).T
    a, b = density.cap
    # steps along the square's edge, counter-clockwise from the corner (-1, -1)
    along = np.select(
        [v <= -1 + _ROUNDING, u >= 1 - _ROUNDING, v >= 1 - _ROUNDING],
        [(u + 1) * a / 2, a + (v + 1) * b / 2, a + b + (1 - u) * a / 2],
        2 * a + b + (1 - v) * b / 2,
    )
    step, t = _bracket(np.arange(density.ring_size + 1), along)
    ring, s = _bracket(density.ring_levels, rho)
    rings, following = ring_nodes(density), (step + 1) % density.ring_size
    nodes = [rings[ring, step], rings[ring + 1, step], rings[ring + 1, following], rings[ring, following]]
    return np.stack(nodes), _bilinear(s, t)


def _bracket(levels: np.ndarray, values: Floats) -> tuple[Ints, Floats]:
    """Index of the interval of `levels` that holds each value, and the value's place in it, 0 to 1."""
    below = np.clip(np.searchsorted(levels, values + _ROUNDING, side="right") - 1, 0, len(levels) - 2)
    part = (values - levels[below]) / (levels[below + 1] - levels[below])
    part = np.where(np.abs(part - np.rint(part)) < 1e3 * _ROUNDING, np.rint(part), part)
    return below, np.clip(part, 0, 1)


def _bilinear(s: Floats, t: Floats) -> Floats:
    return np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])


def _rows(columns: Ints, weights: Floats, n_columns: int) -> sparse.csr_matrix:
    n_rows = columns.shape[1]
    rows = np.broadcast_to(np.arange(n_rows), columns.shape)
    return sparse.csr_matrix((weights.ravel(), (rows.ravel(), columns.ravel())), shape=(n_rows, n_columns))
