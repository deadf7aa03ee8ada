"""`pod-galerkin` of load paths: the full model's own equations on few modes, integrated at few points.

A reduced finger for each variant of the fibres. Material, friction and force enter the reduced equations as they enter
the full ones: nothing is interpolated over them, so that a path outside the training ranges is still a solution of
equilibrium and Coulomb's law, on modes that may fit it less.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr

from rom.datasets.contact_schema import area_between, shape_of, wanted
from rom.datasets.path_solutions import METRE, PASCAL
from rom.finger_on_glass.observation import along_plate, contact_edges
from rom.finger_on_glass.path import VISCOSITIES
from rom.finger_on_glass.tissue import VARIANTS
from rom.fingertip.shape import shown
from rom.metamodels.contact.base import Answers, ContactMetamodel
from rom.metamodels.contact.hyper_reduction import ReducedSpace, learn_space, reduce, sampled, select_points
from rom.metamodels.contact.reduced_equations import Constants, ReducedFinger
from rom.scenes import FingerOnGlass, PathArrays

if TYPE_CHECKING:
    from rom.finger_on_glass.finger import Finger
    from rom.metamodels.contact.reduced_path import ReducedPath


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


class ContactGalerkin(ContactMetamodel):
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
    summary: ClassVar[str] = ("solves the full model's equations on the principal directions of its own states, "
                              "integrated at few points")

    def __init__(self, scene: FingerOnGlass, rank: int = 30, pressure_rank: int = 10, sampling: float | None = 5e-3,
                 contact_stiffness: float | None = 2.0, stick_stiffness: float | None = 0.3,
                 tolerance: float = 1e-6) -> None:
        for name, value, most in (("rank", rank, 400), ("pressure_rank", pressure_rank, 200)):
            if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 1 <= value <= most:
                raise ValueError(f"{name}={shown(value)} is no number of modes: give a whole number from 1 to {most}")
        numbers = {"sampling": (sampling, 1e-8, 0.5), "contact_stiffness": (contact_stiffness, 1e-3, 1e3),
                   "stick_stiffness": (stick_stiffness, 1e-3, 1e3), "tolerance": (tolerance, 1e-10, 1e-2)}
        for name, (number, low, high) in numbers.items():
            if number is None and name != "tolerance":
                continue
            if isinstance(number, bool) or not isinstance(number, int | float) or not low <= number <= high:
                raise ValueError(f"{name}={shown(number)} is out of range: give {low:g} to {high:g}")
        super().__init__(scene, rank=rank, pressure_rank=pressure_rank, sampling=sampling,
                         contact_stiffness=contact_stiffness, stick_stiffness=stick_stiffness, tolerance=tolerance)
        self.variants: dict[int, ReducedVariant] = {}
        self.stage_seconds: dict[str, float] = {}
        """What the offline stages took [s]."""

    # ---- offline --------------------------------------------------------------------------------------------

    def _fit(self, train: xr.Dataset) -> None:
        paths = self.scene.case_arrays(train)
        self.variants, self.stage_seconds = {}, {"basis": 0.0, "sampling": 0.0}
        for v in np.unique(paths.variant):
            mine = np.flatnonzero(paths.variant == v)
            self.variants[int(v)] = self._learn(paths.take(mine), train.isel(path=mine))
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
        from rom.metamodels.contact.reduced_path import Controls, reduced_path

        path = self.scene.load_path(paths, i)
        controls = Controls(self.settings["tolerance"], 0.1 * self.settings["tolerance"])
        return reduced_path(
            self.variants[int(paths.variant[i])].finger, self._constants(paths, i), controls,
            np.array(path.normal_force) / self.scene.effective_length, np.array(path.travel), np.array(VISCOSITIES))

    def _evaluate(self, paths: PathArrays, positions: np.ndarray, outputs: str) -> Answers:
        return self._follow_all(paths, positions, outputs)[0]

    def _answer(self, paths: PathArrays) -> tuple[Answers, list[str]]:
        return self._follow_all(paths, np.arange(self.scene.n_positions), self.scene.outputs)

    def _follow_all(self, paths: PathArrays, positions: np.ndarray, outputs: str) -> tuple[Answers, list[str]]:
        names = wanted(outputs)
        answers = {name: np.full((len(paths), len(positions), *shape_of(self.scene, name)), np.nan) for name in names}
        reasons = []
        for i in range(len(paths)):
            found = self._follow(paths, i)
            reasons.append(self._reason(paths, i, found))
            kept = np.flatnonzero(positions < found.reached)
            values = self._observe(self.variants[int(paths.variant[i])].space, found, positions[kept], names)
            for name in names:
                answers[name][i, kept] = values[name]
        return answers, reasons

    def _reason(self, paths: PathArrays, i: int, found: ReducedPath) -> str:
        from rom.metamodels.contact.reduced_path import REASONS

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

    def best_approximation(self, paths: PathArrays, displacement: np.ndarray) -> np.ndarray:
        found = np.empty_like(displacement)
        for i, v in enumerate(paths.variant):
            vectors = self.variants[int(v)].space.vectors
            rows = displacement[i].reshape(len(displacement[i]), -1)
            found[i] = ((rows @ vectors) @ vectors.T).reshape(displacement[i].shape)
        return found

    def full_residual(self, paths: PathArrays) -> np.ndarray:
        """Indicator without a reference: what the full model's equilibrium misses at the reduced states.

        One full assembly a position: dearer than the answer itself.

        Parameters
        ----------
        paths : PathArrays

        Returns
        -------
        (n_path, n_position) ndarray
            Norm of the nodes' unbalanced forces under the reduced tractions, over that of the bone's reaction.
        """
        from dataclasses import replace

        self._check_fitted()
        answer = np.full((len(paths), self.scene.n_positions), np.nan)
        for i in range(len(paths)):
            finger, one = self.scene.finger(paths, i), self.variants[int(paths.variant[i])]
            found = self._follow(paths, i)
            skin, length = finger.mesh.skin_nodes[one.space.skin], finger.skin_length[one.space.skin]
            free = finger.free_rows[finger.free_rows < finger.stretch_row]
            for k in range(found.reached):
                state = replace(finger.at_rest(), displacement=(one.space.vectors @ found.q[k]).reshape(-1, 2),
                                stretch_z=float(found.stretch_z[k]), plate_y=-1e3,  # no contact of its own
                                pressure=one.space.pressures @ found.pressure_coordinates[k])
                force = finger.residual(state, state.contact, None).force
                force[2 * skin] += length * found.shear[k]
                force[2 * skin + 1] -= length * found.pressure[k]
                answer[i, k] = np.linalg.norm(force[free]) / np.linalg.norm(force[finger.held_rows])
        return answer

    # ---- files ----------------------------------------------------------------------------------------------

    @property
    def model_bytes(self) -> int:
        return sum(array.nbytes for one in self.variants.values() for array in (*one.finger, one.space.vectors))

    @property
    def sampled_points(self) -> dict[str, tuple[int, int]]:
        """For each variant the number of sampled integration points, and of elements in which they lie."""
        return {VARIANTS[v]: (len(one.points), len(np.unique(one.points // 4))) for v, one in self.variants.items()}

    def _state(self) -> xr.Dataset:
        data: dict[str, Any] = {}
        for v, one in self.variants.items():
            arrays = {**{f"space_{name}": getattr(one.space, name) for name in _SPACE}, **one.finger._asdict(),
                      "points": one.points}
            for name, array in arrays.items():
                key = f"{VARIANTS[v]}_{name}"
                data[key] = ([f"{key}_{axis}" for axis in range(array.ndim)], array)
        return xr.Dataset(data, attrs={"variants": ",".join(VARIANTS[v] for v in self.variants)})

    def _restore(self, data: xr.Dataset) -> None:
        self.variants = {}
        for name in data.attrs["variants"].split(","):
            space = ReducedSpace(*(data[f"{name}_space_{key}"].values for key in _SPACE))
            finger = ReducedFinger(*(np.ascontiguousarray(data[f"{name}_{key}"].values)
                                     for key in ReducedFinger._fields))
            self.variants[VARIANTS.index(name)] = ReducedVariant(space, finger, data[f"{name}_points"].values)
        self._warm_up()


_SPACE = ("vectors", "pressures", "skin")
