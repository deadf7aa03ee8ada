"""Resonances read off a sampled frequency response: peaks of its magnitude, and poles fitted to its complex values.

Of a single oscillator with structural damping, ``1 / |X|^2 = (k - m omega^2)^2 + (eta k)^2`` is a parabola in
``omega^2``. Parabolas through three samples of ``1 / |X|^2`` over ``f^2`` hence find its peak and its half-power
frequencies exactly whatever the step, where interpolation of ``|X|`` over ``f`` would not; for a multi-degree response
they are as good an interpolation as any. Half power lies at ``omega^2 = omega_0^2 (1 -+ eta)``:
``eta = (f_2^2 - f_1^2) / (2 f_0^2)``. (Ewins, Modal Testing, 2000: peak picking.)

Complex samples tell a resonance from what other modes add to it: a response is a ratio of polynomials, near one pole a
simple one, which is fitted linearly and reweighted by its own denominator (Sanathanan and Koerner, IEEE Trans.
Automatic Control 8, 1963, 56). That is exact for one oscillator upon a constant, on any samples as many as there are
unknowns; circle fits see the same circle, but need samples all around it. Where several modes overlap in samples
without noise, the ratio of higher degree that the AAA algorithm finds (Nakatsukasa, Sete, Trefethen, SIAM J. Sci.
Comput. 40, 2018, A1494) is exact too; noise betrays itself, as no ratio of low degree passes through such samples.
"""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rom.checks import choice

DAMPING = ("hysteretic", "viscous")
HALF_POWER = 2.0
LEAST_SAMPLES = {"hysteretic": 3, "viscous": 4}
WINDOW = 9
"""Samples about a peak that a fit takes at least, where the response has as many."""
DROP = 20.0
"""A fit takes the samples on both sides down to the peak's height over this, or until the response rises again by"""
RISE = 1.2
"""this factor, more than noise does."""
EXACT = 1e-9
"""Misfit below which samples hold no noise."""
REWEIGHTINGS = 20


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


class Resonance(NamedTuple):
    """A pole fitted to complex samples."""

    frequency: float
    """Natural frequency [Hz]."""
    loss_factor: float
    """[1]; of viscous damping twice the damping ratio."""
    misfit: float
    """Root mean square of what the fit leaves of the samples, over that of the samples [1]."""

    @property
    def damping_ratio(self) -> float:
        """Share of critical damping [1]."""
        return self.loss_factor / 2


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
    f, x = _samples(frequency, np.abs(np.asarray(response)))
    if not (x > 0).all():
        raise ValueError("the response holds a zero: peaks need positive magnitudes")
    inside = np.arange(1, len(f) - 1)
    return [_peak(f, x, int(i)) for i in inside[(x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])]]


def highest_peak(frequency: ArrayLike, response: ArrayLike, above: float = 0.0) -> Peak | None:
    """The highest of `peaks`; None where the response has no maximum within its range.

    Parameters
    ----------
    frequency, response : (n,) array_like
        As for `peaks`.
    above : float [Hz]
        Maxima at or below this frequency do not count.
    """
    found = [peak for peak in peaks(frequency, response) if peak.frequency > above]
    return max(found, key=lambda peak: peak.height) if found else None


