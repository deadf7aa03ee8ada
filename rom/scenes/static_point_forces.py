"""Static scene of the published metamodel: one to three normal forces on the pad, K u = f (paper eq. 1)."""

from __future__ import annotations

import numpy as np

from rom.fingertip import Fingertip
from rom.scenes.cases import CaseArrays
from rom.scenes.combinations import combination_number, count_combinations
from rom.scenes.fingertip_scene import fingertip_scene, normal_forces
from rom.scenes.inputs import Input
from rom.scenes.linear_scene import LinearScene
from rom.scenes.population import Population
from rom.scenes.question import Question

AMPLITUDE = (0.1, 1.0)
"""Sampled force amplitudes [N]; the model is linear, so any other amplitude scales exactly."""

STATIC_POINT_FORCES = Question(
    name="static-point-forces", title="Static normal forces on the finger pad",
    question="How does the whole fingertip deform under one to three steady normal forces?",
    harmonic=False, gate=0.01, max_forces=3,
    loads=(Input("load_node", "1", "one to three of the pad nodes", "mesh node that carries the normal force",
                 ("case", "force")),),
    amplitude=Input("force_amplitude", "N", "any [N], along the inward normal (sampled from 0.1 to 1 N; linear)",
                    "force amplitude along the inward normal", ("case", "force"), AMPLITUDE),
    needs={"stiffness": "K, real symmetric", "pad loads": "unit normals at the pad nodes"},
    leaves_out={
        "mass matrix": "nothing moves: M never enters K u = f",
        "modes": "no frequency is asked for, so no eigenproblem is solved",
        "complex numbers": "no damping without motion: everything is real",
        "torch": "loaded only by the method `transformer`"},
    part="pad", part_words="pad surface", spatial=True)


class PadCombinations(Population):
    """Combinations of one to three pad nodes, every node equally often."""

    regions = ("unseen node", "four or five forces")

    def sample(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        # half of the distinct single nodes and pairs at most, so that a draw never starves
        singles = min(count // 6, scene.n_loads // 2)
        pairs = min(count // 3, scene.n_loads * (scene.n_loads - 1) // 4)
        numbers = np.repeat([1, 2, 3], [singles, pairs, count - singles - pairs])
        return self._draw(scene, numbers, np.random.default_rng([seed, 1]))

    def sample_beyond(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        return self._draw(scene, np.repeat([4, 5], [count // 2, count - count // 2]), np.random.default_rng([seed, 2]))

    def _draw(self, scene: LinearScene, numbers: np.ndarray, rng: np.random.Generator) -> CaseArrays:
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
                    queue.extend(rng.permutation(scene.n_loads).tolist())
                chosen = tuple(sorted(queue[:k]))
                if len(set(chosen)) == k and chosen not in seen:
                    del queue[:k]
                    break
                rng.shuffle(queue)
                if attempt % 20 == 19:
                    queue.extend(rng.permutation(scene.n_loads).tolist())
            else:
                raise ValueError(f"{count} cases are more than {scene.name} has distinct combinations of: ask for "
                                 "fewer")
            seen.add(chosen)
            node[i, :k] = chosen
            force[i, :k] = rng.uniform(*AMPLITUDE, size=k)
        return CaseArrays(node, force)

    def count(self, scene: LinearScene) -> int:
        return count_combinations(scene.n_loads, scene.max_forces)

    def number(self, scene: LinearScene, cases: CaseArrays) -> np.ndarray:
        nodes = np.where(cases.force != 0.0, cases.node, -1)
        nodes = np.sort(np.where(nodes < 0, scene.n_loads, nodes), axis=1)[:, :scene.max_forces]
        return combination_number(np.where(nodes < scene.n_loads, nodes, -1), scene.n_loads)

    def hard_region(self, scene: LinearScene, cases: CaseArrays, seed: int) -> np.ndarray:
        held = np.isin(cases.node, scene.held_out_loads(seed)) & (cases.force != 0.0)
        many = (cases.force != 0.0).sum(axis=1) > scene.max_forces
        return np.where(many, 2, np.where(held.any(axis=1), 1, 0))


def static_point_forces(fingertip: Fingertip, outputs: str = "field") -> LinearScene:
    """One to three normal point forces of any amplitude at the pad nodes."""
    return fingertip_scene(STATIC_POINT_FORCES, fingertip, normal_forces(fingertip), PadCombinations(), outputs)
