"""Resonance peaks: where and how high the pad moves most, by each method against the truth.

The response is the root mean square displacement of the pad's surface over 1-300 Hz at every hertz.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rom.datasets.reduced import ReducedField
from rom.scenes import CaseArrays, LinearScene
from rom.scenes.harmonic_point_force import AMPLITUDE, FREQUENCY
from rom.vibration.resonance import highest_peak

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
        curves = [(node, loss) for node in nodes for loss in LOSS_FACTORS]
        shapes = field.modes[:, scene.part_rows]
        truth = [highest_peak(FREQUENCY, _true_response(field, scene, shapes, *curve), above=QUIET_HZ)
                 for curve in curves]
        self.peaks = [(curve, top) for curve, top in zip(curves, truth, strict=True) if top is not None]
        self.wrong = np.full((2, n_entry), np.nan)

    def put(self, entry: int, model: Any) -> None:
        """Take in a fitted model."""
        errors = []
        for curve, top in self.peaks:
            response = _size(model.evaluate(_curve(*curve), "pad"))
            found = highest_peak(FREQUENCY, response, above=QUIET_HZ)
            # a response that only falls has its largest value in place of a peak
            at, high = (found.frequency, found.height) if found else (FREQUENCY[response.argmax()], response.max())
            errors.append([abs(at - top.frequency), abs(high / top.height - 1)])
        self.wrong[:, entry] = np.max(errors, axis=0)

    def variables(self) -> dict[str, tuple]:
        """Named, with units."""
        return {
            "peak_frequency_error": ("entry", self.wrong[0], {
                "long_name": "largest error of the highest peak's frequency", "units": "Hz"}),
            "peak_height_error": ("entry", self.wrong[1], {
                "long_name": "largest relative error of the highest peak's height", "units": "1"}),
            "peak_count": ((), len(self.peaks), {"long_name": "frequency responses with a peak", "units": "1"})}


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
