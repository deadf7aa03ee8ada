"""Which cases of a linear scene are drawn, and which of them the hard split holds out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rom.scenes.cases import CaseArrays

if TYPE_CHECKING:
    from rom.scenes.linear_scene import LinearScene

CASES_PER_POINT = 8
"""Cases that share one frequency and loss factor, so that one factorization makes eight snapshots."""
BEYOND = 4.0 / 3.0
"""How far beyond the sampled frequencies and loss factors extrapolation reaches, by default."""


class Population(ABC):
    """The cases of a linear scene."""

    regions: ClassVar[tuple[str, ...]]

    @abstractmethod
    def sample(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        """See `Scene.sample`."""

    @abstractmethod
    def sample_beyond(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        """See `Scene.sample_beyond`."""

    @abstractmethod
    def hard_region(self, scene: LinearScene, cases: CaseArrays, seed: int) -> np.ndarray:
        """See `Scene.hard_region`."""

    def count(self, scene: LinearScene) -> int | None:
        """See `Scene.n_published`."""
        return None

    def number(self, scene: LinearScene, cases: CaseArrays) -> np.ndarray:
        """See `Scene.published_number`."""
        raise NotImplementedError(f"the cases of {scene.name} are not counted")

    def held_out_loads(self, scene: LinearScene, seed: int, fraction: float = 0.1) -> np.ndarray:
        """Columns of the loads that the hard split keeps from training; none where there are fewer than three."""
        if scene.n_loads < 3:
            return np.empty(0, dtype=np.int64)
        rng = np.random.default_rng([seed, 239])
        return np.sort(rng.choice(scene.n_loads, size=max(1, round(fraction * scene.n_loads)), replace=False))


def at_points(scene: Any, count: int, points: np.ndarray, rng: np.random.Generator, amplitude: tuple[float, float]
              ) -> CaseArrays:
    """Single forces at operating points, several cases to each, every load equally often.

    Parameters
    ----------
    scene : LinearScene
    count : int
    points : (n, 2) ndarray
        Frequencies [Hz] and loss factors to choose from.
    rng : Generator
    amplitude : (float, float)
        Range of the forces [N].
    """
    used = min(len(points), -(-count // CASES_PER_POINT))
    points = points[rng.permutation(len(points))[:used]]
    per_point = -(-count // used)
    i = np.arange(count)
    # one shuffled list of loads, walked again and again: equally often each, never twice at one point
    node = rng.permutation(scene.n_loads)[i % scene.n_loads]
    point = points[i // per_point]
    force = rng.uniform(*amplitude, size=count)
    return CaseArrays(node[:, None], force[:, None], point[:, 0].copy(), point[:, 1].copy())


class RangePopulation(Population):
    """Forces drawn uniformly from the ranges of the inputs: what serves any body."""

    regions = ("unseen load", "unseen frequency band", "beyond the ranges")

    def sample(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        rng = np.random.default_rng([seed, 7])
        if scene.harmonic:
            points = np.column_stack([rng.uniform(*scene.input(name).range, count)  # type: ignore[misc]
                                      for name in ("frequency", "loss_factor")])
            return at_points(scene, count, points, rng, self._amplitude(scene))
        return self._static(scene, count, scene.max_forces, rng)

    def sample_beyond(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        rng = np.random.default_rng([seed, 8])
        if not scene.harmonic:
            return self._static(scene, count, scene.max_forces + 1, rng)
        points = np.column_stack([rng.uniform(*scene.input(name).range, count)  # type: ignore[misc]
                                  for name in ("frequency", "loss_factor")])
        top = scene.band_hz
        points[:, 0] = rng.uniform(top * (1 + 1e-6), BEYOND * top, count)
        return at_points(scene, count, points, rng, self._amplitude(scene))

    def _static(self, scene: LinearScene, count: int, most: int, rng: np.random.Generator) -> CaseArrays:
        node = np.stack([rng.permutation(scene.n_loads)[:most] for _ in range(count)]) if scene.n_loads >= most \
            else rng.integers(scene.n_loads, size=(count, most))
        return CaseArrays(node, rng.uniform(*self._amplitude(scene), size=node.shape))

    @staticmethod
    def _amplitude(scene: LinearScene) -> tuple[float, float]:
        return scene.input("force_amplitude").range or (0.1, 1.0)

    def hard_region(self, scene: LinearScene, cases: CaseArrays, seed: int) -> np.ndarray:
        acting = cases.force != 0.0
        region = np.where((np.isin(cases.node, scene.held_out_loads(seed)) & acting).any(axis=1), 1, 0)
        if not scene.harmonic:
            return np.where(acting.sum(axis=1) > scene.max_forces, 3, region)
        low, high = scene.input("frequency").range  # type: ignore[misc]
        middle = np.random.default_rng([seed, 9]).uniform(low + 0.2 * (high - low), low + 0.8 * (high - low))
        band = np.abs(cases.frequency - middle) < 0.03 * (high - low)
        region = np.where((region == 0) & band, 2, region)
        eta = scene.input("loss_factor").range
        outside = (cases.frequency > high) | (cases.frequency < low) | (
            cases.loss_factor > eta[1] + 1e-9) | (cases.loss_factor < eta[0] - 1e-9)  # type: ignore[index]
        return np.where(outside, 3, region)
