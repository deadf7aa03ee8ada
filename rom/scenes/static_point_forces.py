"""Static scene of the published metamodel: one to three normal forces on the pad, K u = f (paper eq. 1)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from rom.scenes.cases import CaseArrays
from rom.scenes.combinations import combination_number, count_combinations
from rom.scenes.scene import Scene

AMPLITUDE = (0.1, 1.0)
"""Sampled force amplitudes [N]; the model is linear, so any other amplitude scales exactly."""


class StaticPointForces(Scene):
    """One to three normal point forces of any amplitude at the pad nodes."""

    name: ClassVar[str] = "static-point-forces"
    title: ClassVar[str] = "Static normal forces on the finger pad"
    question: ClassVar[str] = "How does the whole fingertip deform under one to three steady normal forces?"
    gate: ClassVar[float] = 0.01
    harmonic: ClassVar[bool] = False
    max_forces: ClassVar[int] = 3
    inputs: ClassVar[dict[str, str]] = {
        "load_node": "one to three of the pad nodes",
        "force_amplitude": "any [N], along the inward normal (sampled from 0.1 to 1 N; linear)"}
    needs: ClassVar[dict[str, str]] = {"stiffness": "K, real symmetric", "pad loads": "unit normals at the pad nodes"}
    leaves_out: ClassVar[dict[str, str]] = {
        "mass matrix": "nothing moves: M never enters K u = f",
        "modes": "no frequency is asked for, so no eigenproblem is solved",
        "complex numbers": "no damping without motion: everything is real",
        "torch": "loaded only by the method `transformer`"}
    regions: ClassVar[tuple[str, ...]] = ("unseen node", "four or five forces")

    def sample(self, count: int, seed: int = 0) -> CaseArrays:
        # half of the distinct single nodes and pairs at most, so that a draw never starves
        singles = min(count // 6, self.n_pad // 2)
        pairs = min(count // 3, self.n_pad * (self.n_pad - 1) // 4)
        numbers = np.repeat([1, 2, 3], [singles, pairs, count - singles - pairs])
        return self._draw(numbers, np.random.default_rng([seed, 1]))

    def sample_beyond(self, count: int, seed: int = 0) -> CaseArrays:
        return self._draw(np.repeat([4, 5], [count // 2, count - count // 2]), np.random.default_rng([seed, 2]))

    def _draw(self, numbers: np.ndarray, rng: np.random.Generator) -> CaseArrays:
        count = len(numbers)
        width = int(numbers.max())
        forces = rng.permutation(numbers)
        node = np.zeros((count, width), dtype=np.int64)
        force = np.zeros((count, width))
        seen: set[tuple[int, ...]] = set()
        queue: list[int] = []
        for i, k in enumerate(forces):
            for attempt in range(1000):
                # walking through shuffled pads loads every node equally often
                while len(queue) < k:
                    queue.extend(rng.permutation(self.n_pad).tolist())
                chosen = tuple(sorted(queue[:k]))
                if len(set(chosen)) == k and chosen not in seen:
                    del queue[:k]
                    break
                rng.shuffle(queue)
                if attempt % 20 == 19:
                    queue.extend(rng.permutation(self.n_pad).tolist())
            else:
                raise ValueError(f"{count} cases are more than {self.name} has distinct combinations of: ask for fewer")
            seen.add(chosen)
            node[i, :k] = chosen
            force[i, :k] = rng.uniform(*AMPLITUDE, size=k)
        return CaseArrays(node, force)

    @property
    def n_published(self) -> int:
        return count_combinations(self.n_pad, self.max_forces)

    def published_number(self, arrays: CaseArrays) -> np.ndarray:
        nodes = np.where(arrays.force != 0.0, arrays.node, -1)
        nodes = np.sort(np.where(nodes < 0, self.n_pad, nodes), axis=1)[:, :self.max_forces]
        return combination_number(np.where(nodes < self.n_pad, nodes, -1), self.n_pad)

    def hard_region(self, arrays: CaseArrays, seed: int = 0) -> np.ndarray:
        held = np.isin(arrays.node, self.held_out_nodes(seed)) & (arrays.force != 0.0)
        many = (arrays.force != 0.0).sum(axis=1) > self.max_forces
        return np.where(many, 2, np.where(held.any(axis=1), 1, 0))
