"""Combinations of pad nodes, numbered.

Combinations of k nodes c_1 < c_2 < ... < c_k are numbered by the combinatorial number system, N = sum_j C(c_j, j)
(Knuth, The Art of Computer Programming 4A, section 7.2.1.3), so that 2,275,519 of them need no list.
"""

from __future__ import annotations

import math

import numpy as np


def count_combinations(n_node: int, most: int = 3) -> int:
    """Number of combinations of one to ``most`` of ``n_node`` nodes.

    Examples
    --------
    The published metamodel's static cases:

    >>> count_combinations(239)
    2275519
    """
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
