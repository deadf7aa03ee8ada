"""Harmonic scene of the published metamodel: one normal force, (K (1 + i eta) - omega^2 M) u = f (paper eq. 2-4)."""

from __future__ import annotations

import numpy as np

from rom.fingertip import Fingertip
from rom.scenes.cases import CaseArrays
from rom.scenes.fingertip_scene import fingertip_scene, normal_forces
from rom.scenes.inputs import Input
from rom.scenes.linear_scene import LinearScene
from rom.scenes.population import CASES_PER_POINT, Population, at_points
from rom.scenes.question import Question

FREQUENCY = np.arange(1.0, 301.0)
LOSS_FACTOR = np.round(np.arange(0.10, 0.501, 0.05), 2)
FREQUENCY_BEYOND = np.arange(301.0, 401.0)
LOSS_FACTOR_BEYOND = np.array([0.05, 0.60])
HELD_OUT_BANDS = ((112.0, 126.0), (206.0, 220.0))
"""Frequencies [Hz] that the hard split keeps from training: about the first mode and about the normal-force peak."""
AMPLITUDE = (0.01, 0.1)
"""Sampled force amplitudes [N]; the model is linear, so any other amplitude scales exactly."""

HARMONIC_POINT_FORCE = Question(
    name="harmonic-point-force", title="Vibrating normal force on the finger pad",
    question="How does the whole fingertip vibrate under one normal force of 1 to 300 Hz?",
    harmonic=True, gate=0.05, max_forces=1,
    loads=(Input("load_node", "1", "one of the pad nodes", "mesh node that carries the normal force",
                 ("case", "force")),),
    amplitude=Input("force_amplitude", "N", "any [N], along the inward normal (sampled from 0.01 to 0.1 N; linear)",
                    "force amplitude along the inward normal", ("case", "force"), AMPLITUDE),
    points=(Input("frequency", "Hz", "1 to 300 Hz (published grid: every hertz)", "excitation frequency",
                  range=(FREQUENCY[0], FREQUENCY[-1])),
            Input("loss_factor", "1", "0.1 to 0.5 (published grid: steps of 0.05)",
                  "loss factor eta of K (1 + i eta)", range=(LOSS_FACTOR[0], LOSS_FACTOR[-1]))),
    needs={
        "stiffness": "K, real symmetric", "mass matrix": "M, real symmetric",
        "complex numbers": "the loss factor turns the response by a phase",
        "pad loads": "unit normals at the pad nodes"},
    leaves_out={
        "modes": "solved for only by the modal methods and by `mlp-residual`",
        "time stepping": "the steady state is asked for, not the transient",
        "torch": "loaded only by the methods `mlp`, `mlp-residual` and `pole-network`"},
    part="pad", part_words="pad surface", spatial=True)


def published_points(beyond: bool = False) -> np.ndarray:
    """(n_point, 2) ndarray: frequencies [Hz] and loss factors of the published grid, or of what lies beyond it."""
    def grid(frequency: np.ndarray, loss_factor: np.ndarray) -> np.ndarray:
        return np.stack(np.meshgrid(frequency, loss_factor, indexing="ij"), axis=-1).reshape(-1, 2)

    if not beyond:
        return grid(FREQUENCY, LOSS_FACTOR)
    return np.concatenate([grid(FREQUENCY_BEYOND, LOSS_FACTOR), grid(FREQUENCY, LOSS_FACTOR_BEYOND)])


class PublishedGrid(Population):
    """Every pad node at every hertz and loss factor of the publication."""

    regions = ("unseen node", "unseen frequency band", "301-400 Hz", "loss factor 0.05 or 0.6")

    def sample(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        points = published_points()
        most = len(points) * scene.n_loads
        if count > most:
            raise ValueError(f"{count} cases are more than the {most} of {scene.name}: ask for fewer")
        return at_points(scene, count, points, np.random.default_rng([seed, 3]), AMPLITUDE)

    def sample_beyond(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        rng = np.random.default_rng([seed, 4])
        half = max(1, -(-count // (2 * CASES_PER_POINT)))
        higher = np.column_stack([rng.choice(FREQUENCY_BEYOND, half), rng.choice(LOSS_FACTOR, half)])
        lossy = np.column_stack([rng.choice(FREQUENCY, half), rng.choice(LOSS_FACTOR_BEYOND, half)])
        return at_points(scene, count, np.concatenate([higher, lossy]), rng, AMPLITUDE)

    def count(self, scene: LinearScene) -> int:
        return scene.n_loads * len(FREQUENCY) * len(LOSS_FACTOR)

    def number(self, scene: LinearScene, cases: CaseArrays) -> np.ndarray:
        frequency = np.searchsorted(FREQUENCY, cases.frequency)
        loss_factor = np.searchsorted(LOSS_FACTOR - 1e-9, cases.loss_factor, side="right") - 1
        return (cases.node[:, 0] * len(FREQUENCY) + frequency) * len(LOSS_FACTOR) + loss_factor

    def hard_region(self, scene: LinearScene, cases: CaseArrays, seed: int) -> np.ndarray:
        frequency, loss_factor = cases.frequency, cases.loss_factor
        region = np.zeros(len(cases), dtype=int)
        region[np.any([(low <= frequency) & (frequency <= high) for low, high in HELD_OUT_BANDS], axis=0)] = 2
        region[np.isin(cases.node[:, 0], scene.held_out_loads(seed))] = 1
        region[frequency > FREQUENCY[-1]] = 3
        region[(loss_factor < LOSS_FACTOR[0] - 1e-9) | (loss_factor > LOSS_FACTOR[-1] + 1e-9)] = 4
        return region


def harmonic_point_force(fingertip: Fingertip, outputs: str = "field") -> LinearScene:
    """One normal point force at a pad node, 1-300 Hz, loss factor 0.1-0.5."""
    return fingertip_scene(HARMONIC_POINT_FORCE, fingertip, normal_forces(fingertip), PublishedGrid(), outputs)
