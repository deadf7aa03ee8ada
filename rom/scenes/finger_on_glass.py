"""The nonlinear scene: a finger with collagen fibres is pressed on a glass plate, then the plate slides.

A case is a whole load path. Its inputs say of what the finger is made and how hard it is pressed; the positions along
it are the scene's own and the same for every path, so that the answers of all paths stand in one array. The finger is
no linear system: this scene shares the words of the linear ones, not their class.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr

from rom.checks import shown
from rom.finger_on_glass.section import Section, SectionMesh, mesh_section
from rom.finger_on_glass.tissue import PUBLISHED_K1, VARIANTS
from rom.scenes.paths import PathArrays, label_paths, read_paths

if TYPE_CHECKING:
    from rom.finger_on_glass.finger import Finger
    from rom.finger_on_glass.path import LoadPath

FORCE_SHARES = tuple(i / 8 for i in range(1, 9))
"""Of the normal force, at the positions before the plate slides."""
TRAVEL = tuple(0.25e-3 * i for i in range(1, 25))
"""Of the plate, at the positions after [m]."""
RANGES = {"c": (2000.0, 4500.0), "k1": (0.5, 2.0), "friction": (0.5, 1.2), "normal_force": (0.2, 0.8)}
"""Sampled ranges; that of ``k1`` in multiples of the variant's published value, on a logarithmic scale."""
BEYOND = {"c": ((1500.0, 2000.0), (4500.0, 6000.0)), "k1": ((0.25, 0.5), (2.0, 4.0)),
          "friction": ((0.35, 0.5), (1.2, 1.5)), "normal_force": ((0.12, 0.2), (0.8, 1.2))}
"""Ranges below and above, for the extrapolation part of the hard split."""
HEAVY, SOFT, SLIPPERY = 0.65, 3000.0, 0.57
"""Normal force from which [N] on tissue up to which c [Pa], and friction up to which the hard split holds paths out."""
OUTPUTS = ("field", "contact")
PASCAL = 1e6
"""In a MPa, which the full-order model computes in."""


