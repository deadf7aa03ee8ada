"""Harmonic scene of the published forced-vibration study: forces on patches of skin, in any direction, with phases.

Each force acts on the nine nodes of a patch (Serhat and Kuchenbecker 2021, section 5) in one of three directions. Its
amplitude a and phase phi enter as the phasor a exp(i phi), f(t) = a cos(2 pi frequency t + phi), so that simultaneous
forces of one frequency add as complex numbers.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from rom.checks import shown
from rom.fingertip import DIRECTIONS
from rom.scenes.cases import NO_FORCE, CaseArrays, finite, positions_of
from rom.scenes.scene import Scene

FREQUENCY = np.arange(1.0, 261.0)
FREQUENCY_BEYOND = np.arange(261.0, 341.0)
LOSS_FACTOR = 0.1
LOSS_FACTOR_BEYOND = np.array([0.05, 0.20])
HELD_OUT_BANDS = ((112.0, 126.0), (206.0, 220.0))
"""Frequencies [Hz] that the hard split keeps from training, as in the scene of one normal force."""
AMPLITUDE = (0.01, 0.1)
"""Sampled force amplitudes [N]; the model is linear, so any other amplitude scales exactly."""
CASES_PER_POINT = 8
"""Cases that share one frequency and loss factor, so that one factorization makes eight snapshots."""
NO_DIRECTION = "none"
"""Stands in ``direction`` where a case has fewer forces than the dataset has room for."""


@dataclass(frozen=True)
class HarmonicPatchForces(Scene):
    """Simultaneous harmonic forces on nine-node patches of skin, 1-260 Hz, loss factor 0.1.

    Parameters
    ----------
    fingertip, outputs
        See `Scene`.
    sites : tuple of int
        Pad nodes at the patches' centres; empty for the fingerprint centroid alone. Three unit loads a site, in the
        order of `rom.fingertip.DIRECTIONS`.

    Raises
    ------
    ValueError
        For sites that are no distinct whole numbers; for nodes off the pad once the mesh is there.
    """

    sites: tuple[int, ...] = ()

    name: ClassVar[str] = "harmonic-patch-forces"
    title: ClassVar[str] = "Vibrating forces on patches of the finger pad"
    question: ClassVar[str] = ("How does the whole fingertip vibrate under forces of one frequency, pushing or "
                               "shearing, each with its own phase?")
    gate: ClassVar[float] = 0.01
    harmonic: ClassVar[bool] = True
    band_hz: ClassVar[float] = 260.0
    max_forces: ClassVar[int] = 3
    load_variables: ClassVar[tuple[str, ...]] = ("load_node", "direction", "force_amplitude", "force_phase")
    defaults: ClassVar[dict[str, Any]] = {"force_phase": 0.0, "loss_factor": LOSS_FACTOR}
    inputs: ClassVar[dict[str, str]] = {
        "load_node": "centre of a patch: one of the scene's sites (default: the fingerprint centroid)",
        "direction": f"{', '.join(DIRECTIONS)}, or their codes 0, 1, 2",
        "force_amplitude": "any [N], shared by the patch's nine nodes (sampled from 0.01 to 0.1 N; linear)",
        "force_phase": "any [rad], f(t) = a cos(2 pi frequency t + phase) (default 0)",
        "frequency": "1 to 260 Hz (published grid: every hertz)",
        "loss_factor": "0.1 (default, as published); others are extrapolation"}
    needs: ClassVar[dict[str, str]] = {
        "stiffness": "K, real symmetric", "mass matrix": "M, real symmetric",
        "complex numbers": "loss factor and force phases turn the response",
        "patch loads": "three unit forces on each patch"}
    leaves_out: ClassVar[dict[str, str]] = {
        "modes": "solved for only by the modal methods",
        "time stepping": "the steady state is asked for, not the transient",
        "torch": "no method of this scene is a network"}
    regions: ClassVar[tuple[str, ...]] = ("unseen frequency band", "261-340 Hz", "loss factor 0.05 or 0.2")

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            sites = np.asarray(self.sites)
        except ValueError:  # rows of different lengths
            sites = np.empty((0, 0))
        if sites.ndim != 1 or (sites.size and sites.dtype.kind not in "iu") or len(np.unique(sites)) != len(sites):
            raise ValueError(f"sites={shown(self.sites)} are no patches: give distinct ids of pad nodes")
        object.__setattr__(self, "sites", tuple(int(site) for site in sites))

    @cached_property
    def site_nodes(self) -> np.ndarray:
        """(n_site,) ndarray of int: mesh nodes at the patches' centres.

        Raises
        ------
        ValueError
            For a site that is not on the pad.
        """
        mesh = self.fingertip.mesh
        nodes = np.array(self.sites or (mesh.fingerprint_centroid,), dtype=np.int64)
        off = np.setdiff1d(nodes, mesh.pad_nodes)
        if off.size:
            raise ValueError(f"site {off[0]} is not on the pad: choose among the {self.n_pad} nodes of "
                             "fingertip.mesh.pad_nodes")
        return nodes

    @cached_property
    def unit_loads(self) -> np.ndarray:
        """(n_free, 3 n_site) ndarray [-]: unit force on each patch in each direction, directions fastest."""
        return np.stack([self.fingertip.patch_force(int(node), direction)
                         for node in self.site_nodes for direction in DIRECTIONS], axis=1)

    @property
    def n_loads(self) -> int:
        return len(DIRECTIONS) * max(1, len(self.sites))

    def load_index(self, direction: str, node: int | None = None) -> int:
        """Column of the unit loads: what ``CaseArrays.node`` holds.

        Parameters
        ----------
        direction : str
            One of `rom.fingertip.DIRECTIONS`.
        node : int, optional
            A site; default: the first.

        Raises
        ------
        ValueError
            For an unknown direction, or a node that is no site.
        """
        code = _direction_codes(np.array([direction]))[0]
        row = 0 if node is None else int(self._site_index(np.array([node]))[0])
        return len(DIRECTIONS) * row + int(code)

    # ---- labels ---------------------------------------------------------------------------------------------

    def _site_index(self, nodes: np.ndarray) -> np.ndarray:
        known = ", ".join(map(str, self.site_nodes[:8])) + (" ..." if len(self.site_nodes) > 8 else "")
        return positions_of(nodes, self.site_nodes, f"is no site of this scene, which are {known}: name the patches' "
                                                    "centres when the scene is made, sites=(...)")

    def _read_loads(self, loads: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        amplitude = finite(loads["force_amplitude"], "force_amplitude", "N")
        phase = finite(loads["force_phase"], "force_phase", "rad")
        site = self._site_index(loads["load_node"])
        present = site != NO_FORCE
        code = np.zeros(site.shape, dtype=np.int64)
        code[present] = _direction_codes(loads["direction"][present])
        return amplitude * np.exp(1j * phase), np.where(present, len(DIRECTIONS) * site + code, NO_FORCE)

    def _label_loads(self, arrays: CaseArrays) -> dict[str, Any]:
        site, code = np.divmod(arrays.node, len(DIRECTIONS))
        present = arrays.force != 0.0
        dims = ("case", "force")
        return {
            "load_node": (dims, np.where(present, self.site_nodes[site], NO_FORCE).astype(np.int32), {
                "long_name": "mesh node at the centre of the loaded patch", "units": "1", "missing_force": NO_FORCE}),
            "direction": (dims, np.where(present, np.array(DIRECTIONS)[code], NO_DIRECTION), {
                "long_name": "direction of the force in the skin's frame at the patch's centre"}),
            "force_amplitude": (dims, np.abs(arrays.force), {
                "long_name": "force amplitude, summed over the patch", "units": "N"}),
            "force_phase": (dims, np.angle(arrays.force), {
                "long_name": "phase of the force, f(t) = a cos(2 pi frequency t + phase)", "units": "rad"}),
        }

    # ---- identity -------------------------------------------------------------------------------------------

    @property
    def content_hash(self) -> str:
        definition = json.dumps([self.fingertip.content_hash, self.site_nodes.tolist()])
        return hashlib.sha256(definition.encode()).hexdigest()

    @property
    def options(self) -> dict[str, Any]:
        return {"sites": self.site_nodes.tolist()}

    # ---- sampling -------------------------------------------------------------------------------------------

    def sample(self, count: int, seed: int = 0) -> CaseArrays:
        points = np.column_stack([FREQUENCY, np.full(len(FREQUENCY), LOSS_FACTOR)])
        return self._draw(count, points, np.random.default_rng([seed, 5]))

    def sample_beyond(self, count: int, seed: int = 0) -> CaseArrays:
        rng = np.random.default_rng([seed, 6])
        half = max(1, -(-count // (2 * CASES_PER_POINT)))
        higher = np.column_stack([rng.choice(FREQUENCY_BEYOND, half), np.full(half, LOSS_FACTOR)])
        lossy = np.column_stack([rng.choice(FREQUENCY, half), rng.choice(LOSS_FACTOR_BEYOND, half)])
        return self._draw(count, np.concatenate([higher, lossy]), rng)

    def _draw(self, count: int, points: np.ndarray, rng: np.random.Generator) -> CaseArrays:
        """At each point first single forces, each load at most once, then two and three with phases of their own."""
        used = min(len(points), -(-count // CASES_PER_POINT))
        points = points[rng.permutation(len(points))[:used]]
        point, turn = np.divmod(np.arange(count), -(-count // used))
        most = min(self.max_forces, self.n_loads)
        singles = min(self.n_loads, -(-CASES_PER_POINT // 3))
        number = np.where(turn < singles, 1, 2 + (turn - singles) % max(most - 1, 1))
        node = np.zeros((count, most), dtype=np.int64)
        force = np.zeros((count, most), dtype=complex)
        order = [rng.permutation(self.n_loads) for _ in range(used)]
        for k in range(count):
            chosen = order[point[k]][[turn[k]]] if number[k] == 1 else rng.permutation(self.n_loads)[:number[k]]
            node[k, :number[k]] = chosen
            force[k, :number[k]] = (rng.uniform(*AMPLITUDE, number[k])
                                    * np.exp(1j * rng.uniform(-np.pi, np.pi, number[k])))
        return CaseArrays(node, force, points[point, 0].copy(), points[point, 1].copy())

    def hard_region(self, arrays: CaseArrays, seed: int = 0) -> np.ndarray:
        frequency = arrays.frequency
        region = np.zeros(len(arrays), dtype=int)
        region[np.any([(low <= frequency) & (frequency <= high) for low, high in HELD_OUT_BANDS], axis=0)] = 1
        region[frequency > FREQUENCY[-1]] = 2
        region[np.abs(arrays.loss_factor - LOSS_FACTOR) > 1e-9] = 3
        return region


def _direction_codes(values: np.ndarray) -> np.ndarray:
    """(n,) ndarray of int from names or codes of `rom.fingertip.DIRECTIONS`."""
    codes = np.full(values.shape, -1, dtype=np.int64)
    for code, name in enumerate(DIRECTIONS):
        codes[(values == name) if values.dtype.kind in "OUS" else (values == code)] = code
    if (codes < 0).any():
        wrong = values[codes < 0][0]
        raise ValueError(f"{str(wrong)!r} is no direction: choose {', '.join(DIRECTIONS)}, or their codes 0, 1, 2")
    return codes
