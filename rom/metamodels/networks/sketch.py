"""The few numbers from which a trunk is trained: some nodes' cases, and random combinations of all outputs.

A random combination of the outputs has, in the mean, the squared error of all of them; all nodes share the trunk.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from rom.metamodels.networks.unit_answers import NodeCases, UnitAnswers
from rom.metamodels.networks.variable_projection import Sketch

NODES, COLUMNS = 12, 3
"""Nodes whose cases train the trunk, and random combinations of the outputs of each."""
POOLED_CASES, POOLED_FEATURES, POOLED_COLUMNS = 3000, 8, 24
"""The same where nodes have few cases each: one output layer for all, of so many features of place."""
CASES_PER_TERM = 4
"""A node with so many cases per trunk function has an output layer of its own while the trunk trains."""


def make_sketch(answers: UnitAnswers, unknown: Callable[[int, NodeCases], np.ndarray], validation: np.ndarray,
                features: np.ndarray, terms: int, seed: int) -> Sketch:
    """Draw what a trunk is trained from.

    Parameters
    ----------
    answers : UnitAnswers
    unknown : callable
        (n, R) answers of a node's cases, without what needs no learning.
    validation : (n_case,) ndarray of bool
        Cases that the output layer must not see.
    features : (n_pad, h) ndarray
        Of each node's place.
    terms : int
        Number of trunk functions.
    seed : int
    """
    rng = np.random.default_rng([seed, 33])
    number, rank = answers.cases_by_node, answers.vectors.shape[1]
    own = np.flatnonzero(number >= CASES_PER_TERM * terms)
    pooled = len(own) < min(NODES, max(1, len(number) // 2))
    if pooled:
        chosen, columns = np.flatnonzero(number), POOLED_COLUMNS
        mixing = np.broadcast_to(rng.standard_normal((rank, columns)), (len(number), rank, columns))
        most = max(1, answers.count // (CASES_PER_TERM * terms))
        feature = leading_features(features, min(POOLED_FEATURES, most))
    else:
        chosen, columns = np.sort(rng.permutation(own)[:NODES]), COLUMNS
        mixing = rng.standard_normal((len(number), rank, columns))
        feature = np.ones((len(number), 1))
    groups: list[tuple[np.ndarray, ...]] = []
    for node in chosen.tolist():
        cases = answers.of_node(node)
        target = (unknown(node, cases) @ mixing[node]) / (cases.norm[:, None] * np.sqrt(columns))
        groups.append((cases.point, np.repeat(feature[node][None], len(cases), axis=0), 1.0 / cases.norm, target,
                       ~validation[cases.position]))
    if pooled:
        merged = [np.concatenate(parts) for parts in zip(*groups, strict=True)]
        keep = np.sort(rng.permutation(len(merged[0]))[:POOLED_CASES])
        groups = [tuple(part[keep] for part in merged)]
    point, feature, weight, target, learned = (padded(parts) for parts in zip(*groups, strict=True))
    each, index = np.unique(point.reshape(-1, 2), axis=0, return_inverse=True)
    arrays = each, index.reshape(weight.shape), feature, weight / weight.max(), target, learned
    return Sketch(*(torch.from_numpy(np.ascontiguousarray(array)) for array in arrays))


def padded(parts: tuple[np.ndarray, ...]) -> np.ndarray:
    """Arrays of different lengths stacked, filled up with zeros."""
    longest = max(map(len, parts))
    return np.stack([np.pad(part, [(0, longest - len(part))] + [(0, 0)] * (part.ndim - 1)) for part in parts])


def leading_features(features: np.ndarray, count: int) -> np.ndarray:
    """(n, count) ndarray: principal components of features (n, h) over the nodes, of unit mean square."""
    u, _, _ = np.linalg.svd(features, full_matrices=False)
    return u[:, :count] * np.sqrt(len(features))
