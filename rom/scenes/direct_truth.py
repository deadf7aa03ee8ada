"""The truth of a linear scene: direct answers to its cases, one factorization for each operating point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rom.errors import SolverError
from rom.scenes.cases import CaseArrays
from rom.scenes.scene import Answers

if TYPE_CHECKING:
    from rom.scenes.linear_scene import LinearScene

RESIDUAL_LIMIT = 1e-10
"""Largest relative residual ||Z u - f|| / ||f|| with which an answer is stored as truth."""
PIECE_CASES = 64
"""Cases, about, that are solved together when a dataset is made."""


def gathered(groups: list[np.ndarray]) -> list[np.ndarray]:
    """Whole groups of cases in pieces of about :data:`PIECE_CASES`; a larger group is cut."""
    pieces: list[np.ndarray] = []
    waiting: list[np.ndarray] = []
    for group in groups:
        for part in np.array_split(group, max(1, -(-len(group) // PIECE_CASES))):
            waiting.append(part)
            if sum(map(len, waiting)) >= PIECE_CASES:
                pieces.append(np.concatenate(waiting))
                waiting = []
    return pieces + ([np.concatenate(waiting)] if waiting else [])


def solve_directly(scene: LinearScene, cases: CaseArrays) -> tuple[Answers, dict[str, np.ndarray]]:
    """See `LinearScene.solve`."""
    values = np.empty((len(cases), scene.n_free), dtype=scene.dtype)
    residual = np.empty(len(cases))
    for group in scene.groups(cases):
        block = cases.take(group)
        force, point = scene.force_vectors(block), scene.point(block)
        answer = scene.model.solve_harmonic(force, *point) if point else scene.model.solve_static(force)
        residual[group] = scene.model.residual(answer, force, *point)
        values[group] = answer.T
    if not (residual <= RESIDUAL_LIMIT).all():
        worst = int(np.argmax(residual))
        raise SolverError(f"case {worst} was solved with relative residual {residual[worst]:.1e}, above "
                          f"{RESIDUAL_LIMIT:g}: the matrix is too ill-conditioned for a direct truth")
    return {"displacement": values}, {"residual": residual}
