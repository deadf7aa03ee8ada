"""Proper orthogonal decomposition: principal directions of snapshots.

Snapshots enter with unit norm, since errors are judged relative to each answer; a complex one gives its real and its
imaginary part, which keeps the basis real. (Sirovich 1987; Benner, Gugercin, Willcox 2015.)
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

MAX_RANK = 800
"""POD modes kept at most: more would cost memory and nobody could afford them online."""
NOISE = 1e-12
"""Share of the largest Gram eigenvalue below which a POD mode is rounding noise: 1e-6 of the singular value, since the
Gram matrix squares the snapshots and keeps half of their digits."""


@dataclass(frozen=True)
class PodSpace:
    """POD modes above rounding noise of one set of snapshots, so many of them at most as were asked for.

    vectors : (n, r) ndarray
        Orthonormal columns, by falling singular value.
    singular_values : (r,) ndarray
    seconds : float
        What the decomposition took [s].
    """

    vectors: np.ndarray
    singular_values: np.ndarray
    seconds: float

    def truncated(self, rank: int | None) -> np.ndarray:
        """(n, rank) ndarray: the first modes, or all.

        Raises
        ------
        ValueError
            Where the snapshots do not span that many dimensions.
        """
        if rank is None:
            return self.vectors
        if not 1 <= rank <= self.vectors.shape[1]:
            raise ValueError(f"rank {rank} is out of reach: these snapshots give {self.vectors.shape[1]} POD modes "
                             f"above rounding noise; ask for less or make more cases")
        return self.vectors[:, :rank]


def pod(snapshots: np.ndarray, rank: int = MAX_RANK, *, noise: float = NOISE, alike: bool = True) -> PodSpace:
    """POD of ``snapshots`` (n_case, n), real or complex, by the Gram matrix of the smaller side.

    Parameters
    ----------
    snapshots : (n_case, n) ndarray
    rank : int
        Modes kept at most.
    noise : float
        Share of the largest Gram eigenvalue below which a mode is left out.
    alike : bool
        Whether snapshots of any size count alike, and those that vanish not at all; if not, each counts by its size.

    Raises
    ------
    ValueError
        Where a snapshot is not finite, or all vanish.
    """
    start = time.perf_counter()
    rows = _unit_rows(np.asarray(snapshots)) if alike else np.asarray(snapshots)
    if np.iscomplexobj(rows):
        rows = np.concatenate([rows.real, rows.imag])
    if rows.shape[0] > rows.shape[1]:
        value, vectors = sla.eigh(rows.T @ rows)
        keep = _worth_keeping(value, rank, noise)
        vectors = vectors[:, keep][:, ::-1]
    else:
        value, weights = sla.eigh(rows @ rows.T)
        keep = _worth_keeping(value, rank, noise)
        vectors = rows.T @ (weights[:, keep] / np.sqrt(value[keep]))[:, ::-1]
        vectors = np.linalg.qr(vectors)[0]  # the Gram matrix halves the digits of the small modes' orthogonality
    singular = np.sqrt(value[keep][::-1])
    return PodSpace(vectors, singular, time.perf_counter() - start)


def _unit_rows(snapshots: np.ndarray) -> np.ndarray:
    """Snapshots with unit norm; first by their largest entry, whose square may lie outside double precision."""
    # |a + ib| itself may overflow or lose a denormal's digits: the larger part serves
    largest = np.maximum(np.abs(snapshots.real), np.abs(snapshots.imag)).max(axis=1, initial=0.0)
    if not np.isfinite(largest).all():
        raise ValueError(f"{np.count_nonzero(~np.isfinite(largest))} of {len(snapshots)} snapshots hold NaN or "
                         "infinity: leave them out, or find out why")
    acting = largest > 0
    if not acting.any():
        raise ValueError(f"all {len(snapshots)} snapshots vanish: a POD basis needs one displacement that does not")
    # by a power of two that its own size cannot overflow: twice half of the way
    half = -np.frexp(largest[acting])[1][:, None] // 2
    rest = -np.frexp(largest[acting])[1][:, None] - half
    rows = (snapshots[acting] * np.ldexp(1.0, half)) * np.ldexp(1.0, rest)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _worth_keeping(value: np.ndarray, rank: int, noise: float) -> np.ndarray:
    keep = value > noise * value[-1]
    keep[:-rank] = False
    return keep