def fit_resonance(frequency: ArrayLike, response: ArrayLike, *, near: float | None = None,
                  damping: str = "hysteretic") -> Resonance:
    """The resonance at a peak of a complex response, apart from what other modes add to it there.

    Parameters
    ----------
    frequency : (n,) array_like [Hz]
        Ascending.
    response : (n,) array_like of complex
        Displacement, velocity or acceleration of one degree of freedom over a force; time factor e^{+i omega t}.
    near : float [Hz], optional
        The sampled maximum nearest to this frequency is fitted; the highest one by default.
    damping : {"hysteretic", "viscous"}
        Whether the pole lies at ``omega^2 = omega_0^2 (1 + i eta)`` or at ``omega^2 = omega_0^2 + i eta omega_0
        omega``. Both fits are exact for one such oscillator upon a constant, in any of the three quantities except
        that hysteretic velocities take a constant for a linear background.

    Raises
    ------
    ValueError
        As `peaks`; where the response is real, has too few samples, or no maximum within its range.
    """
    choice("damping", damping, DAMPING)
    if not np.iscomplexobj(response):
        raise ValueError("the response is real: a fit needs complex samples; `peaks` reads loss factors off magnitudes")
    f, h = _samples(frequency, np.asarray(response))
    x = np.abs(h)
    tops = 1 + np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:]))
    if not len(tops) or len(f) < LEAST_SAMPLES[damping]:
        raise ValueError(f"the {len(f)} samples of the response hold no maximum that could be fitted: give at least "
                         f"{LEAST_SAMPLES[damping]} about a resonance")
    i = int(tops[np.argmax(x[tops])] if near is None else tops[np.argmin(np.abs(f[tops] - near))])
    top, window = f[i], _window(x, i)
    f, h = f[window], h[window]
    scale, size = f.mean(), np.abs(h).max()
    omega, h = f / scale, h / size
    fit = _hysteretic if damping == "hysteretic" else _viscous
    weight = np.ones(len(f))
    for _ in range(REWEIGHTINGS):
        pole, denominator, left = fit(omega, h, weight)
        weight = 1 / np.maximum(np.abs(denominator), 1e-12 * np.abs(denominator).max())
    misfit = float(np.linalg.norm(left / denominator) / np.linalg.norm(h))
    if misfit > EXACT:
        pole, misfit = _of_several(omega, h, top / scale, damping) or (pole, misfit)
    return Resonance(float(scale * np.sqrt(pole.real)), float(pole.imag / pole.real), misfit)


