"""Static cases drawn uniformly from all combinations of one to three pad nodes, without listing them.

Combinations of k nodes c_1 < c_2 < ... < c_k are numbered by the combinatorial number system, N = sum_j C(c_j, j)
(Knuth, The Art of Computer Programming 4A, section 7.2.1.3): a number is drawn and turned into its nodes. 239 pad nodes
have 2,275,519 combinations. Answers come by superposition of unit responses, which is exact, block by block.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from rom.scenes import CaseArrays, Scene, StaticPointForces
from rom.scenes.static_point_forces import AMPLITUDE

HELD_OUT = 100_000
"""Combinations that the full-scale study keeps from training."""
BLOCK = 256
"""Cases superposed at once."""


def count_combinations(n_node: int, most: int = 3) -> int:
    """Number of combinations of one to ``most`` of ``n_node`` nodes."""
    return sum(math.comb(n_node, k) for k in range(1, most + 1))


def combination(number: np.ndarray, n_node: int, most: int = 3) -> np.ndarray:
    """The nodes of numbered combinations: first all single nodes, then all pairs, and so on.

    Parameters
    ----------
    number : (n,) ndarray of int
        From 0 to ``count_combinations(n_node, most) - 1``.
    n_node, most : int

    Returns
    -------
    (n, most) ndarray of int
        Ascending nodes from 0, then -1 where a combination has fewer.

    Raises
    ------
    ValueError
        For a number out of range.
    """
    number = np.asarray(number, dtype=np.int64)
    total = count_combinations(n_node, most)
    if number.size and not (number.min() >= 0 and number.max() < total):
        wrong = number.min() if number.min() < 0 else number.max()
        raise ValueError(f"combination {wrong} does not exist: {n_node} nodes have {total} of one to {most}, numbered "
                         "from 0")
    nodes = np.full((len(number), most), -1, dtype=np.int64)
    start = 0
    for k in range(1, most + 1):
        here = (number >= start) & (number < start + math.comb(n_node, k))
        rest = number[here] - start
        for j in range(k, 0, -1):  # the largest c with C(c, j) <= rest
            table = np.array([math.comb(c, j) for c in range(n_node)])
            chosen = np.searchsorted(table, rest, side="right") - 1
            nodes[here, j - 1] = chosen
            rest = rest - table[chosen]
        start += math.comb(n_node, k)
    return nodes


def combination_number(nodes: np.ndarray, n_node: int) -> np.ndarray:
    """(n,) ndarray of int: the inverse of :func:`combination`."""
    nodes = np.asarray(nodes, dtype=np.int64)
    most = nodes.shape[1]
    size = (nodes >= 0).sum(axis=1)
    starts = np.concatenate([[0, 0], np.cumsum([math.comb(n_node, k) for k in range(1, most)])]).astype(np.int64)
    number = starts[size]
    for j in range(1, most + 1):
        table = np.array([math.comb(c, j) for c in range(n_node)])
        number += np.where(nodes[:, j - 1] >= 0, table[nodes[:, j - 1]], 0)
    return number


def draw_combinations(scene: Scene, count: int, seed: int = 0, held_out: int = HELD_OUT,
                      ) -> tuple[CaseArrays, CaseArrays]:
    """Training cases and held-out ones, no combination in both, all drawn uniformly from every combination.

    Parameters
    ----------
    scene : StaticPointForces
    count, held_out : int
        Training and held-out cases. The held-out ones depend on their own number and the seed alone: more training
        cases leave them as they are, and lengthen the same sequence of training cases.
    seed : int

    Returns
    -------
    training, held_out : CaseArrays

    Raises
    ------
    ValueError
        For another scene, or more cases than there are combinations.
    """
    if not isinstance(scene, StaticPointForces):
        raise ValueError(f"{scene.name} has no combinations of static forces: only {StaticPointForces.name} has")
    total = count_combinations(scene.n_pad, scene.max_forces)
    if count < 0 or held_out < 0 or count + held_out > total:
        raise ValueError(f"{count} training and {held_out} held-out cases cannot be drawn: {scene.n_pad} pad nodes "
                         f"have {total} combinations of one to {scene.max_forces}")
    test = _distinct(total, held_out, np.random.default_rng([seed, 31]), np.empty(0, dtype=np.int64))
    train = _distinct(total, count, np.random.default_rng([seed, 32]), test)
    return _with_forces(scene, train, [seed, 33]), _with_forces(scene, test, [seed, 34])


def _distinct(total: int, count: int, rng: np.random.Generator, excluded: np.ndarray) -> np.ndarray:
    """(count,) ndarray: distinct numbers below ``total`` in the order of their draw, none of ``excluded``."""
    if count + len(excluded) > 0.7 * total:  # rejection would starve: shuffle what is left instead
        return rng.permutation(np.setdiff1d(np.arange(total), excluded))[:count]
    found = np.empty(0, dtype=np.int64)
    while len(found) < count:
        # draws of a fixed size, so that a longer sequence begins with the shorter one
        found = np.concatenate([found, rng.integers(total, size=1 << 16)])
        _, first = np.unique(found, return_index=True)
        found = found[np.sort(first)]
        found = found[~np.isin(found, excluded)]
    return found[:count]


def _with_forces(scene: Scene, number: np.ndarray, seed: list[int]) -> CaseArrays:
    nodes = combination(number, scene.n_pad, scene.max_forces)
    force = np.random.default_rng(seed).uniform(*AMPLITUDE, size=nodes.shape)
    return CaseArrays(np.maximum(nodes, 0), np.where(nodes >= 0, force, 0.0))


def unit_responses(scene: Scene) -> np.ndarray:
    """(n_pad, n_free) ndarray [m/N]: static displacement under a unit normal force at each pad node."""
    return np.ascontiguousarray(scene.full_order.solve_static(scene.unit_loads).T)


def superposed(responses: np.ndarray, cases: CaseArrays, block: int = BLOCK) -> Iterator[tuple[slice, np.ndarray]]:
    """True answers to static cases, a block at a time.

    Parameters
    ----------
    responses : (n_pad, n_free) ndarray [m/N]
        Of :func:`unit_responses`, or of any linear functional of them, such as POD coefficients (n_pad, r).
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
