"""Extremes of the numerics: mesh density, single precision, snapshots, ranks, networks, threads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import xarray as xr
from scipy import sparse

from atlas.excitation_extremes import LOOKED_AT
from atlas.level import (
    PATCH,
    POINT,
    STATIC,
    Level,
    drawn,
    full_order,
    harmonic_cases,
    labelled,
    networks,
    solved,
    static_cases,
)
from rom.fingertip import Fingertip, MeshDensity
from rom.scenes import CaseArrays, LinearScene

MESHES = {
    "coarsest": MeshDensity((2, 2), 1, 1, (1, 1, 1, 1)), "very coarse": MeshDensity((4, 4), 1, 1, (1, 1, 1, 1)),
    "coarse": MeshDensity((6, 6), 3, 2, (1, 1, 1, 2)), "middling": MeshDensity((10, 10), 4, 3, (1, 1, 1, 2)),
    "metamodel preset": MeshDensity((14, 16), 6, 4)}
SLOW = ("middling", "metamodel preset")
FEW = MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))
"""A mesh on which all modes can be had."""


def mesh_density() -> list[Level]:
    """Meshes from the coarsest to the `metamodel` preset; each against its own matrices."""
    return [Level("mesh density", name, f"{name} mesh, patch force at 30 and 150 Hz", PATCH,
                  harmonic_cases([30.0, 150.0]), change=partial(replace, density=density),
                  methods=(*full_order(), "modal-static", "modal-krylov"), slow=name in SLOW)
            for name, density in MESHES.items()]


class SinglePrecisionFingertip(Fingertip):
    """A fingertip whose matrices somebody stored in single precision."""

    @cached_property
    def stiffness(self) -> sparse.csc_matrix:
        return super().stiffness.astype(np.float32)

    @cached_property
    def mass(self) -> sparse.csc_matrix:
        return super().mass.astype(np.float32)


def _single(tip: Fingertip) -> Fingertip:
    return SinglePrecisionFingertip(tip.anatomy, tip.density, tip.formulation, tip.rear)


def _same(tip: Fingertip) -> Fingertip:
    return tip


SINGLE: dict[str, Any] = {"precision": "float32"}


def single_precision() -> list[Level]:
    """Single precision in stored shapes, matrices and snapshots."""
    shapes: dict[str, dict[str, Any]] = {"modal": SINGLE, "modal-static": {"modes": 20, **SINGLE},
              "modal-krylov": {"modes": 20, "vectors": 8, **SINGLE}, "pod-galerkin": SINGLE,
              "pod-regression": {"rank": 40, **SINGLE}}
    axis = "single precision"
    levels = [
        Level(axis, "stored fields, static", "stored fields in single precision, at rest", STATIC, static_cases,
              methods=("superposition", "pod-galerkin", "pod-regression"),
              settings={"superposition": SINGLE, "pod-galerkin": SINGLE, "pod-regression": SINGLE}),
        Level(axis, "stored fields, vibrating", "stored fields in single precision, at 30 and 150 Hz", POINT,
              harmonic_cases([30.0, 150.0]), methods=tuple(shapes), settings=shapes),
        Level(axis, "stored fields, resonance", "stored fields in single precision, at a resonance with loss factor "
              "1e-6", POINT, _first_resonance, methods=tuple(shapes), settings=shapes)]
    for scene, cases, suffix in ((STATIC, static_cases, "static"),
                                 (POINT, harmonic_cases([30.0, 150.0]), "vibrating")):
        levels += [
            Level(axis, f"matrices, {suffix}", f"matrices stored in single precision, {suffix}", scene, cases, _single,
                  truth=_same, skip=(*networks(), "coarse-fem")),
            Level(axis, f"snapshots, {suffix}", f"snapshots stored in single precision, {suffix}", scene, cases,
                  snapshots=_single_snapshots, methods=("pod-galerkin", "pod-regression"))]
    return levels


def _first_resonance(scene: LinearScene) -> CaseArrays:
    return harmonic_cases(float(scene.model.natural_modes(count=LOOKED_AT).frequency_hz[0]), 1e-6)(scene)


def _single_snapshots(scene: LinearScene) -> xr.Dataset:
    data = drawn(scene)
    kind = np.complex64 if scene.harmonic else np.float32
    return data.assign(displacement=data["displacement"].astype(kind))


# ---- snapshots --------------------------------------------------------------------------------------------------

def _scaled(factor: float) -> Callable[[LinearScene], xr.Dataset]:
    def snapshots(scene: LinearScene) -> xr.Dataset:
        arrays = scene.read(drawn(scene))
        values = scene.values(drawn(scene))
        return labelled(scene, CaseArrays(arrays.node, factor * arrays.force, arrays.frequency, arrays.loss_factor),
                        factor * values)
    return snapshots


def _repeated(distinct: int, copies: int) -> Callable[[LinearScene], xr.Dataset]:
    def snapshots(scene: LinearScene) -> xr.Dataset:
        arrays = scene.sample(64, seed=5).take(np.repeat(np.arange(distinct), copies))
        factor = 1.0 + np.arange(len(arrays))[:, None]
        return solved(scene, CaseArrays(arrays.node, factor * arrays.force, arrays.frequency, arrays.loss_factor))
    return snapshots


def _mixed(scene: LinearScene) -> xr.Dataset:
    data = drawn(scene)
    arrays, values = scene.read(data), scene.values(data)
    factor = np.where(np.arange(len(arrays)) % 2, 1e-160, 1e130)[:, None]
    return labelled(scene, CaseArrays(arrays.node, factor * arrays.force, arrays.frequency, arrays.loss_factor),
                    factor * values)


def _noisy(scene: LinearScene) -> xr.Dataset:
    data = drawn(scene)
    values = scene.values(data)
    noise = np.random.default_rng(11).standard_normal(values.shape)
    size = np.linalg.norm(values, axis=1, keepdims=True) / np.sqrt(values.shape[1])
    return labelled(scene, scene.read(data), values + 0.05 * size * noise)


def _broken(scene: LinearScene) -> xr.Dataset:
    data = drawn(scene)
    values = scene.values(data)
    values[0, 0] = np.nan
    return labelled(scene, scene.read(data), values)


def _spanning(scene: LinearScene) -> xr.Dataset:
    """Random fields, more than there are unknowns, so that the basis spans everything."""
    arrays = scene.sample(scene.n_free // 2 + 20, seed=5)
    rng = np.random.default_rng(3)
    values = rng.standard_normal((len(arrays), scene.n_free)) + 1j * rng.standard_normal((len(arrays), scene.n_free))
    return labelled(scene, arrays, 1e-3 * values)


SNAPSHOT_SETS: dict[str, tuple[str, Callable[[LinearScene], xr.Dataset]]] = {
    "collinear": ("copies of one snapshot", _repeated(1, 24)),
    "only one": ("a single snapshot", _repeated(1, 1)),
    "rank-deficient": ("six snapshots, each eight times", _repeated(6, 8)),
    "tiny": ("snapshots of 1e-200 of their size", _scaled(1e-200)),
    "huge": ("snapshots of 1e150 of their size", _scaled(1e150)),
    "tiny and huge": ("half of the snapshots tiny, half huge", _mixed),
    "noisy": ("snapshots with 5 % noise", _noisy),
    "not a number": ("a snapshot with a value that is no number", _broken)}


def pod_snapshots() -> list[Level]:
    """Snapshots that no one should learn from."""
    levels = []
    for name, (words, snapshots) in SNAPSHOT_SETS.items():
        for scene, cases, suffix in ((STATIC, static_cases, "static"), (POINT, harmonic_cases(150.0), "vibrating")):
            levels.append(Level("POD snapshots", f"{name}, {suffix}", f"{words}, {suffix}", scene, cases,
                                snapshots=snapshots, methods=("pod-galerkin", "pod-regression", *networks()),
                                settings={"pod-regression": {}}))
    return levels


# ---- ranks ------------------------------------------------------------------------------------------------------

def rank() -> list[Level]:
    """Bases of one vector, of all of them, and of more than there are."""
    def at(name: str, words: str, settings: dict, scene: str = POINT, **options) -> Level:
        cases = static_cases if scene == STATIC else harmonic_cases([30.0, 150.0])
        return Level("rank", name, words, scene, cases, settings=settings, methods=tuple(settings), **options)

    def few(tip: Fingertip) -> Fingertip:
        return replace(tip, density=FEW)
    return [
        at("one", "a basis of one vector", {
            "modal": {"modes": 1}, "modal-static": {"modes": 1}, "modal-krylov": {"modes": 1, "vectors": 1},
            "pod-galerkin": {"rank": 1}, "pod-regression": {"rank": 1}, "mlp": {"rank": 1, "width": 16, "steps": 3}}),
        at("one, static", "a basis of one vector, at rest", {
            "pod-galerkin": {"rank": 1}, "pod-regression": {"rank": 1},
            "transformer": {"rank": 1, "width": 32, "steps": 200}}, STATIC),
        at("many load vectors", "60 load-dependent vectors with 20 modes", {
            "modal-krylov": {"modes": 20, "vectors": 60}}, change=few),
        at("all but one", "all modes but one", {
            "modal": {"modes": 683}, "modal-static": {"modes": 683}, "modal-krylov": {"modes": 683, "vectors": 3}},
           change=few),
        at("all", "as many modes as unknowns", {
            "modal": {"modes": 684}, "modal-static": {"modes": 684}, "modal-krylov": {"modes": 684, "vectors": 3}},
           change=few),
        at("too many", "more modes than unknowns", {
            "modal": {"modes": 685}, "modal-static": {"modes": 685}, "modal-krylov": {"modes": 685, "vectors": 3},
            "pod-galerkin": {"rank": 10_000}, "pod-regression": {"rank": 10_000}}, change=few),
        at("spanning", "POD of random fields that span everything", {"pod-galerkin": {}}, change=few,
           snapshots=_spanning)]


# ---- networks and threads ---------------------------------------------------------------------------------------

def unseen_inputs() -> list[Level]:
    """Inputs that no network was trained on."""
    who = ("pod-regression", *networks())

    def forces(count: int, size: float = 0.4) -> Callable[[LinearScene], CaseArrays]:
        return lambda scene: CaseArrays(np.arange(count)[None, :] % scene.n_loads, np.full((1, count), size))
    axis = "networks outside their range"
    levels = [Level(axis, f"{count} forces", f"{count} forces where one to three were learned", STATIC, forces(count),
                    methods=who) for count in (4, 10)]
    levels.append(Level(axis, "unseen nodes, static", "a node far from the six that were learned", STATIC,
                        _last_node, methods=who, snapshots=_few_nodes))
    levels.append(Level(axis, "unseen nodes, vibrating", "a node far from the six that were learned, at 150 Hz", POINT,
                        _last_node, methods=who, snapshots=_few_nodes))
    for hertz, eta in ((0.01, 0.2), (340.0, 0.2), (2000.0, 0.2), (5e4, 0.2), (150.0, 0.01), (150.0, 0.0),
                       (150.0, 3.0)):
        levels.append(Level(axis, f"{hertz:g} Hz, η {eta:g}", f"{hertz:g} Hz at loss factor {eta:g}, outside 1 to "
                            "300 Hz or 0.1 to 0.5", POINT, harmonic_cases(hertz, eta), methods=who))
    return levels


def _few_nodes(scene: LinearScene) -> xr.Dataset:
    arrays = scene.sample(48, seed=5)
    return solved(scene, CaseArrays(arrays.node % 6, arrays.force, arrays.frequency, arrays.loss_factor))


def _last_node(scene: LinearScene) -> CaseArrays:
    node, force = np.array([[scene.n_loads - 1]]), np.array([[0.1]])
    return CaseArrays(node, force, np.array([150.0]), np.array([0.2])) if scene.harmonic else CaseArrays(node, force)


def thread_counts() -> list[Level]:
    """The same cases on more threads than there are cores."""
    return [Level("threads", f"{count}, {suffix}", f"{count} threads, {suffix}", scene, cases, threads=count,
                  slow=count > 2)
            for count in (1, 2, 4) for scene, cases, suffix in (
                (STATIC, static_cases, "static"), (POINT, harmonic_cases([30.0, 150.0]), "vibrating"))]
