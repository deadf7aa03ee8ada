"""Metamodels that learn how the POD coordinates of a whole path follow from its inputs, a variant at a time."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rom.checks import choice, whole_number
from rom.finger_on_glass.tissue import VARIANTS
from rom.metamodels.facts import Needs
from rom.metamodels.finger_on_glass.features import dimensionless
from rom.metamodels.finger_on_glass.glass import check_counts, check_learned, not_on_glass
from rom.metamodels.finger_on_glass.kriging import Regressor, fit_regressor
from rom.metamodels.finger_on_glass.pod import FIELDS, SCALARS, PathSpace
from rom.metamodels.finger_on_glass.registration import Registration, slip_onset
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.stored import Stored
from rom.scenes import Answers, Scene
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.path_answers import QUANTITIES
from rom.scenes.paths import PathArrays

PROFILE_WEIGHT, SCALAR_WEIGHT = 0.3, 0.2
"""Of the relative errors of profiles and scalars, beside one for those of the displacement, in what a fit minimises."""

LEAST_PATHS = 3
"""Complete paths of a variant, below which nothing is learned from them."""
REGISTRATIONS = ("auto", "slip", "none")
FOLDS = 4
"""Parts of the training paths, each held back in turn, by which ``auto`` chooses."""
ARRAYS = ("centre", "scale", "inputs", "weights")
STORED = (*ARRAYS, "number")
"""Of a regressor, as it is stored."""


class OnModes(Metamodel):
    """POD coordinates from a regression; the subclasses say which.

    Parameters
    ----------
    rank : int, optional
        Number of displacement modes of each variant; None: all that the training paths span.
    registration : {"auto", "slip", "none"}
        Whether travel is counted in shares of that at which the finger slips (see ``registration.py`` beside);
        ``auto``: for each variant what does better on training paths held back in turn.
    """

    learns: ClassVar[bool] = True
    stored: ClassVar[tuple[Stored, ...]] = (Stored("_by_variant"),)

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_on_glass(scene)

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(stiffness=False)

    def __init__(self, scene: FingerOnGlass, rank: int | None, registration: str, **settings: Any) -> None:
        choice("registration", registration, REGISTRATIONS)
        if rank is not None:
            whole_number("rank", rank, 1)
        super().__init__(scene, rank=rank, registration=registration, **settings)
        self._forget()

    def _forget(self) -> None:
        self._spaces: dict[int, PathSpace] = {}
        self._means: dict[int, np.ndarray] = {}
        self._sizes: dict[int, np.ndarray] = {}
        self._registrations: dict[int, Registration] = {}

    @property
    def model_bytes(self) -> int:
        return sum(space.nbytes + self._means[v].nbytes + self._sizes[v].nbytes for v, space in self._spaces.items())

    def _fit(self, train: xr.Dataset) -> None:
        paths = self.scene.read(train)
        check_counts(self.name, paths, LEAST_PATHS)
        self._forget()
        for v in map(int, np.unique(paths.variant)):
            rows = np.flatnonzero(paths.variant == v)
            mine = paths.take(rows)
            answers = {name: train[name].values[rows] for name in QUANTITIES}
            space = PathSpace.of(self.scene, answers, self.settings["rank"])
            features, state = dimensionless(mine), space.encode(mine, answers)
            sliding = self.scene.travel[self._press - 1:]
            onset = slip_onset(mine, answers["tangential_force"][:, self._press - 1:], sliding)
            self._spaces[v] = space
            if self._registers(space, features, state, onset):
                found = Registration.of(features, onset, sliding[-1])
                self._registrations[v] = found
                state = found.to_stations(state, onset, self.scene.travel)
            self._means[v], self._sizes[v] = state.mean(axis=0), _sizes(space, state)
            self._learn(v, features, (state - self._means[v]) / self._sizes[v])

    @property
    def _press(self) -> int:
        """Number of positions before the plate slides."""
        return int((self.scene.travel == 0).sum())

    def _registers(self, space: PathSpace, features: np.ndarray, state: np.ndarray, onset: np.ndarray) -> bool:
        """Whether a variant is registered, by its mean largest error of displacement coordinates with and without."""
        choice, count = self.settings["registration"], len(features)
        if choice != "auto" or count < 2 * FOLDS:
            return choice == "slip"
        order = np.random.default_rng(0).permutation(count)
        modes, travel = space.start["displacement"], self.scene.travel
        missed = np.zeros(2)
        for fold in range(FOLDS):
            held = order[fold::FOLDS]
            learned = np.setdiff1d(order, held)
            found = Registration.of(features[learned], onset[learned], travel[-1])
            registered = found.to_stations(state[learned], onset[learned], travel)
            for k, known in enumerate((state[learned], registered)):
                guess = np.concatenate([_guess(space, features[learned], part, features[held]) for part in (
                    known[:, :self._press], known[:, self._press:])], axis=1)
                if k == 1:
                    guess = found.to_positions(guess, features[held], travel)
                error = np.linalg.norm((guess - state[held])[..., modes], axis=2)
                missed[k] += (error / np.linalg.norm(state[held][..., modes], axis=2)).max(axis=1).sum()
        return bool(missed[1] < missed[0])

    @abstractmethod
    def _learn(self, v: int, features: np.ndarray, target: np.ndarray) -> None:
        """Learn (n_path, n_station, size) scaled coordinates of a variant from (n_path, 4) features."""

    @abstractmethod
    def _coordinates(self, v: int, features: np.ndarray) -> np.ndarray:
        """(n_path, n_station, size) ndarray: what was learned."""

    def _evaluate(self, paths: PathArrays, outputs: str, out: np.ndarray | None) -> Answers:
        check_learned(self.name, paths, self._spaces)
        found: Answers = {}
        for v in map(int, np.unique(paths.variant)):
            rows = np.flatnonzero(paths.variant == v)
            mine = paths if len(rows) == len(paths) else paths.take(rows)
            features = dimensionless(mine)
            state = self._coordinates(v, features) * self._sizes[v] + self._means[v]
            if v in self._registrations:
                state = self._registrations[v].to_positions(state, features, self.scene.travel)
            part = self._spaces[v].decode(mine, state, outputs)
            if len(rows) == len(paths):
                return part
            for name, values in part.items():
                found.setdefault(name, np.empty((len(paths), *values.shape[1:])))[rows] = values
        return found

    def best_approximation(self, cases: PathArrays, values: np.ndarray) -> np.ndarray:
        out = np.empty_like(values)
        for v in map(int, np.unique(cases.variant)):
            rows = cases.variant == v
            out[rows] = self._spaces[v].project(values[rows])
        return out

    # ---- files ----------------------------------------------------------------------------------------------

    @property
    def _by_variant(self) -> dict[str, dict[str, np.ndarray]]:
        """What was learned, as arrays by the name of the variant."""
        found = {}
        for v, space in self._spaces.items():
            arrays = {"mean": self._means[v], "size": self._sizes[v],
                      **{f"mode_{field}": modes for field, modes in space.modes.items()}, **self._learned(v)}
            if v in self._registrations:
                one = self._registrations[v]
                arrays |= {"onset_grid": one.grid, "onset_level": np.array([one.level]),
                           **{f"onset_{key}": array for key, array in stored(one.onset).items()}}
            found[VARIANTS[v]] = arrays
        return found

    @_by_variant.setter
    def _by_variant(self, found: dict[str, dict[str, np.ndarray]]) -> None:
        self._forget()
        for name, arrays in found.items():
            v, arrays = VARIANTS.index(name), dict(arrays)
            self._spaces[v] = PathSpace(self.scene, {f: arrays.pop(f"mode_{f}") for f in FIELDS})
            self._means[v], self._sizes[v] = arrays.pop("mean"), arrays.pop("size")
            if "onset_grid" in arrays:
                onset = restored("gp", {key: arrays.pop(f"onset_{key}") for key in STORED})
                self._registrations[v] = Registration(onset, float(arrays.pop("onset_level")[0]),
                                                      arrays.pop("onset_grid"))
            self._keep_learned(v, arrays)

    @abstractmethod
    def _learned(self, v: int) -> dict[str, np.ndarray]:
        """What was learned of a variant, as arrays."""

    @abstractmethod
    def _keep_learned(self, v: int, arrays: dict[str, np.ndarray]) -> None:
        """The inverse of :meth:`_learned`; KeyError where an array is missing."""


def stored(found: Regressor) -> dict[str, np.ndarray]:
    """A regressor as arrays."""
    return {**{name: getattr(found, name) for name in ARRAYS}, "number": np.array([found.number])}


def restored(kind: str, arrays: dict[str, np.ndarray]) -> Regressor:
    """The inverse of :func:`stored`; KeyError where an array is missing."""
    return Regressor(kind, **{name: arrays[name] for name in ARRAYS}, number=float(arrays["number"][0]))


def _guess(space: PathSpace, features: np.ndarray, state: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Coordinates at other features by a Gaussian process."""
    mean, sizes = state.mean(axis=0), _sizes(space, state)
    found = fit_regressor("gp", features, ((state - mean) / sizes).reshape(len(state), -1))
    return found(where).reshape(len(where), *mean.shape) * sizes + mean


def _sizes(space: PathSpace, state: np.ndarray) -> np.ndarray:
    """(n_station, size) ndarray by which coordinates are divided, so that equal errors of them weigh as wanted."""
    sizes = np.empty(state.shape[1:])
    length = np.maximum(np.linalg.norm(state[..., space.start["displacement"]], axis=2).mean(axis=0), 1e-300)
    sizes[:, space.start["displacement"]] = length[:, None]
    for name in ("pressure", "shear"):
        level = np.linalg.norm(state[..., space.start[name]], axis=2).mean()
        sizes[:, space.start[name]] = max(level, 1e-300) / PROFILE_WEIGHT
    spread = state[..., :len(SCALARS)].std(axis=(0, 1))
    sizes[:, :len(SCALARS)] = np.maximum(spread, 1e-12) / SCALAR_WEIGHT
    return sizes
