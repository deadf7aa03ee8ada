"""Static cases drawn uniformly from all combinations of one to three pad nodes; superposed truth.

Answers come by superposition of unit responses, which is exact, block by block.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rom.datasets.splits import held_out_numbers
from rom.scenes import CaseArrays, LinearScene
from rom.scenes.combinations import combination
from rom.scenes.static_point_forces import AMPLITUDE, PadCombinations

HELD_OUT = 100_000
"""Combinations that the full-scale study keeps from training."""
BLOCK = 256
"""Cases superposed at once."""


def draw_combinations(scene: LinearScene, count: int, seed: int = 0, held_out: int = HELD_OUT,
                      ) -> tuple[CaseArrays, CaseArrays]:
    """Training cases and held-out ones, each drawn uniformly from its part of all combinations.

    Which combinations are held out is the published split's choice for this seed, the same as in every other dataset;
    more cases lengthen the same sequence.

    Parameters
    ----------
    scene : LinearScene
    count, held_out : int
        Training and held-out cases.
    seed : int

    Returns
    -------
    training, held_out : CaseArrays

    Raises
    ------
    ValueError
        For another scene, or more cases than there are combinations.
    """
    if not isinstance(getattr(scene, "population", None), PadCombinations):
        raise ValueError(f"{scene.name} has no combinations of static forces: only static-point-forces has")
    held = held_out_numbers(scene.n_published, seed)
    learned = np.setdiff1d(np.arange(scene.n_published), held)
    for asked, there, what in ((count, learned, "training"), (held_out, held, "held-out")):
        if not 0 <= asked <= len(there):
            raise ValueError(f"{asked} {what} cases cannot be drawn: of the {scene.n_published} combinations of one to "
                             f"{scene.max_forces} among {scene.n_loads} pad nodes {len(there)} are {what} ones")
    train = np.random.default_rng([seed, 32]).permutation(learned)[:count]
    return _with_forces(scene, train, [seed, 33]), _with_forces(scene, held[:held_out], [seed, 34])


def held_out_combinations(scene: LinearScene, seed: int = 0) -> CaseArrays:
    """The first :data:`HELD_OUT` held-out cases, or all where there are fewer; see :func:`draw_combinations`."""
    return draw_combinations(scene, 0, seed, min(HELD_OUT, len(held_out_numbers(scene.n_published or 0, seed))))[1]


def _with_forces(scene: LinearScene, number: np.ndarray, seed: list[int]) -> CaseArrays:
    nodes = combination(number, scene.n_loads, scene.max_forces)
    force = np.random.default_rng(seed).uniform(*AMPLITUDE, size=nodes.shape)
    return CaseArrays(np.maximum(nodes, 0), np.where(nodes >= 0, force, 0.0))


def unit_responses(scene: LinearScene) -> np.ndarray:
    """(n_load, n_free) ndarray [m/N]: static displacement under a unit normal force at each pad node."""
    return np.ascontiguousarray(scene.model.solve_static(scene.unit_loads).T)


def superposed(responses: np.ndarray, cases: CaseArrays, block: int = BLOCK) -> Iterator[tuple[slice, np.ndarray]]:
    """True answers to static cases, a block at a time.

    Parameters
    ----------
    responses : (n_load, n_free) ndarray [m/N]
        Of :func:`unit_responses`, or of any linear functional of them, such as POD coefficients (n_load, r).
    cases : CaseArrays
    block : int

    Yields
    ------
    index : slice
    displacement : (k, n_free) ndarray [m]
    """
    for start in range(0, len(cases), block):
        index = slice(start, min(start + block, len(cases)))
        part = cases.take(index)
        weights = np.zeros((len(part), len(responses)), dtype=np.result_type(part.force, responses))
        np.add.at(weights, (np.arange(len(part))[:, None], part.node), part.force)
        yield index, weights.astype(responses.dtype, copy=False) @ responses
