"""Registration of load paths: travel is counted in shares of that at which the finger slips.

Coefficients have a kink where the finger begins to slip, at another travel for every path; interpolated as they lie,
kinks blur. Counted in shares of the onset they lie at the same place. A path that ends before its onset goes on along
its last slope up to there: a finger that sticks answers nearly linearly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rom.metamodels.finger_on_glass.kriging import Regressor, fit_regressor
from rom.scenes.paths import PathArrays

SLIPPING = 0.95
"""Share of friction times normal force that the tangential force reaches at the onset."""
FINE, FINE_END, COARSE = 46, 1.25, 12
"""Stations up to that share of the onset, and after it."""
SLOPE_OVER = 4
"""Last positions whose slope a path goes on along."""


def slip_onset(paths: PathArrays, tangential_force: np.ndarray, travel: np.ndarray) -> np.ndarray:
    """(n_path,) ndarray [m]: travel at the onset of slip; where it lies beyond the path, along the line from the start.

    Parameters
    ----------
    paths : PathArrays
    tangential_force : (n_path, n_travel) ndarray [N]
    travel : (n_travel,) ndarray [m]
        From zero, ascending.
    """
    share = tangential_force / np.maximum(paths.friction * paths.normal_force, 1e-300)[:, None]
    onset = np.empty(len(share))
    for i, line in enumerate(share):
        reached = np.flatnonzero(line >= SLIPPING)
        if len(reached) and reached[0] > 0:
            j = reached[0]
            onset[i] = travel[j - 1] + (SLIPPING - line[j - 1]) / (line[j] - line[j - 1]) * (travel[j] - travel[j - 1])
        else:
            onset[i] = travel[1] if len(reached) else travel[-1] * SLIPPING / max(line[-1], 0.05)
    return onset


@dataclass(eq=False)
class Registration:
    """Stations at shares of the onset instead of positions at given travel; those of pressing stay.

    Parameters
    ----------
    onset : Regressor
        Logarithm of the onset [m], less ``level``, from the paths' features.
    level : float
    grid : (n_grid,) ndarray
        Shares of the onset, from zero.
    """

    onset: Regressor
    level: float
    grid: np.ndarray

    @classmethod
    def of(cls, features: np.ndarray, onset: np.ndarray, last: float) -> Registration:
        """Learn the onsets [m] of training paths whose last position is at ``last`` [m]."""
        logarithm = np.log(onset)
        level = float(logarithm.mean())
        most = max(1.5 * last / onset.min(), FINE_END + 0.5)
        grid = np.concatenate([np.linspace(0, FINE_END, FINE), np.geomspace(FINE_END, most, COARSE + 1)[1:]])
        return cls(fit_regressor("gp", features, (logarithm - level)[:, None]), level, grid)

    def to_stations(self, state: np.ndarray, onset: np.ndarray, travel: np.ndarray) -> np.ndarray:
        """(n_path, n_press + n_grid, m) ndarray from (n_path, n_position, m) values and true onsets [m]."""
        from scipy.interpolate import PchipInterpolator

        press = int((travel == 0).sum())
        along = travel[press - 1:]
        out = np.empty((len(state), press + len(self.grid), state.shape[2]))
        out[:, :press] = state[:, :press]
        for i, (one, at) in enumerate(zip(state, onset, strict=True)):
            slid, end = one[press - 1:], along[-1] / at
            out[i, press:] = PchipInterpolator(along / at, slid, axis=0)(np.minimum(self.grid, end))
            if end < 1:
                slope = (slid[-1] - slid[-SLOPE_OVER]) / (along[-1] - along[-SLOPE_OVER]) * at
                out[i, press:] += np.clip(np.minimum(self.grid, 1.0) - end, 0, None)[:, None] * slope
        return out

    def to_positions(self, stations: np.ndarray, features: np.ndarray, travel: np.ndarray) -> np.ndarray:
        """(n_path, n_position, m) ndarray: the inverse of :meth:`to_stations`, with the learned onsets."""
        press = int((travel == 0).sum())
        onset = np.exp(self.onset(features)[:, 0] + self.level)
        share = np.minimum(travel[press:] / onset[:, None], self.grid[-1])
        right = np.clip(np.searchsorted(self.grid, share), 1, len(self.grid) - 1)
        weight = ((share - self.grid[right - 1]) / (self.grid[right] - self.grid[right - 1]))[..., None]
        rows = np.arange(len(stations))[:, None]
        slid = stations[rows, press + right - 1] * (1 - weight) + stations[rows, press + right] * weight
        return np.concatenate([stations[:, :press], slid], axis=1)
