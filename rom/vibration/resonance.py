"""Resonances read off a sampled frequency response: peak frequency, height, half-power width.

Of a single oscillator with structural damping, ``1 / |X|^2 = (k - m omega^2)^2 + (eta k)^2`` is a parabola in
``omega^2``. A parabola through the three samples about a maximum, of ``1 / |X|^2`` over ``f^2``, hence finds its peak
exactly whatever the step, where one of ``|X|`` over ``f`` would not; for a multi-degree response it is as good an
interpolation as any. Half power lies at ``omega^2 = omega_0^2 (1 -+ eta)``: ``eta = (f_2^2 - f_1^2) / (2 f_0^2)``.
(Ewins, Modal Testing, 2000: peak picking.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Peak(NamedTuple):
    """A local maximum of a frequency response."""

    frequency: float
    """[Hz]"""
    height: float
    """In the unit of the response."""
    lower: float
    """Half-power frequency below [Hz]; NaN where the response does not fall that far before it rises again or ends."""
    upper: float
    """Half-power frequency above [Hz]; NaN likewise."""

    @property
    def loss_factor(self) -> float:
        """Of the single oscillator with this half-power width; NaN where a side is missing."""
        return (self.upper**2 - self.lower**2) / (2 * self.frequency**2)


def peaks(frequency: ArrayLike, response: ArrayLike) -> list[Peak]:
    """Local maxima within the sampled range, by rising frequency.

    Parameters
    ----------
    frequency : (n,) array_like [Hz]
        Ascending.
    response : (n,) array_like
        Complex or magnitude; its magnitude counts.

    Raises
    ------
    ValueError
        For arrays that do not fit, frequencies that do not ascend, or a response that is not finite and positive.
    """
    f, x = np.asarray(frequency, dtype=float), np.abs(np.asarray(response))
    if f.ndim != 1 or f.shape != x.shape:
        raise ValueError(f"frequency has shape {f.shape} and the response {x.shape}: give one value a frequency")
    if not (np.diff(f) > 0).all():
        raise ValueError("the frequencies do not ascend: sort the response by frequency")
    if not (np.isfinite(x) & (x > 0)).all():
        raise ValueError("the response holds a value that is not finite or zero: peaks need positive magnitudes")
    inside = np.arange(1, len(f) - 1)
    return [_peak(f, x, int(i)) for i in inside[(x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])]]


def highest_peak(frequency: ArrayLike, response: ArrayLike) -> Peak | None:
    """The highest of `peaks`; None where the response has no maximum within its range."""
    found = peaks(frequency, response)
    return max(found, key=lambda peak: peak.height) if found else None


def _peak(f: np.ndarray, x: np.ndarray, i: int) -> Peak:
    s, y = f**2, (x[i] / x) ** 2  # scaled: the parabola is about 1
    around = slice(i - 1, i + 2)
    a, b, c = np.polyfit(s[around] - s[i], y[around], 2)
    shift, lowest = -b / (2 * a), c - b * b / (4 * a)
    if lowest > 0:
        height = x[i] / np.sqrt(lowest)
    else:  # samples too far apart for one oscillator: a parabola of log |X| stays positive
        a, b, c = np.polyfit(s[around] - s[i], np.log(x[around] / x[i]), 2)
        shift, height = -b / (2 * a), x[i] * np.exp(c - b * b / (4 * a))
    level = 2.0 * (x[i] / height) ** 2
    return Peak(float(np.sqrt(s[i] + shift)), float(height), _crossing(s[i::-1], y[i::-1], level),
                _crossing(s[i:], y[i:], level))


def _crossing(s: np.ndarray, y: np.ndarray, level: float) -> float:
    """Frequency [Hz] where ``y`` first reaches ``level``, before it turns back; NaN if it does not."""
    turn = np.flatnonzero(np.diff(y) < 0)
    # the first step may fall: the sampled maximum stands beside the parabola's
    end = len(y) if not len(turn[turn > 0]) else int(turn[turn > 0][0]) + 1
    above = np.flatnonzero(y[:end] >= level)
    if not len(above):
        return float("nan")
    k = int(above[0])
    return float(np.sqrt(s[k - 1] + (s[k] - s[k - 1]) * (level - y[k - 1]) / (y[k] - y[k - 1])))
