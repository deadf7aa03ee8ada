"""A level: one extreme, small enough to be asked of every method, and described so that it can be made again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from rom.datasets.schema import dataset_attributes
from rom.fingertip import Fingertip
from rom.metamodels import METHODS, Metamodel, Needs, applicable, metamodel_class
from rom.scenes import CaseArrays, LinearScene, get_scene

SCENES = STATIC, POINT, PATCH = "static-point-forces", "harmonic-point-force", "harmonic-patch-forces"
"""Names of the scenes that levels ask."""
SMALL: dict[str, dict[str, Any]] = {
    "coarse-fem": {"scale": 0.7}, "modal-static": {"modes": 20}, "modal-krylov": {"modes": 20, "vectors": 8},
    "lookup-table": {"frequencies": 31, "loss_factors": 5, "modes": 20, "vectors": 4},
    "transformer": {"width": 32, "steps": 100}, "mlp": {"terms": 8, "width": 16, "steps": 3},
    "mlp-residual": {"modes": 10, "rank": 16, "width": 16, "steps": 3},
    "pole-network": {"poles": 10, "rank": 40, "steps": 3}}
"""Settings that suit the small mesh, where the defaults do not."""
ON_ONE_SCENE: dict[tuple[str, str], dict[str, Any]] = {("pod-regression", POINT): {"rank": 40}}
SNAPSHOTS = {STATIC: 48, POINT: 64, PATCH: 48}
SEED = 5


@cache
def default_settings(scene: str) -> dict[str, dict[str, Any]]:
    """Every method of the toolkit that answers a scene, with the settings at which levels ask it."""
    reasons = applicable(get_scene(scene))
    return {name: ON_ONE_SCENE.get((name, scene), SMALL.get(name, {})) for name in METHODS if reasons[name] is None}


def _those(condition: Callable[[type[Metamodel], Needs], bool]) -> tuple[str, ...]:
    """Names of the methods of which a condition holds, in the order of the scenes."""
    kinds = {name: (metamodel_class(name, scene), scene) for scene in map(get_scene, SCENES)
             for name in default_settings(scene.name)}
    return tuple(name for name, (kind, scene) in kinds.items() if condition(kind, kind.needs(scene)))


@cache
def networks() -> tuple[str, ...]:
    """Methods that see inputs and no matrices, and that an optimiser trains."""
    return _those(lambda _, needs: needs.network)


@cache
def full_order() -> tuple[str, ...]:
    """The full-order model's own rows."""
    return _those(lambda kind, _: kind.full_order)


@cache
def matrix_based() -> tuple[str, ...]:
    """Methods that do not interpolate over the places of loads."""
    return _those(lambda _, needs: not (needs.network or needs.regression))


def same(tip: Fingertip) -> Fingertip:
    """The fingertip as it is."""
    return tip


def drawn(scene: LinearScene) -> xr.Dataset:
    """The ordinary training cases of a scene, solved directly."""
    return solved(scene, scene.sample(SNAPSHOTS[scene.name], seed=SEED))


def solved(scene: LinearScene, arrays: CaseArrays) -> xr.Dataset:
    """A training dataset from given cases."""
    return labelled(scene, arrays, scene.solve(arrays)[0]["displacement"])


def labelled(scene: LinearScene, arrays: CaseArrays, values: np.ndarray) -> xr.Dataset:
    """A training dataset from given cases and answers."""
    data = scene.label(scene.cases_from(arrays), values)
    data.attrs.update(dataset_attributes(scene))
    return data


@dataclass(frozen=True, eq=False)
class Level:
    """One extreme.

    Parameters
    ----------
    axis, name : str
        What is pushed, and how far; together unique.
    words : str
        The same as a clause that needs no table beside it.
    scene : str
        Name of the scene that is asked.
    cases : callable
        ``cases(scene) -> CaseArrays``: a few cases, each judged by itself; the level's outcome is the worst.
    change : callable
        ``change(fingertip) -> Fingertip``, from the atlas's own.
    truth : callable, optional
        ``truth(fingertip) -> Fingertip`` whose matrices tell right from wrong, on the same mesh; default: the
        scene's own.
    make : callable, optional
        ``make(fingertip) -> LinearScene`` where the scene needs more than its name.
    snapshots : callable
        ``snapshots(scene) -> xr.Dataset``, for the methods that learn.
    settings : dict
        Settings that differ from :func:`default_settings`, by method.
    methods : tuple of str
        Who is asked; empty: all that answer the scene.
    skip : tuple of str
        Who is not.
    threads : int
        Of the direct solver and of numpy's linear algebra.
    cancels : bool
        Whether single answers nearly cancel, so that the error is measured against the sum of their norms.
    tolerance : float, optional
        In place of the methods' own, where the question is not how well the matrices are solved.
    slow : bool
        Whether a quick atlas leaves it out.
    """

    axis: str
    name: str
    words: str
    scene: str
    cases: Callable[[LinearScene], CaseArrays]
    change: Callable[[Fingertip], Fingertip] = same
    truth: Callable[[Fingertip], Fingertip] | None = None
    make: Callable[[Fingertip], LinearScene] | None = None
    snapshots: Callable[[LinearScene], xr.Dataset] = drawn
    settings: dict[str, dict[str, Any]] = field(default_factory=dict)
    methods: tuple[str, ...] = ()
    skip: tuple[str, ...] = ()
    threads: int = 1
    cancels: bool = False
    tolerance: float | None = None
    slow: bool = False

    @property
    def asked(self) -> dict[str, dict[str, Any]]:
        """Settings of every method that this level asks."""
        mine = {**default_settings(self.scene), **self.settings}
        names = self.methods or tuple(mine)
        return {name: mine[name] for name in names if name in mine and name not in self.skip}

    @property
    def label(self) -> str:
        """``axis: name``."""
        return f"{self.axis}: {self.name}"


def tissue_change(**by_tissue: dict[str, float]) -> Callable[[Fingertip], Fingertip]:
    """Change some tissues' properties."""
    def change(tip: Fingertip) -> Fingertip:
        anatomy = tip.anatomy
        for name, values in by_tissue.items():
            anatomy = anatomy.replace_tissue(name, **values)
        return replace(tip, anatomy=anatomy)
    return change


def dimension_change(**values: float) -> Callable[[Fingertip], Fingertip]:
    """Change some dimensions [mm]."""
    return lambda tip: replace(tip, anatomy=tip.anatomy.replace(**values))


def static_cases(scene: LinearScene) -> CaseArrays:
    """One force, and three at once."""
    n = scene.n_loads
    return CaseArrays(np.array([[n // 3, 0, 0], [n // 5, n // 2, n - 2]]), np.array([[0.5, 0, 0], [0.3, 0.7, 0.2]]))


def harmonic_cases(frequency: float | list[float], loss_factor: float = 0.1, force: float = 0.05) -> Callable:
    """One force at a pad node (at the patch, along its normal) at each frequency [Hz]."""
    hertz = np.atleast_1d(np.asarray(frequency, dtype=float))

    def cases(scene: LinearScene) -> CaseArrays:
        node = 0 if scene.name == PATCH else scene.n_loads // 3
        return CaseArrays(np.full((len(hertz), 1), node), np.full((len(hertz), 1), force), hertz.copy(),
                          np.full(len(hertz), loss_factor))
    return cases
