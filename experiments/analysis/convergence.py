"""Convergence of a quantity under mesh refinement: observed order and limit.

f(h) = f_0 + c h^p with h a mesh width; p and f_0 from three grids or more by least squares (Roache, Verification and
Validation in Computational Science and Engineering, 1998, chapter 5: Richardson extrapolation with unequal ratios).
Eigenvalues of a smooth problem on 8-node hexahedra converge with p = 2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

ORDERS = (0.25, 6.0)
"""Orders that are searched; at an end the data show none."""


class Extrapolation(NamedTuple):
    """Limit, order and misfit of one quantity.

    Parameters
    ----------
    limit : float
    order : float
        NaN where none is visible: a change that does not decay as a power, or that is lost in scatter.
    misfit : float
        Root mean square distance of the data from the fit, in units of the quantity.
    """

    limit: float
    order: float
    misfit: float


def extrapolate(width: ArrayLike, value: ArrayLike, order: float | None = None) -> Extrapolation:
    """Fit f_0 + c h^p.

    Parameters
    ----------
    width : (k,) array_like
        Mesh widths, k at least 3, or 2 with a given order; decreasing or not.
    value : (k,) array_like
    order : float, optional
        Take this one instead of searching it.

    Raises
    ------
    ValueError
        For too few points, or widths that are not positive and different.
    """
    h, f = np.asarray(width, dtype=float), np.asarray(value, dtype=float)
    least = 3 if order is None else 2
    if h.ndim != 1 or h.shape != f.shape or len(h) < least:
        raise ValueError(f"The fit got {h.size} widths and {f.size} values, but it needs {least} of both: refine more.")
    if not (np.all(h > 0) and len(np.unique(h)) == len(h) and np.all(np.isfinite(f))):
        raise ValueError("Mesh widths must be positive and different, and values finite: check the refinement.")
    h = h / h.max()
    if order is not None:
        return Extrapolation(_fit(h, f, order)[0], order, _fit(h, f, order)[1])
    from scipy.optimize import minimize_scalar

    grid = np.linspace(*ORDERS, 60)
    best = int(np.argmin([_fit(h, f, p)[1] for p in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = float(minimize_scalar(lambda p: _fit(h, f, p)[1], bounds=(low, high), method="bounded",
                                  options={"xatol": 1e-10}).x)
    limit, misfit = _fit(h, f, found)
    inside = ORDERS[0] + 1e-3 < found < ORDERS[1] - 1e-3
    return Extrapolation(limit, found if inside and misfit < np.ptp(f) / 4 else np.nan, misfit)


def _fit(h: np.ndarray, f: np.ndarray, order: float) -> tuple[float, float]:
    """Limit and root mean square misfit at one order."""
    matrix = np.stack([np.ones_like(h), h**order], axis=1)
    centre = f.mean()  # the misfit of close values is not lost in their size
    weights, *_ = np.linalg.lstsq(matrix, f - centre, rcond=None)
    return float(weights[0] + centre), float(np.sqrt(np.mean((matrix @ weights - (f - centre)) ** 2)))
