"""The nonlinear scene: a finger with collagen fibres is pressed on a glass plate, then the plate slides.

A case is a whole load path. Its inputs say of what the finger is made and how hard it is pressed; the positions along
it are the scene's own and the same for every path, so that the answers of all paths stand in one array.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field, fields
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr

from rom.bodies import Grid
from rom.checks import real_number, shown, whole_number
from rom.finger_on_glass.section import Section, SectionMesh, mesh_section
from rom.finger_on_glass.tissue import VARIANTS
from rom.scenes.extent import Extent
from rom.scenes.inputs import Input, Quantity
from rom.scenes.path_answers import DEFINITIONS, QUANTITIES, RECORD, path_errors, solve_path
from rom.scenes.path_population import draw_beyond, draw_paths, why_held_out
from rom.scenes.paths import INPUTS, NUMBERS, PathArrays, label_paths, read_paths
from rom.scenes.scene import Answers, Scene

if TYPE_CHECKING:
    from rom.finger_on_glass.finger import Finger
    from rom.finger_on_glass.path import LoadPath

FORCE_SHARES = tuple(i / 8 for i in range(1, 9))
"""Of the normal force, at the positions before the plate slides."""
TRAVEL = tuple(0.25e-3 * i for i in range(1, 25))
"""Of the plate, at the positions after [m]."""
PASCAL = 1e6
"""In a MPa, which the full-order model computes in."""


@dataclass(frozen=True)
class FingerOnGlass(Scene):
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
    part: ClassVar[str] = "contact"
    part_words: ClassVar[str] = "contact quantities"
    case_noun: ClassVar[str] = "load path"
    kind_noun: ClassVar[str] = "variant"
    kinds_apart: ClassVar[bool] = True
    error_definition: ClassVar[str] = (
        "A case is a whole load path. Error of a case: the largest over its positions of the length of the difference "
        "over the length of the true displacement, over all nodes.")
    error_definitions: ClassVar[dict[str, str]] = DEFINITIONS
    told_along: ClassVar[dict[str, str]] = {"force": "tangential_force", "area": "contact_area"}
    # another seed than those on which features and settings of what learns were chosen
    extent: ClassVar[Extent] = Extent(4817, cases=240, quick_cases=18, least_cases=15, least_beyond=3, validation=9,
                                      batch=64, quick_batch=64, floor_scale=1.6, floor_on_all=True)
    quick_options: ClassVar[dict[str, Any]] = {"rays": 40, "layers": 5}
    recommended: ClassVar[str] = "pod-galerkin"
    solver: ClassVar[str] = "Newton's method along the path, every step converged to 1e-8"
    inputs: ClassVar[tuple[Input, ...]] = INPUTS
    quantities: ClassVar[dict[str, Quantity]] = QUANTITIES
    record: ClassVar[dict[str, Quantity]] = RECORD
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
        self.check_outputs(self.outputs)
        real_number("out_of_plane_stiffness", self.out_of_plane_stiffness, 0.0)
        real_number("effective_length", self.effective_length, 1e-9, 1e4)
        whole_number("seed", self.seed, 0)
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
    def n_free(self) -> int:
        """Unknowns of a state: displacements off the bone, stretch out of the plane, approach of the plate."""
        return 2 * (self.n_nodes - self.mesh.rays) + 2

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

    @cached_property
    def grid(self) -> Grid:  # type: ignore[override]
        """Nodes and quadrilaterals of the undeformed section [m]."""
        return Grid(1e-3 * self.mesh.nodes, np.arange(2 * self.n_nodes), {"quad": self.mesh.quads}, ("x", "y"),
                    axes=("position along the plate", "height, towards the nail"), noun="section of the finger")

    # ---- labels in, labels out ------------------------------------------------------------------------------

    def read(self, cases: xr.Dataset) -> PathArrays:
        paths = read_paths(cases, self.name)
        self.check_origin(cases, "the batch of load paths", required=False)
        return paths

    def cases_from(self, cases: PathArrays) -> xr.Dataset:
        return xr.Dataset(label_paths(cases), coords={
            "case": ("case", np.arange(len(cases)), {"long_name": "load path", "units": "1"}),
            **self.position_coordinates()}, attrs={"scene": self.name, "scene_hash": self.content_hash})

    def position_coordinates(self) -> dict[str, tuple]:
        """What stands for each position along a path."""
        return {
            "position": ("position", np.arange(self.n_positions), {
                "long_name": "position along the path", "units": "1"}),
            "force_share": ("position", self.force_share, {"long_name": "share of the normal force", "units": "1"}),
            "travel": ("position", self.travel, {"long_name": "travel of the plate", "units": "m"})}

    def coordinates(self) -> dict[str, tuple]:
        mesh = self.mesh
        nodes = 1e-3 * mesh.nodes
        return {
            **self.position_coordinates(),
            "node": ("node", np.arange(self.n_nodes), {"long_name": "mesh node", "units": "1"}),
            "component": ("component", ["x", "y"], {"long_name": "component of the displacement"}),
            "node_x": ("node", nodes[:, 0], {"long_name": "position along the plate", "units": "m"}),
            "node_y": ("node", nodes[:, 1], {"long_name": "height, towards the nail", "units": "m"}),
            "skin": ("skin", mesh.skin_nodes, {"long_name": "mesh node on the skin", "units": "1"})}

    def label(self, cases: xr.Dataset, answers: Answers, outputs: str | None = None) -> xr.Dataset:
        answer = self.stripped(self.batched(cases)).assign_coords(self.coordinates())
        for name, array in answers.items():
            quantity = self.quantities[name]
            answer[name] = (("case", *quantity.dims), array, {**quantity.attributes, **(
                {"mesh": "mesh", "location": "node"} if "node" in quantity.dims else {})})
        return answer

    def stripped(self, cases: xr.Dataset) -> xr.Dataset:
        """Cases without what a stored dataset holds beside: its answers and what it says of them."""
        mine = [name for name in cases.variables if name not in (*self.quantities, *self.record, "solve_seconds")
                and set(cases[name].dims) <= {"case", "position"}]
        return cases[mine].drop_dims("position", errors="ignore")

    def values(self, answer: xr.Dataset) -> Answers:
        """Every quantity of labelled answers as plain arrays."""
        return self.plain(answer)

    def shape_of(self, name: str) -> tuple[int, ...]:
        """Shape of a quantity beside case and position."""
        sizes = {"node": self.n_nodes, "component": 2, "skin": self.n_skin}
        return tuple(sizes[dim] for dim in self.quantities[name].dims[1:])

    # ---- what methods learn from ------------------------------------------------------------------------------

    def complete(self, train: xr.Dataset) -> xr.Dataset:
        """The paths that reached their last position."""
        missing = [name for name in (*self.quantities, "reached") if name not in train]
        if missing:
            raise ValueError(f"the training paths lack {', '.join(missing)}: make them with `rom dataset`")
        whole = train["reached"].transpose("case", ...).values.astype(bool).all(axis=1)
        if not whole.any():
            raise ValueError("no training path reaches its last position: make paths that converge")
        train = train if whole.all() else train.isel(case=np.flatnonzero(whole))
        for name in self.quantities:
            if not np.isfinite(train[name].values).all():
                raise ValueError(f"the training {name} holds a value that is not finite: drop that path")
        return train

    def kinds(self, cases: PathArrays) -> np.ndarray:
        return cases.variant[:, None]

    def numbers(self, cases: PathArrays) -> dict[str, np.ndarray]:
        return {name: getattr(cases, name) for name in NUMBERS}

    def check_answers(self, cases: PathArrays, answers: Answers, method: str) -> dict[str, tuple]:
        return {"answered": (("case", "position"), np.isfinite(answers["normal_displacement"]), {
            "long_name": "whether the method answers", "units": "1"})}

    # ---- the truth ------------------------------------------------------------------------------------------

    def solve(self, cases: PathArrays) -> tuple[Answers, dict[str, np.ndarray]]:
        """Paths followed with the full-order model, one after another; see `path_answers.solve_path`."""
        found = [solve_path(self, cases, i) for i in range(len(cases))]
        return ({name: np.stack([values[name] for values, _ in found]) for name in self.quantities},
                {name: np.array([record[name] for _, record in found]) for name in self.record})

    def begin_piece(self) -> None:
        warm_up()

    def errors(self, cases: PathArrays, answers: Answers, truth: Answers) -> dict[str, np.ndarray]:
        """(n_case, n_position) ndarrays: of the displacement, and of the contact as :data:`DEFINITIONS` say."""
        return path_errors(cases, answers, truth)

    def same_on_any_mesh(self, cases: PathArrays) -> np.ndarray:
        return cases.variant != VARIANTS.index("random")  # another mesh draws other angles

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
        return draw_paths(count, np.random.default_rng([seed, 1]))

    def sample_beyond(self, count: int, seed: int = 0) -> PathArrays:
        """``count`` paths with one input outside its range, below and above in turn, the others within."""
        return draw_beyond(count, np.random.default_rng([seed, 2]))

    def hard_region(self, paths: PathArrays, seed: int = 0) -> np.ndarray:
        """(n_path,) ndarray of int: 0 where a path belongs to hard training, k where to ``regions[k - 1]``."""
        return why_held_out(paths)


@cache
def warm_up() -> None:
    """Compile and load what every path needs, by a path on a coarse section, so that no measured time contains it."""
    scene = FingerOnGlass(rays=16, layers=2)
    solve_path(scene, scene.sample(1), 0)