def _samples(frequency: ArrayLike, response: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    f = np.asarray(frequency, dtype=float)
    if f.ndim != 1 or f.shape != response.shape:
        raise ValueError(f"frequency has shape {f.shape} and the response {response.shape}: give one value a frequency")
    if not (np.diff(f) > 0).all():
        raise ValueError("the frequencies do not ascend: sort the response by frequency")
    if not np.isfinite(response).all():
        raise ValueError("the response holds a value that is not finite: leave such samples out")
    return f, response


def _window(x: np.ndarray, i: int) -> slice:
    """Samples about the maximum i that tell of its pole."""
    ends = []
    for side in (x[i::-1], x[i:]):
        lowest = np.minimum.accumulate(side)
        stop = np.flatnonzero((side < x[i] / DROP) | (side > RISE * lowest))
        ends.append(int(np.argmin(side[:stop[0] + 1])) if len(stop) else len(side) - 1)
    return slice(max(0, i - max(ends[0], WINDOW // 2)), i + max(ends[1], WINDOW // 2) + 1)


def _of_several(omega: np.ndarray, h: np.ndarray, top: float, damping: str) -> tuple[complex, float] | None:
    """Pole nearest to the peak of a ratio of higher degree, and its misfit; None where there is noise."""
    from scipy.interpolate import AAA  # costs more to import than all the rest here

    z = omega**2 if damping == "hysteretic" else np.concatenate([1j * omega, -1j * omega])
    values = h if damping == "hysteretic" else np.concatenate([h, h.conj()])
    terms = len(z) // 3
    if terms < 2:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # that it did not converge is read off the misfit
        found = AAA(z, values, rtol=0.1 * EXACT, max_terms=terms, clean_up=False)
    misfit = float(np.linalg.norm(found(z) - values) / np.linalg.norm(values))
    poles = found.poles() if misfit <= EXACT else np.empty(0)
    if damping == "viscous":  # of the characteristic values, those above the real axis
        poles = np.array([abs(p) ** 2 * (1 - 2j * p.real / abs(p)) for p in poles if p.imag > 0])
    poles = poles[(poles.real > 0) & (poles.imag > 0)]
    return (complex(poles[np.argmin(np.abs(poles - top**2))]), misfit) if len(poles) else None


def _hysteretic(omega: np.ndarray, h: np.ndarray, weight: np.ndarray) -> tuple[complex, np.ndarray, np.ndarray]:
    """Pole, denominator and equation error of h (p - s) = a + b s, s = omega^2, by weighted least squares."""
    s = omega**2
    columns = np.stack([h, -np.ones_like(h), -s], axis=1)
    pole, *rest = np.linalg.lstsq(columns * weight[:, None], h * s * weight, rcond=None)[0]
    return pole, pole - s, h * (pole - s) - rest[0] - rest[1] * s


def _viscous(omega: np.ndarray, h: np.ndarray, weight: np.ndarray) -> tuple[complex, np.ndarray, np.ndarray]:
    """The same of h (k + i c omega - omega^2) = a + b omega + d omega^2, k and c real; the pole is k (1 + i eta)."""
    top = omega[:, None] ** np.arange(3)
    columns = np.concatenate([np.stack([h, 1j * omega * h], axis=1), -top, -1j * top], axis=1)
    columns, right = columns * weight[:, None], h * omega**2 * weight
    k, c, *rest = np.linalg.lstsq(np.concatenate([columns.real, columns.imag]),
                                  np.concatenate([right.real, right.imag]), rcond=None)[0]
    denominator = k + 1j * c * omega - omega**2
    return k + 1j * c * np.sqrt(k), denominator, h * denominator - top @ (np.array(rest[:3]) + 1j * np.array(rest[3:]))


def _peak(f: np.ndarray, x: np.ndarray, i: int) -> Peak:
    s, y = f**2, (x[i] / x) ** 2  # scaled: the parabola is about 1
    around = slice(i - 1, i + 2)
    bend = _parabola(s[around] - s[i], y[around])
    a, b, c = bend
    shift, lowest = -b / (2 * a), c - b * b / (4 * a)
    if lowest > 0:
        height = x[i] / np.sqrt(lowest)
    else:  # samples too far apart for one oscillator: a parabola of log |X| stays positive
        a, b, c = _parabola(s[around] - s[i], np.log(x[around] / x[i]))
        shift, height = -b / (2 * a), x[i] * np.exp(c - b * b / (4 * a))
    level = HALF_POWER * (x[i] / height) ** 2
    if lowest > 0 and level <= 1:  # a peak so sharp that its half-power points lie about it between two samples
        half = np.sqrt((level - lowest) / bend[0])
        sides = s[i] + shift - half, s[i] + shift + half
        return Peak(float(np.sqrt(s[i] + shift)), float(height), *(float(np.sqrt(side)) for side in sides))
    sides = _crossing(s, y, i, -1, level), _crossing(s, y, i, 1, level)
    return Peak(float(np.sqrt(s[i] + shift)), float(height), *sides)


def _parabola(s: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Coefficients a, b, c of a s^2 + b s + c through three points, by divided differences."""
    first = np.diff(y) / np.diff(s)
    a = (first[1] - first[0]) / (s[2] - s[0])
    b = first[0] - a * (s[0] + s[1])
    return a, b, y[0] - s[0] * (b + a * s[0])


def _crossing(s: np.ndarray, y: np.ndarray, i: int, step: int, level: float) -> float:
    """Frequency [Hz] on one side of sample i where ``y`` first reaches ``level``, before it turns back; else NaN."""
    out = y[i::step]
    turn = np.flatnonzero(np.diff(out) < 0)
    # the first step may fall: the sampled maximum stands beside the parabola's
    end = len(out) if not len(turn[turn > 0]) else int(turn[turn > 0][0]) + 1
    above = np.flatnonzero(out[:end] >= level)
    if not len(above):
        return float("nan")
    outer = i + step * int(above[0])
    inner = outer - step
    middle = i if inner == i else inner  # the parabola about the maximum, or one that ends at the crossing
    around = np.arange(middle - 1, middle + 2)
    a, b, c = _parabola(s[around] - s[inner], y[around])
    roots = np.roots([a, b, c - level]) + s[inner]
    low, high = sorted((s[inner], s[outer]))
    slack = 1e-9 * (high - low)
    inside = [root.real for root in np.atleast_1d(roots)
              if abs(root.imag) <= slack and low - slack <= root.real <= high + slack]
    if inside:
        return float(np.sqrt(inside[0]))
    return float(np.sqrt(s[inner] + (s[outer] - s[inner]) * (level - y[inner]) / (y[outer] - y[inner])))