@dataclass(frozen=True)
class FingerOnGlass:
    """A finger is pressed on glass and slides.

    Parameters
    ----------
    section : Section
        Dimensions [mm]; an assumption, since the publication's figure does not give them. A dict of them will do.
    rays, layers : int
        Elements around the bone and from bone to skin.
    out_of_plane_stiffness : float [N]
    effective_length : float [mm]
        See :class:`rom.finger_on_glass.finger.OutOfPlane`.
    seed : int
        Of the random variant's fibre angles: one finger, not an average.
    outputs : {"field", "contact"}
        What the lean calls give: everything, or the contact quantities alone.

    Raises
    ------
    ValueError
    """

    section: Section = field(default_factory=Section)
    rays: int = 100
    layers: int = 12
    out_of_plane_stiffness: float = 100.0
    effective_length: float = 10.0
    seed: int = 0
    outputs: str = "field"

    name: ClassVar[str] = "finger-on-glass"
    title: ClassVar[str] = "A finger pressed on glass and sliding"
    question: ClassVar[str] = ("How does a finger with collagen fibres deform, stick and slip when it is pressed on a "
                               "flat plate that then slides?")
    gate: ClassVar[float] = 0.05
    harmonic: ClassVar[bool] = False
    inputs: ClassVar[dict[str, str]] = {
        "variant": "arrangement of the fibres: radial, circumferential or random (one seed)",
        "c": "stiffness of the ground matrix, 2 to 4.5 kPa",
        "k1": "stiffness of the fibres, half to twice the published one of the variant",
        "friction": "Coulomb coefficient, 0.5 to 1.2",
        "normal_force": "0.2 to 0.8 N, reached in 8 positions; then the plate slides 6 mm in 24 positions"}
    needs: ClassVar[dict[str, str]] = {
        "section": "hybrid quadrilaterals in generalized plane strain, fibres at every integration point",
        "path": "Newton's method along the whole path: friction remembers",
        "contact": "gap, pressure and stick or slip at every node of the skin"}
    leaves_out: ClassVar[dict[str, str]] = {
        "three dimensions": "a section with an effective length stands for the finger",
        "mass matrix": "the path is quasi-static: nothing swings",
        "modes": "no linear system whose modes could be added up",
        "torch": "loaded only by the method `mlp`"}
    regions: ClassVar[tuple[str, ...]] = ("heavy load on soft tissue", "little friction", "beyond the ranges")

    def __post_init__(self) -> None:
        if isinstance(self.section, dict):
            known = [entry.name for entry in fields(Section)]
            unknown = [name for name in self.section if name not in known]
            if unknown:
                raise ValueError(f"a section has no {shown(unknown[0])}: choose from {', '.join(known)}")
            object.__setattr__(self, "section", Section(**self.section))
        if not isinstance(self.section, Section):
            raise ValueError(f"the section is {shown(self.section)}: build one with "
                             "rom.finger_on_glass.section.Section")
        if not isinstance(self.outputs, str) or self.outputs not in OUTPUTS:
            raise ValueError(f"outputs={shown(self.outputs)} is unknown: the scene can want {' or '.join(OUTPUTS)}")
        for name, least, most in (("out_of_plane_stiffness", 0.0, np.inf), ("effective_length", 1e-9, 1e4)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
                raise ValueError(f"{name}={shown(value)} is out of range: give {least:g} to {most:g}")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise ValueError(f"seed={shown(self.seed)} is no seed: give a whole number from 0 up")
        _ = self.mesh  # refuses numbers of elements that cannot be

    # ---- the model ------------------------------------------------------------------------------------------

    @cached_property
    def mesh(self) -> SectionMesh:
        """The section's mesh [mm]."""
        return mesh_section(self.section, self.rays, self.layers)

    @property
    def n_nodes(self) -> int:
        return len(self.mesh.nodes)

    @property
    def n_skin(self) -> int:
        return self.mesh.rays

    @property
    def n_positions(self) -> int:
        return len(FORCE_SHARES) + len(TRAVEL)

    @cached_property
    def force_share(self) -> np.ndarray:
        """(n_position,) ndarray: share of the normal force at each position."""
        return np.array([*FORCE_SHARES, *(1.0 for _ in TRAVEL)])

    @cached_property
    def travel(self) -> np.ndarray:
        """(n_position,) ndarray [m]: of the plate at each position."""
        return np.array([*(0.0 for _ in FORCE_SHARES), *TRAVEL])

    def finger(self, paths: PathArrays, i: int) -> Finger:
        """The full-order model of path ``i``."""
        from rom.finger_on_glass.contact import Glass
        from rom.finger_on_glass.finger import Finger, OutOfPlane
        from rom.finger_on_glass.tissue import Tissue

        c, k1 = float(paths.c[i]) / PASCAL, float(paths.k1[i]) / PASCAL
        tissue = Tissue(VARIANTS[paths.variant[i]], c, k1, seed=self.seed)
        return Finger(self.section, tissue, Glass(float(paths.friction[i])),
                      OutOfPlane(self.out_of_plane_stiffness, self.effective_length), self.rays, self.layers)

    def load_path(self, paths: PathArrays, i: int) -> LoadPath:
        """Positions of path ``i``, in the full-order model's units."""
        from rom.finger_on_glass.path import LoadPath

        force = float(paths.normal_force[i])
        return LoadPath(tuple(share * force for share in FORCE_SHARES), tuple(1e3 * x for x in TRAVEL))

    # ---- labels in, labels out ------------------------------------------------------------------------------

    def case_arrays(self, cases: xr.Dataset) -> PathArrays:
        """Check labelled paths and turn them into plain arrays; see :func:`rom.scenes.paths.read_paths`."""
        return read_paths(cases, self.name)

    def cases_from(self, paths: PathArrays) -> xr.Dataset:
        """Labelled paths from plain arrays: the inverse of :meth:`case_arrays`."""
        return xr.Dataset(label_paths(paths), coords={
            "path": ("path", np.arange(len(paths)), {"long_name": "load path", "units": "1"}),
            **self.position_coordinates()}, attrs={"scene": self.name, "scene_hash": self.content_hash})

    def position_coordinates(self) -> dict[str, tuple]:
        """What stands for each position along a path."""
        return {
            "position": ("position", np.arange(self.n_positions), {
                "long_name": "position along the path", "units": "1"}),
            "force_share": ("position", self.force_share, {"long_name": "share of the normal force", "units": "1"}),
            "travel": ("position", self.travel, {"long_name": "travel of the plate", "units": "m"})}

    # ---- identity -------------------------------------------------------------------------------------------

    @property
    def options(self) -> dict[str, Any]:
        """JSON-able arguments that build this scene again, beside ``outputs``."""
        found = asdict(self)
        del found["outputs"]
        return found

    @cached_property
    def content_hash(self) -> str:
        """Changes with everything that changes the truth: geometry, mesh, out-of-plane assumptions, seed, positions."""
        content = [self.name, self.options, FORCE_SHARES, TRAVEL]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def to_json(self) -> str:
        """Enough to build this scene again with :func:`rom.scenes.scene_from_json`."""
        return json.dumps({"scene": self.name, "outputs": self.outputs, "options": self.options}, sort_keys=True)

    # ---- which paths ----------------------------------------------------------------------------------------

    def sample(self, count: int, seed: int = 0) -> PathArrays:
        """``count`` paths within the ranges: variants in turn, a Latin hypercube of each."""
        return self._draw(count, np.random.default_rng([seed, 1]))

    def _draw(self, count: int, rng: np.random.Generator) -> PathArrays:
        from scipy.stats import qmc

        variant = np.arange(count) % len(VARIANTS)
        unit = np.empty((count, len(RANGES)))
        for v in range(len(VARIANTS)):
            mine = variant == v
            if mine.any():
                unit[mine] = qmc.LatinHypercube(len(RANGES), rng=rng).random(int(mine.sum()))
        drawn = {name: low + (high - low) * unit[:, j] for j, (name, (low, high)) in enumerate(RANGES.items())}
        low, high = RANGES["k1"]
        drawn["k1"] = _published_k1(variant) * low * (high / low) ** unit[:, 1]
        return PathArrays(variant, **drawn)

    def sample_beyond(self, count: int, seed: int = 0) -> PathArrays:
        """``count`` paths with one input outside its range, below and above in turn, the others within."""
        rng = np.random.default_rng([seed, 2])
        paths = self._draw(count, rng)
        names = list(BEYOND)
        for i in range(count):
            name = names[i // len(VARIANTS) % len(names)]
            low, high = BEYOND[name][i // (len(VARIANTS) * len(names)) % 2]
            value = low * (high / low) ** rng.random()
            getattr(paths, name)[i] = value * (_published_k1(paths.variant[i:i + 1])[0] if name == "k1" else 1.0)
        return paths

    def hard_region(self, paths: PathArrays, seed: int = 0) -> np.ndarray:
        """(n_path,) ndarray of int: 0 where a path belongs to hard training, k where to ``regions[k - 1]``."""
        found = np.where(paths.friction <= SLIPPERY, 2, 0)
        found = np.where((paths.normal_force >= HEAVY) & (paths.c <= SOFT), 1, found)
        return np.where(self.beyond(paths).any(axis=1), 3, found)

    def beyond(self, paths: PathArrays) -> np.ndarray:
        """(n_path, 4) ndarray of bool: which of c, k1, friction and normal force lie outside the sampled ranges."""
        values = paths.numbers.copy()
        values[:, 1] /= _published_k1(paths.variant)
        low, high = np.array(list(RANGES.values())).T
        return (values < low * (1 - 1e-9)) | (values > high * (1 + 1e-9))


def _published_k1(variant: np.ndarray) -> np.ndarray:
    """Published fibre stiffness of each variant [Pa]."""
    return PASCAL * np.array([PUBLISHED_K1[name] for name in VARIANTS])[variant]
