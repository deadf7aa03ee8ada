"""Harmonic scene of the published metamodel: one normal force, (K (1 + i eta) - omega^2 M) u = f (paper eq. 2-4)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from rom.scenes.cases import CaseArrays
from rom.scenes.scene import Scene

FREQUENCY = np.arange(1.0, 301.0)
LOSS_FACTOR = np.round(np.arange(0.10, 0.501, 0.05), 2)
FREQUENCY_BEYOND = np.arange(301.0, 401.0)
LOSS_FACTOR_BEYOND = np.array([0.05, 0.60])
HELD_OUT_BANDS = ((112.0, 126.0), (206.0, 220.0))
"""Frequencies [Hz] that the hard split keeps from training: about the first mode and about the normal-force peak."""
AMPLITUDE = (0.01, 0.1)
"""Sampled force amplitudes [N]; the model is linear, so any other amplitude scales exactly."""
LOADS_PER_POINT = 8
"""Cases that share one (frequency, loss factor), so that one factorization makes eight snapshots."""


class HarmonicPointForce(Scene):
    """One normal point force at a pad node, 1-300 Hz, loss factor 0.1-0.5."""

    name: ClassVar[str] = "harmonic-point-force"
    title: ClassVar[str] = "Vibrating normal force on the finger pad"
    question: ClassVar[str] = "How does the whole fingertip vibrate under one normal force of 1 to 300 Hz?"
    gate: ClassVar[float] = 0.05
    harmonic: ClassVar[bool] = True
    band_hz: ClassVar[float] = 300.0
    max_forces: ClassVar[int] = 1
    inputs: ClassVar[dict[str, str]] = {
        "load_node": "one of the pad nodes",
        "force_amplitude": "any [N], along the inward normal (sampled from 0.01 to 0.1 N; linear)",
        "frequency": "1 to 300 Hz (published grid: every hertz)",
        "loss_factor": "0.1 to 0.5 (published grid: steps of 0.05)"}
    needs: ClassVar[dict[str, str]] = {
        "stiffness": "K, real symmetric", "mass matrix": "M, real symmetric",
        "complex numbers": "the loss factor turns the response by a phase",
        "pad loads": "unit normals at the pad nodes"}
    leaves_out: ClassVar[dict[str, str]] = {
        "modes": "solved for only by the modal methods and by `mlp-residual`",
        "time stepping": "the steady state is asked for, not the transient",
        "torch": "loaded only by the methods `mlp`, `mlp-residual` and `pole-network`"}
    regions: ClassVar[tuple[str, ...]] = (
        "unseen node", "unseen frequency band", "301-400 Hz", "loss factor 0.05 or 0.6")

    def sample(self, count: int, seed: int = 0) -> CaseArrays:
        points = np.stack(np.meshgrid(FREQUENCY, LOSS_FACTOR, indexing="ij"), axis=-1).reshape(-1, 2)
        most = len(points) * self.n_pad
        if count > most:
            raise ValueError(f"{count} cases are more than the {most} of {self.name}: ask for fewer")
        return self._draw(count, points, np.random.default_rng([seed, 3]))

    def sample_beyond(self, count: int, seed: int = 0) -> CaseArrays:
        rng = np.random.default_rng([seed, 4])
        half = max(1, -(-count // (2 * LOADS_PER_POINT)))
        higher = np.column_stack([rng.choice(FREQUENCY_BEYOND, half), rng.choice(LOSS_FACTOR, half)])
        lossy = np.column_stack([rng.choice(FREQUENCY, half), rng.choice(LOSS_FACTOR_BEYOND, half)])
        return self._draw(count, np.concatenate([higher, lossy]), rng)

    def _draw(self, count: int, points: np.ndarray, rng: np.random.Generator) -> CaseArrays:
        used = min(len(points), -(-count // LOADS_PER_POINT))
        points = points[rng.permutation(len(points))[:used]]
        per_point = -(-count // used)
        i = np.arange(count)
        # one shuffled pad, walked again and again: equally often each node, never twice at one point
        node = rng.permutation(self.n_pad)[i % self.n_pad]
        point = points[i // per_point]
        force = rng.uniform(*AMPLITUDE, size=count)
        return CaseArrays(node[:, None], force[:, None], point[:, 0].copy(), point[:, 1].copy())

    @property
    def n_published(self) -> int:
        return self.n_pad * len(FREQUENCY) * len(LOSS_FACTOR)

    def published_number(self, arrays: CaseArrays) -> np.ndarray:
        frequency = np.searchsorted(FREQUENCY, arrays.frequency)
        loss_factor = np.searchsorted(LOSS_FACTOR - 1e-9, arrays.loss_factor, side="right") - 1
        return (arrays.node[:, 0] * len(FREQUENCY) + frequency) * len(LOSS_FACTOR) + loss_factor

    def hard_region(self, arrays: CaseArrays, seed: int = 0) -> np.ndarray:
        frequency, loss_factor = arrays.frequency, arrays.loss_factor
        region = np.zeros(len(arrays), dtype=int)
        region[np.any([(low <= frequency) & (frequency <= high) for low, high in HELD_OUT_BANDS], axis=0)] = 2
        region[np.isin(arrays.node[:, 0], self.held_out_nodes(seed))] = 1
        region[frequency > FREQUENCY[-1]] = 3
        region[(loss_factor < LOSS_FACTOR[0] - 1e-9) | (loss_factor > LOSS_FACTOR[-1] + 1e-9)] = 4
        return region
