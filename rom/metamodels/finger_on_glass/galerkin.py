"""`pod-galerkin` of load paths: the full model's own equations on few modes, integrated at few points.

A reduced finger for each variant of the fibres. Material, friction and force enter the reduced equations as they enter
the full ones: nothing is interpolated over them, so that a path outside the training ranges is still a solution of
equilibrium and Coulomb's law, on modes that may fit it less.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import xarray as xr

from rom.checks import real_number, whole_number
from rom.finger_on_glass.observation import along_plate, contact_edges
from rom.finger_on_glass.path import VISCOSITIES
from rom.finger_on_glass.tissue import VARIANTS
from rom.metamodels.facts import Curve
from rom.metamodels.finger_on_glass.glass import check_counts, check_learned, joined_reasons, not_on_glass
from rom.metamodels.finger_on_glass.hyper_reduction import ReducedSpace, learn_space, reduce, sampled, select_points
from rom.metamodels.finger_on_glass.reduced_equations import Constants, ReducedFinger
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.stored import Stored
from rom.metamodels.validity import Assessment
from rom.scenes import Answers, Scene
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.path_answers import METRE, PASCAL, area_between, wanted
from rom.scenes.paths import PathArrays

if TYPE_CHECKING:
    from rom.finger_on_glass.finger import Finger
    from rom.metamodels.finger_on_glass.reduced_path import ReducedPath


@dataclass(frozen=True, eq=False)
class ReducedVariant:
    """What is learned of one arrangement of the fibres.

    Parameters
    ----------
    space : ReducedSpace
    finger : ReducedFinger
        With the sampled points alone.
    points : (n,) ndarray of int
        Which integration points they are, of all elements' four in turn.
    """

    space: ReducedSpace
    finger: ReducedFinger
    points: np.ndarray


class PathGalerkin(Metamodel):
    """Galerkin projection of the nonlinear equations, hyper-reduced.

    Parameters
    ----------
    rank : int
        POD modes of the displacement.
    pressure_rank : int
        POD modes of the elements' pressures; each brings a supremizer, one displacement mode more.
    sampling : float, optional
        Tolerance of the sampled points: relative displacement error that they may cause in training states; None keeps
        every integration point.
    contact_stiffness, stick_stiffness : float [MPa/mm], optional
        Of the plate against penetration and against tangential motion of a sticking node. Few modes cannot hold every
        node as stiffly as the full model's 20 and 5 MPa/mm: pressures become rough and Newton's method slow. What a
        softer plate gives way on average is put back. None: the full model's.
    tolerance : float
        Of Newton's iteration, over the force on the plate.
    """

    name: ClassVar[str] = "pod-galerkin"
    learns: ClassVar[bool] = True
    colour: ClassVar[str] = "#117733"
    stored: ClassVar[tuple[Stored, ...]] = (Stored("_by_variant"),)
    summary: ClassVar[str] = ("solves the full model's equations on the principal directions of its own states, "
                              "integrated at few points")

    def __init__(self, scene: FingerOnGlass, rank: int = 30, pressure_rank: int = 10, sampling: float | None = 5e-3,
                 contact_stiffness: float | None = 2.0, stick_stiffness: float | None = 0.3,
                 tolerance: float = 1e-6) -> None:
        whole_number("rank", rank, 1, 400)
        whole_number("pressure_rank", pressure_rank, 1, 200)
        numbers = {"sampling": (sampling, 1e-8, 0.5), "contact_stiffness": (contact_stiffness, 1e-3, 1e3),
                   "stick_stiffness": (stick_stiffness, 1e-3, 1e3), "tolerance": (tolerance, 1e-10, 1e-2)}
        for name, (number, low, high) in numbers.items():
            if number is not None or name == "tolerance":
                real_number(name, number, low, high)
        super().__init__(scene, rank=rank, pressure_rank=pressure_rank, sampling=sampling,
                         contact_stiffness=contact_stiffness, stick_stiffness=stick_stiffness, tolerance=tolerance)
        self.variants: dict[int, ReducedVariant] = {}
        self.stage_seconds: dict[str, float] = {}
        """What the offline stages took [s]."""

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_on_glass(scene)

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        return Curve((*({"rank": rank} for rank in (10, 20, 30)),
                      *({"rank": rank, "sampling": 2e-3} for rank in (30, 40))), headline=3)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"rank": 6}, {"rank": 12}))

    # ---- offline --------------------------------------------------------------------------------------------

    def _fit(self, train: xr.Dataset) -> None:
        paths = self.scene.read(train)
        check_counts(self.name, paths, 2)
        self.variants, self.stage_seconds = {}, {"basis": 0.0, "sampling": 0.0}
        for v in np.unique(paths.variant):
            mine = np.flatnonzero(paths.variant == v)
            self.variants[int(v)] = self._learn(paths.take(mine), train.isel(case=mine))
        self._warm_up()

    def _learn(self, paths: PathArrays, train: xr.Dataset) -> ReducedVariant:
        start = time.perf_counter()
        finger = self.scene.finger(paths, 0)
        n = train.sizes["position"]
        displacement = train["displacement"].values.reshape(len(paths) * n, -1) / METRE
        stretch_z = train["stretch_z"].values.ravel()
        bulk = np.repeat([self.scene.finger(paths, i).tissue.bulk for i in range(len(paths))], n)
        touched = np.asarray((train["pressure"].values > 0).any(axis=(0, 1)))
        space = learn_space(finger, displacement, stretch_z, bulk, touched, self.settings["rank"],
                            self.settings["pressure_rank"])
        whole = reduce(finger, space)
        self.stage_seconds["basis"] += time.perf_counter() - start
        if self.settings["sampling"] is None:
            return ReducedVariant(space, whole, np.arange(len(whole.weights)))
        start = time.perf_counter()
        plate_y = finger.lowest + train["normal_displacement"].values.ravel() / METRE
        constants = [self._constants(paths, i) for i in range(len(paths)) for _ in range(n)]
        points, weights = select_points(whole, constants, displacement @ space.vectors, stretch_z, plate_y,
                                        self.settings["sampling"])
        self.stage_seconds["sampling"] += time.perf_counter() - start
        return ReducedVariant(space, sampled(whole, points, weights), points)

    def _warm_up(self) -> None:
        """Compile, so that no measured time contains it."""
        for v in self.variants:
            one = PathArrays(np.array([v]), np.array([3e3]), np.array([3e3]), np.array([1.0]), np.array([0.2]))
            self._follow(one, 0)

    # ---- online ---------------------------------------------------------------------------------------------

    def _constants(self, paths: PathArrays, i: int) -> Constants:
        finger = self.scene.finger(paths, i)
        tissue, plate = finger.tissue, finger.plate
        hold, stick = plate.normal_stiffness, plate.tangential_stiffness
        soft_hold = min(hold, self.settings["contact_stiffness"] or hold)
        soft_stick = min(stick, self.settings["stick_stiffness"] or stick)
        return Constants(tissue.c, float(tissue.k1 or 0.0), tissue.k2, tissue.bulk,
                         float(finger.out_of_plane.stiffness), float(plate.friction), float(soft_hold),
                         float(soft_stick), 1 / soft_stick - 1 / stick, 1 / soft_hold - 1 / hold)

    def _follow(self, paths: PathArrays, i: int) -> ReducedPath:
        from rom.metamodels.finger_on_glass.reduced_path import Controls, reduced_path

        path = self.scene.load_path(paths, i)
        controls = Controls(self.settings["tolerance"], 0.1 * self.settings["tolerance"])
        return reduced_path(
            self.variants[int(paths.variant[i])].finger, self._constants(paths, i), controls,
            np.array(path.normal_force) / self.scene.effective_length, np.array(path.travel), np.array(VISCOSITIES))

    def _evaluate(self, cases: PathArrays, outputs: str, out: np.ndarray | None) -> Answers:
        return self._follow_all(cases, outputs)[0]

    def answer(self, cases: PathArrays) -> tuple[Answers, Assessment]:
        self._check_fitted()
        answers, early = self._follow_all(cases, self.scene.outputs)
        return answers, Assessment.unknown(joined_reasons(self.reasons(cases), early), named=False)

    def _follow_all(self, paths: PathArrays, outputs: str) -> tuple[Answers, list[str]]:
        check_learned(self.name, paths, self.variants)
        names, count = wanted(outputs), self.scene.n_positions
        answers = {name: np.full((len(paths), count, *self.scene.shape_of(name)), np.nan) for name in names}
        reasons = []
        for i in range(len(paths)):
            found = self._follow(paths, i)
            reasons.append(self._reason(paths, i, found))
            kept = np.arange(min(count, found.reached))
            values = self._observe(self.variants[int(paths.variant[i])].space, found, kept, names)
            for name in names:
                answers[name][i, kept] = values[name]
        return answers, reasons

    def _reason(self, paths: PathArrays, i: int, found: ReducedPath) -> str:
        from rom.metamodels.finger_on_glass.reduced_path import REASONS

        if found.reached < self.scene.n_positions:
            force = found.reached < int((self.scene.travel == 0).sum())
            where = f"{found.end * self.scene.effective_length:.4g} N" if force else f"{found.end:.4g} mm of travel"
            return f"the reduced path ends at {where}, where {REASONS[found.reason]} however small the step"
        skin = self.variants[int(paths.variant[i])].space.skin
        if len(skin) < self.scene.n_skin and (found.pressure[:, [0, -1]] > 0).any():
            return "the contact reaches skin that no training path came near"
        return ""

    def _observe(self, space: ReducedSpace, found: ReducedPath, positions: np.ndarray, names: tuple[str, ...]
                 ) -> Answers:
        """Quantities at positions that were reached, by the definitions of :mod:`rom.finger_on_glass.observation`."""
        scene = self.scene
        mesh, finger = scene.mesh, self._geometry
        modes = space.vectors.reshape(scene.n_nodes, 2, -1)
        q = found.q[positions]
        skin = mesh.nodes[mesh.skin_nodes] + (q @ modes[mesh.skin_nodes].reshape(2 * scene.n_skin, -1).T).reshape(
            len(q), scene.n_skin, 2)
        piece = np.linalg.norm(np.roll(skin, -1, axis=1) - skin, axis=2)
        stretched = finger.skin_length / (0.5 * (piece + np.roll(piece, 1, axis=1)))
        pressure, shear = np.zeros((2, len(q), scene.n_skin))
        pressure[:, space.skin], shear[:, space.skin] = found.pressure[positions], found.shear[positions]
        edges = np.empty((len(q), 2))
        for k in range(len(q)):
            order = along_plate(pressure[k])
            edges[k] = contact_edges(skin[k, order, 0], skin[k, order, 1], pressure[k, order])
        edges *= METRE
        values = {
            "stretch_z": found.stretch_z[positions],
            "normal_displacement": METRE * (found.plate_y[positions] - finger.lowest),
            "tangential_force": -scene.effective_length * (shear @ finger.skin_length),
            "contact_left": edges[:, 0], "contact_right": edges[:, 1],
            "contact_area": area_between(edges[:, 0], edges[:, 1]),
            "pressure": PASCAL * pressure * stretched, "shear": -PASCAL * shear * stretched}
        if "displacement" in names:
            values["displacement"] = ((METRE * q) @ space.vectors.T).reshape(len(q), scene.n_nodes, 2)
        return values

    @cached_property
    def _geometry(self) -> Finger:
        """A full-order finger, for its skin alone: its material and plate do not count."""
        from rom.finger_on_glass.finger import Finger

        return Finger(self.scene.section, rays=self.scene.rays, layers=self.scene.layers)

    # ---- how good it can be ---------------------------------------------------------------------------------

    def best_approximation(self, cases: PathArrays, values: np.ndarray) -> np.ndarray:
        found = np.empty_like(values)
        for i, v in enumerate(cases.variant):
            vectors = self.variants[int(v)].space.vectors
            rows = values[i].reshape(len(values[i]), -1)
            found[i] = ((rows @ vectors) @ vectors.T).reshape(values[i].shape)
        return found

    # ---- files ----------------------------------------------------------------------------------------------

    @property
    def model_bytes(self) -> int:
        return sum(array.nbytes for one in self.variants.values() for array in (*one.finger, one.space.vectors))

    @property
    def _by_variant(self) -> dict[str, dict[str, np.ndarray]]:
        """What was learned, as arrays by the name of the variant."""
        return {VARIANTS[v]: {**{f"space_{name}": getattr(one.space, name) for name in SPACE}, **one.finger._asdict(),
                              "points": one.points} for v, one in self.variants.items()}

    @_by_variant.setter
    def _by_variant(self, found: dict[str, dict[str, np.ndarray]]) -> None:
        self.variants = {}
        for name, arrays in found.items():
            space = ReducedSpace(*(arrays[f"space_{key}"] for key in SPACE))
            finger = ReducedFinger(*(np.ascontiguousarray(arrays[key]) for key in ReducedFinger._fields))
            self.variants[VARIANTS.index(name)] = ReducedVariant(space, finger, arrays["points"])

    def _restored(self, data: xr.Dataset) -> None:
        self._warm_up()


SPACE = ("vectors", "pressures", "skin")
