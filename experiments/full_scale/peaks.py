"""Resonance peaks: where and how high the pad moves most, by each method against the truth.

The response is the root mean square displacement of the pad's surface over 1-300 Hz at every hertz; a peak's place and
height follow from the parabola through the logarithms of its three highest points.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rom.datasets.reduced import ReducedField
from rom.scenes import CaseArrays, LinearScene
from rom.scenes.harmonic_point_force import AMPLITUDE, FREQUENCY

NODES = 24
LOSS_FACTORS = (0.1, 0.2, 0.5)
QUIET_HZ = 20
"""Below this, the response is the static one, which no peak is."""


class Peaks:
    """Largest errors of the highest peak's frequency and height, filled an entry at a time.

    Parameters
    ----------
    scene : LinearScene
        `harmonic-point-force`.
    field : ReducedField
        The truth.
    n_entry : int
    """

    def __init__(self, scene: LinearScene, field: ReducedField, n_entry: int) -> None:
        nodes = np.linspace(0, scene.n_loads - 1, NODES).astype(int)
        self.curves = [(node, loss) for node in nodes for loss in LOSS_FACTORS]
        shapes = field.modes[:, scene.part_rows]
        self.truth = highest_peak(np.array([_true_response(field, scene, shapes, *curve) for curve in self.curves]))
        self.wrong = np.full((2, n_entry), np.nan)

    def put(self, entry: int, model: Any) -> None:
        """Take in a fitted model."""
        place, height, inside = self.truth
        at, high, _ = highest_peak(np.array([_size(model.evaluate(_curve(*curve), "pad")) for curve in self.curves]))
        self.wrong[:, entry] = np.abs(at - place)[inside].max(), np.abs(high / height - 1)[inside].max()

    def variables(self) -> dict[str, tuple]:
        """Named, with units."""
        return {
            "peak_frequency_error": ("entry", self.wrong[0], {
                "long_name": "largest error of the highest peak's frequency", "units": "Hz"}),
            "peak_height_error": ("entry", self.wrong[1], {
                "long_name": "largest relative error of the highest peak's height", "units": "1"}),
            "peak_count": ((), int(self.truth[2].sum()), {
                "long_name": "frequency responses with a peak", "units": "1"})}


def highest_peak(response: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place and height of the highest local maximum above :data:`QUIET_HZ`.

    Parameters
    ----------
    response : (n, 300) ndarray
        At 1, 2, ... Hz.

    Returns
    -------
    place : (n,) ndarray [Hz]
    height : (n,) ndarray
    inside : (n,) ndarray of bool
        Whether there is one; place and height are those of the largest value elsewhere.
    """
    log = np.log(response)
    rising = (log[:, 1:-1] > log[:, :-2]) & (log[:, 1:-1] >= log[:, 2:])
    rising[:, :QUIET_HZ] = False
    candidate = np.where(rising, log[:, 1:-1], -np.inf)
    inside = rising.any(axis=1)
    top = np.where(inside, candidate.argmax(axis=1), log[:, 1:-1].argmax(axis=1)) + 1
    row = np.arange(len(log))
    left, middle, right = log[row, top - 1], log[row, top], log[row, top + 1]
    bend = left - 2 * middle + right
    shift = np.where(bend < 0, 0.5 * (left - right) / np.where(bend < 0, bend, -1.0), 0.0)
    return FREQUENCY[top] + shift, np.exp(middle - 0.25 * (left - right) * shift), inside


def _curve(node: int, loss_factor: float) -> CaseArrays:
    n = len(FREQUENCY)
    return CaseArrays(np.full((n, 1), node), np.full((n, 1), AMPLITUDE[1]), FREQUENCY, np.full(n, loss_factor))


def _size(pad: np.ndarray) -> np.ndarray:
    return np.linalg.norm(pad, axis=1)


def _true_response(field: ReducedField, scene: LinearScene, modes: np.ndarray, node: int, loss_factor: float
                   ) -> np.ndarray:
    """(300,) ndarray: the stored answers' size over the pad."""
    cases = np.flatnonzero((field.load == node) & np.isclose(field.stiffness.imag, loss_factor)
                           & (field.inertia < (2 * np.pi * (FREQUENCY[-1] + 0.5)) ** 2))
    modal, own = field.coefficients(cases[np.argsort(field.inertia[cases])])
    return _size(modal @ modes + own @ field.own_shapes(node)[:, scene.part_rows])
