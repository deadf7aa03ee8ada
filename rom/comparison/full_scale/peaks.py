"""Resonance peaks: where and how high the pad moves most, by each method against the truth.

The response is the root mean square displacement of the pad's surface over 1-300 Hz at every hertz; a peak's place and
height follow from the parabola through the logarithms of its three highest points.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rom.comparison.entries import Entry
from rom.comparison.held_out import SHARE
from rom.datasets import SPLITS
from rom.datasets.reduced import ReducedField
from rom.scenes import CaseArrays, Scene
from rom.scenes.harmonic_point_force import AMPLITUDE, FREQUENCY

NODES = 24
LOSS_FACTORS = (0.1, 0.2, 0.5)
QUIET_HZ = 20
"""Below this, the response is the static one, which no peak is."""


def peak_errors(entries: list[Entry], scene: Scene, field: ReducedField, progress: Callable) -> dict[str, tuple]:
    """Largest errors of the highest peak's frequency and height, of each headline entry.

    Parameters
    ----------
    entries : list of Entry
    scene : HarmonicPointForce
    field : ReducedField
        The truth.
    progress : callable
        Wraps the iteration over entries, to show a bar.
    """
    nodes = np.linspace(0, scene.n_pad - 1, NODES).astype(int)
    curves = [(node, loss) for node in nodes for loss in LOSS_FACTORS]
    shapes = field.modes[:, scene.pad_rows]
    truth = np.array([_true_response(field, scene, shapes, node, loss) for node, loss in curves])
    place, height, inside = highest_peak(truth)
    wrong = np.full((2, len(entries)), np.nan)
    rows = [i for i, entry in enumerate(entries) if entry.headline and entry.method not in SHARE]
    for i in progress(rows):
        model = entries[i].models[SPLITS[0]]
        found = np.array([_size(model.evaluate(_curve(node, loss), "pad")) for node, loss in curves])
        at, high, _ = highest_peak(found)
        wrong[:, i] = np.abs(at - place)[inside].max(), np.abs(high / height - 1)[inside].max()
    return {"peak_frequency_error": ("entry", wrong[0], {
                "long_name": "largest error of the highest peak's frequency", "units": "Hz"}),
            "peak_height_error": ("entry", wrong[1], {
                "long_name": "largest relative error of the highest peak's height", "units": "1"}),
            "peak_count": ((), int(inside.sum()), {"long_name": "frequency responses with a peak", "units": "1"})}


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


def _true_response(field: ReducedField, scene: Scene, modes: np.ndarray, node: int, loss_factor: float) -> np.ndarray:
    """(300,) ndarray: the stored answers' size over the pad."""
    cases = np.flatnonzero((field.load == node) & np.isclose(field.stiffness.imag, loss_factor)
                           & (field.inertia < (2 * np.pi * (FREQUENCY[-1] + 0.5)) ** 2))
    modal, own = field.coefficients(cases[np.argsort(field.inertia[cases])])
    return _size(modal @ modes + own @ field.own_shapes(node)[:, scene.pad_rows])
