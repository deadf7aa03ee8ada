"""Extremes of the load: where it acts, several forces at one node, forces that cancel, mighty and feeble ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from atlas.level import PATCH, POINT, STATIC, Level, harmonic_cases, matrix_based, static_cases
from rom.bodies import Loads
from rom.fingertip import TISSUES, Fingertip, FingertipBody
from rom.scenes import CaseArrays, LinearScene
from rom.scenes.harmonic_point_force import HARMONIC_POINT_FORCE, PublishedGrid
from rom.scenes.static_point_forces import STATIC_POINT_FORCES, PadCombinations

ELSEWHERE = {STATIC: (STATIC_POINT_FORCES, PadCombinations()), POINT: (HARMONIC_POINT_FORCE, PublishedGrid())}
"""Question and population of the scenes whose forces act at other nodes than the pad's."""


def elsewhere(tip: Fingertip, scene: str, nodes: tuple[int, ...]) -> LinearScene:
    """A scene's question with forces at other nodes: inward normals on the skin, straight up inside."""
    question, population = ELSEWHERE[scene]
    mesh = tip.mesh
    skin = set(mesh.skin_nodes.tolist())
    columns = np.stack([tip.point_force(node, -mesh.normals[np.searchsorted(mesh.skin_nodes, node)] if node in skin
                                        else (0.0, 0.0, 1.0)) for node in nodes], axis=1)
    return LinearScene(FingertipBody(tip, question.harmonic), Loads(columns, {"load_node": np.array(nodes)}),
                       replace(question, spatial=False, part=""), population=population)


def nail_rim(tip: Fingertip) -> tuple[int, ...]:
    """Skin nodes where the nail plate ends."""
    mesh = tip.mesh
    plate = mesh.tissue == TISSUES.index("nail_plate")
    return tuple(np.intersect1d(np.intersect1d(mesh.hexahedra[plate], mesh.hexahedra[~plate]),
                                mesh.skin_nodes).tolist())


def beside_bone(tip: Fingertip) -> tuple[int, ...]:
    """Free nodes that share an element with a held one."""
    mesh = tip.mesh
    touching = mesh.hexahedra[np.isin(mesh.hexahedra, mesh.bone_nodes).any(axis=1)]
    return tuple(np.setdiff1d(touching, mesh.bone_nodes).tolist())


def load_placement() -> list[Level]:
    """The nail's rim, a held node's neighbour, three forces at one node."""
    levels = []
    for name, words, place in (("nail rim", "a force on the nail's rim", nail_rim),
                               ("beside the bone", "a force on the neighbour of a held node", beside_bone)):
        for cases, scene in ((static_cases, STATIC), (harmonic_cases([30.0, 150.0]), POINT)):
            suffix = "static" if scene == STATIC else "vibrating"
            levels.append(Level("load placement", f"{name}, {suffix}", f"{words}, {suffix}", scene, cases,
                                make=_at(scene, place), methods=matrix_based()))
    return [*levels,
            Level("load placement", "three at one node, static", "three forces at one node, at rest", STATIC,
                  lambda scene: CaseArrays(np.full((1, 3), scene.n_loads // 2), np.array([[0.2, 0.3, 0.5]]))),
            Level("load placement", "three at one patch", "three forces of different phase at one patch", PATCH,
                  lambda scene: CaseArrays(np.array([[0, 1, 2]]), np.array([[0.05, 0.03j, -0.02 + 0.01j]]),
                                           np.array([120.0]), np.array([0.1])))]


def _at(scene: str, place: Callable[[Fingertip], tuple[int, ...]]) -> Callable[[Fingertip], LinearScene]:
    return lambda tip: elsewhere(tip, scene, place(tip))


def opposed_forces() -> list[Level]:
    """Two forces at one place that cancel but for a small rest, and wholly."""
    levels = []
    for rest in (1e-2, 1e-6, 1e-12, 0.0):
        name = f"rest {rest:g}"
        words = f"opposed forces at one place that cancel but for {rest:g} of them"
        levels += [
            Level("opposed forces", f"{name}, static", f"{words}, at rest", STATIC, _opposed(rest, False),
                  cancels=True),
            Level("opposed forces", f"{name}, vibrating", f"{words}, at 120 Hz", PATCH, _opposed(rest, True),
                  cancels=True)]
    return levels


def _opposed(rest: float, harmonic: bool) -> Callable[[LinearScene], CaseArrays]:
    def cases(scene: LinearScene) -> CaseArrays:
        node = np.full((1, 2), 0 if harmonic else scene.n_loads // 2)
        force = np.array([[0.1, -0.1 * (1.0 - rest)]])
        return CaseArrays(node, force.astype(complex), np.array([120.0]), np.array([0.1])) if harmonic else CaseArrays(
            node, force)
    return cases


def force_size() -> list[Level]:
    """Forces from feeble to mighty: the models are linear, so nothing may change."""
    levels = []
    for size in (1e-200, 1e-30, 1e9, 1e150):
        levels += [
            Level("force size", f"{size:g} N, static", f"a steady force of {size:g} N", STATIC,
                  _single(size)),
            Level("force size", f"{size:g} N, vibrating", f"a force of {size:g} N at 120 Hz", POINT,
                  harmonic_cases(120.0, force=size))]
    return levels


def _single(size: float) -> Callable[[LinearScene], CaseArrays]:
    return lambda scene: CaseArrays(np.full((1, 1), scene.n_loads // 3), np.full((1, 1), size))
