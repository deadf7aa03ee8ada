"""Harmonic scene of the published forced-vibration study: forces on patches of skin, in any direction, with phases.

Each force acts on the nine nodes of a patch (Serhat and Kuchenbecker 2021, section 5) in one of three directions. Its
amplitude a and phase phi enter as the phasor a exp(i phi), f(t) = a cos(2 pi frequency t + phi), so that simultaneous
forces of one frequency add as complex numbers.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence

import numpy as np

from rom.bodies import Loads
from rom.checks import shown
from rom.fingertip import DIRECTIONS, Fingertip
from rom.scenes.cases import CaseArrays
from rom.scenes.fingertip_scene import fingertip_scene
from rom.scenes.harmonic_point_force import HELD_OUT_BANDS
from rom.scenes.inputs import Input
from rom.scenes.linear_scene import LinearScene
from rom.scenes.population import CASES_PER_POINT, Population
from rom.scenes.question import Question

FREQUENCY = np.arange(1.0, 261.0)
FREQUENCY_BEYOND = np.arange(261.0, 341.0)
LOSS_FACTOR = 0.1
LOSS_FACTOR_BEYOND = np.array([0.05, 0.20])
AMPLITUDE = (0.01, 0.1)
"""Sampled force amplitudes [N]; the model is linear, so any other amplitude scales exactly."""

HARMONIC_PATCH_FORCES = Question(
    name="harmonic-patch-forces", title="Vibrating forces on patches of the finger pad",
    question="How does the whole fingertip vibrate under forces of one frequency, pushing or shearing, each with its "
             "own phase?",
    harmonic=True, gate=0.01, max_forces=3, phases=True,
    loads=(Input("load_node", "1", "centre of a patch: one of the scene's sites (default: the fingerprint centroid)",
                 "mesh node at the centre of the loaded patch", ("case", "force")),
           Input("direction", "", f"{', '.join(DIRECTIONS)}, or their codes 0, 1, 2",
                 "direction of the force in the skin's frame at the patch's centre", ("case", "force"),
                 choices=DIRECTIONS)),
    amplitude=Input("force_amplitude", "N",
                    "any [N], shared by the patch's nine nodes (sampled from 0.01 to 0.1 N; linear)",
                    "force amplitude, summed over the patch", ("case", "force"), AMPLITUDE),
    points=(Input("frequency", "Hz", "1 to 260 Hz (published grid: every hertz)", "excitation frequency",
                  range=(FREQUENCY[0], FREQUENCY[-1])),
            Input("loss_factor", "1", "0.1 (default, as published); others are extrapolation",
                  "loss factor eta of K (1 + i eta)", range=(LOSS_FACTOR, LOSS_FACTOR), default=LOSS_FACTOR)),
    needs={
        "stiffness": "K, real symmetric", "mass matrix": "M, real symmetric",
        "complex numbers": "loss factor and force phases turn the response",
        "patch loads": "three unit forces on each patch"},
    leaves_out={
        "modes": "solved for only by the modal methods",
        "time stepping": "the steady state is asked for, not the transient",
        "torch": "no method of this scene is a network"},
    part="pad", part_words="pad surface")


class PatchForces(Population):
    """At each point first single forces, each load at most once, then two and three with phases of their own."""

    regions = ("unseen frequency band", "261-340 Hz", "loss factor 0.05 or 0.2")

    def sample(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        points = np.column_stack([FREQUENCY, np.full(len(FREQUENCY), LOSS_FACTOR)])
        return self._draw(scene, count, points, np.random.default_rng([seed, 5]))

    def sample_beyond(self, scene: LinearScene, count: int, seed: int) -> CaseArrays:
        rng = np.random.default_rng([seed, 6])
        half = max(1, -(-count // (2 * CASES_PER_POINT)))
        higher = np.column_stack([rng.choice(FREQUENCY_BEYOND, half), np.full(half, LOSS_FACTOR)])
        lossy = np.column_stack([rng.choice(FREQUENCY, half), rng.choice(LOSS_FACTOR_BEYOND, half)])
        return self._draw(scene, count, np.concatenate([higher, lossy]), rng)

    def _draw(self, scene: LinearScene, count: int, points: np.ndarray, rng: np.random.Generator) -> CaseArrays:
        n_loads = scene.n_loads
        used = min(len(points), -(-count // CASES_PER_POINT))
        points = points[rng.permutation(len(points))[:used]]
        point, turn = np.divmod(np.arange(count), -(-count // used))
        most = min(scene.max_forces, n_loads)
        singles = min(n_loads, -(-CASES_PER_POINT // 3))
        number = np.where(turn < singles, 1, 2 + (turn - singles) % max(most - 1, 1))
        node = np.zeros((count, most), dtype=np.int64)
        force = np.zeros((count, most), dtype=complex)
        order = [rng.permutation(n_loads) for _ in range(used)]
        for k in range(count):
            chosen = order[point[k]][[turn[k]]] if number[k] == 1 else rng.permutation(n_loads)[:number[k]]
            node[k, :number[k]] = chosen
            force[k, :number[k]] = (rng.uniform(*AMPLITUDE, number[k])
                                    * np.exp(1j * rng.uniform(-np.pi, np.pi, number[k])))
        return CaseArrays(node, force, points[point, 0].copy(), points[point, 1].copy())

    def hard_region(self, scene: LinearScene, cases: CaseArrays, seed: int) -> np.ndarray:
        frequency = cases.frequency
        region = np.zeros(len(cases), dtype=int)
        region[np.any([(low <= frequency) & (frequency <= high) for low, high in HELD_OUT_BANDS], axis=0)] = 1
        region[frequency > FREQUENCY[-1]] = 2
        region[np.abs(cases.loss_factor - LOSS_FACTOR) > 1e-9] = 3
        return region


def site_nodes(scene: LinearScene) -> np.ndarray:
    """(n_site,) ndarray of int: mesh nodes at the patches' centres; the loads are theirs, three a site."""
    return scene.loads.labels["load_node"][::len(DIRECTIONS)]


