"""Which mode of one model is which mode of another: modal assurance criterion and optimal assignment.

Frequencies cross when a boundary, a mesh or a formulation changes, so rank does not identify a mode; its shape does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.fingertip import Fingertip, FingertipMesh, interpolation_from
from rom.fullorder import modal_assurance_criterion
from rom.vibration.skin_motion import Floats, Ints, on_all_nodes


@dataclass(frozen=True, eq=False)
class Pairing:
    """Partners of the modes of one set in another.

    Parameters
    ----------
    partner : (p,) ndarray of int
        Position in the other set.
    mac : (p,) ndarray [1]
        Of each pair.
    table : (p, q) ndarray [1]
        Of every combination.
    """

    partner: Ints
    mac: Floats
    table: Floats


def pair_modes(
    shape: Floats,
    other: Floats,
    mass: Any,
    *,
    parity: NDArray[np.str_] | None = None,
    other_parity: NDArray[np.str_] | None = None,
    first: int | None = None,
) -> Pairing:
    """Pair two sets of modes so that the sum of their MAC is largest.

    Parameters
    ----------
    shape, other : (n, p), (n, q) ndarray
        On the same dofs; q at least p.
    mass : (n, n) scipy sparse matrix [kg]
    parity, other_parity : (p,), (q,) ndarray of str, optional
        Modes of different parity are then never alike (by symmetry their MAC is zero but for rounding).
    first : int, optional
        So many of the first modes choose their partners before the rest does; all at once by default.

    Returns
    -------
    Pairing
        Every mode of the first set gets another partner, whether it resembles it or not: look at ``mac``.

    Raises
    ------
    ValueError
        If the second set is smaller than the first, or shapes cannot be compared.
    """
    from scipy.optimize import linear_sum_assignment

    table = modal_assurance_criterion(shape, other, mass)
    p, q = table.shape
    if q < p:
        raise ValueError(f"{p} modes cannot all find partners among {q}: compute at least {p} of the second set")
    if parity is not None and other_parity is not None:
        table = np.where(np.asarray(parity)[:, None] == np.asarray(other_parity)[None], table, 0.0)
    partner = np.full(p, -1, dtype=np.int64)
    taken = np.zeros(q, dtype=bool)
    cut = p if first is None else min(first, p)
    for rows in (np.arange(cut), np.arange(cut, p)):
        columns = np.flatnonzero(~taken)
        chosen_rows, chosen = linear_sum_assignment(table[np.ix_(rows, columns)], maximize=True)
        partner[rows[chosen_rows]] = columns[chosen]
        taken[columns[chosen]] = True
    return Pairing(partner, table[np.arange(p), partner], table)


def on_common_dofs(tip: Fingertip, shape: Floats, held: Fingertip) -> Floats:
    """Rows of a fingertip's shapes that are free in another fingertip on the same mesh, which holds more.

    Parameters
    ----------
    tip : Fingertip
    shape : (n_free of tip, m) ndarray
    held : Fingertip
        Its free dofs are among those of ``tip``.

    Returns
    -------
    shape : (n_free of held, m) ndarray
        Fit for `pair_modes` with ``held.mass``.

    Raises
    ------
    ValueError
        If the second has free dofs that the first lacks.
    """
    if not np.isin(held.free_dofs, tip.free_dofs).all():
        raise ValueError("The fingertip to compare with moves where this one is held: exchange the two.")
    return shape[np.searchsorted(tip.free_dofs, held.free_dofs)]


def on_mesh(mesh: FingertipMesh, free_dofs: Ints, shape: Floats, reference: Fingertip) -> Floats:
    """Shapes of one mesh on the free dofs of another of the same family.

    Parameters
    ----------
    mesh : FingertipMesh
    free_dofs : (n_free,) ndarray
    shape : (n_free, m) ndarray
    reference : Fingertip
        Finer or coarser.

    Returns
    -------
    shape : (n_free of reference, m) ndarray
        Interpolated at its nodes; fit for `pair_modes` with ``reference.mass``.
    """
    field = on_all_nodes(mesh, free_dofs, shape)
    values = interpolation_from(mesh, reference.mesh) @ field.reshape(mesh.n_nodes, -1)
    return values.reshape(3 * reference.mesh.n_nodes, -1)[reference.free_dofs]