def harmonic_patch_forces(fingertip: Fingertip, outputs: str = "field", sites: Sequence[int] = ()) -> LinearScene:
    """Simultaneous harmonic forces on nine-node patches of skin, 1-260 Hz, loss factor 0.1.

    Parameters
    ----------
    fingertip : Fingertip
    outputs : {"field", "pad"}
    sites : sequence of int
        Pad nodes at the patches' centres; empty for the fingerprint centroid alone. Three unit loads a site, in the
        order of `rom.fingertip.DIRECTIONS`.

    Raises
    ------
    ValueError
        For sites that are no distinct whole numbers; for nodes off the pad once the mesh is there.
    """
    try:
        chosen = np.asarray(sites)
    except ValueError:  # rows of different lengths
        chosen = np.empty((0, 0))
    if chosen.ndim != 1 or (chosen.size and chosen.dtype.kind not in "iu") or len(np.unique(chosen)) != len(chosen):
        raise ValueError(f"sites={shown(sites)} are no patches: give distinct ids of pad nodes")

    def nodes() -> np.ndarray:
        mesh = fingertip.mesh
        found = chosen.astype(np.int64) if chosen.size else np.array([mesh.fingerprint_centroid])
        off = np.setdiff1d(found, mesh.pad_nodes)
        if off.size:
            raise ValueError(f"site {off[0]} is not on the pad: choose among the {len(mesh.pad_nodes)} nodes of "
                             "fingertip.mesh.pad_nodes")
        return found

    def loads() -> Loads:
        found = nodes()
        columns = np.stack([fingertip.patch_force(int(node), direction)
                            for node in found for direction in DIRECTIONS], axis=1)
        return Loads(columns, {"load_node": np.repeat(found, len(DIRECTIONS)),
                               "direction": np.tile(np.array(DIRECTIONS), len(found))},
                     np.repeat(fingertip.mesh.nodes[found], len(DIRECTIONS), axis=0))

    def identity() -> str:
        definition = json.dumps([fingertip.content_hash, nodes().tolist()])
        return hashlib.sha256(definition.encode()).hexdigest()

    return fingertip_scene(HARMONIC_PATCH_FORCES, fingertip, loads, PatchForces(), outputs, identity=identity,
                           options=lambda: {"sites": nodes().tolist()})
