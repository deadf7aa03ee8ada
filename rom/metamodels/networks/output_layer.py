"""The output layer of a network that multiplies features of the node with trunk functions, in closed form.

Coefficients B_j (q, r) of node j minimise the squared relative errors of all training cases plus weight decay,

    sum_c |T_c B_j(c) - y_c|^2 / |y_c|^2 + rho ||W||^2,      B = L W,

with L L^T the Gram matrix of the branch's features at the nodes. All that the cases have to say is in two small
matrices a node, so that 516,240 of them cost no more than a few.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from rom.metamodels.networks.unit_answers import NodeCases, UnitAnswers

NUGGET = 1e-8
"""Of the features' Gram matrix, relative to its diagonal: nodes can differ by that much without a reason in place."""


DECAYS = (1e-10, 1e-6, 1e-3, 1e-1)
SCALES = (2.0, 4.0)
"""Weight decay and standard deviation of the branch's random frequencies [rad over the pad's half length]: the best on
validation are taken; where every node has cases of its own, they matter little and the first are."""
CASES_PER_TERM = 4
"""So many cases per trunk function are enough of a node's own."""


@dataclass
class Statistics:
    """What least squares need of the cases of each node.

    gram : (n, q, q) ndarray
    cross : (n, q, r) ndarray
    square : float
        Sum of squared relative targets.
    count : int
    """

    gram: np.ndarray
    cross: np.ndarray
    square: float = 0.0
    count: int = 0

    @classmethod
    def empty(cls, n_node: int, terms: int, rank: int) -> Statistics:
        return cls(np.zeros((n_node, terms, terms)), np.zeros((n_node, terms, rank)))

    def add(self, node: int, design: np.ndarray, target: np.ndarray) -> None:
        """Take in complex weighted trunk functions (n, q) and targets (n, r) of one node."""
        rows = np.concatenate([design.real, design.imag])
        goal = np.concatenate([target.real, target.imag])
        self.gram[node] += rows.T @ rows
        self.cross[node] += rows.T @ goal
        self.square += float(np.vdot(goal, goal))
        self.count += len(design)

    def plus(self, other: Statistics) -> Statistics:
        return Statistics(self.gram + other.gram, self.cross + other.cross, self.square + other.square,
                          self.count + other.count)

    def in_basis(self, basis: np.ndarray) -> Statistics:
        """The same for targets times ``basis`` (r, r'); what leaves the basis stays in ``square``."""
        return Statistics(self.gram, self.cross @ basis, self.square, self.count)

    def error(self, heads: np.ndarray) -> float:
        """Root mean square relative error of ``heads`` (n, q, r)."""
        inside = float(np.vdot(heads, self.gram @ heads)) - 2.0 * float(np.vdot(heads, self.cross))
        return float(np.sqrt(max(self.square + inside, 0.0) / max(self.count, 1)))


def solve_heads(statistics: Statistics, features: np.ndarray, decay: float) -> np.ndarray:
    """Coefficients of every node, those without a case too.

    Parameters
    ----------
    statistics : Statistics
    features : (n, h) ndarray
        Of the branch, at every node.
    decay : float
        ``rho``, relative to the mean diagonal of the normal equations.

    Returns
    -------
    (n, q, r) ndarray
    """
    n, q, _ = statistics.cross.shape
    kernel = features @ features.T
    lower = np.linalg.cholesky(kernel + NUGGET * np.trace(kernel) / n * np.eye(n))
    pairs = (lower[:, :, None] * lower[:, None, :]).reshape(n, n * n)
    normal = (pairs.T @ statistics.gram.reshape(n, q * q)).reshape(n, n, q, q).transpose(0, 2, 1, 3).reshape(n * q, -1)
    del pairs
    normal[np.diag_indices(n * q)] += decay * np.trace(normal) / (n * q)
    right = np.einsum("ja,jqr->aqr", lower, statistics.cross, optimize=True).reshape(n * q, -1)
    factor = sla.cho_factor(normal, lower=True, overwrite_a=True, check_finite=False)
    weights = sla.cho_solve(factor, right, overwrite_b=True, check_finite=False).reshape(n, -1)
    return (lower @ weights).reshape(n, q, -1)


def choose_heads(learned: Statistics, held: Statistics, cases_by_node: np.ndarray,
                 features: Callable[[float], np.ndarray]) -> np.ndarray:
    """Coefficients from all cases, with the decay and scale that do best on validation when learned without it.

    Parameters
    ----------
    learned, held : Statistics
        Of the cases to learn from and of those for validation.
    cases_by_node : (n,) ndarray of int
    features : callable
        (n, h) features of the branch by their scale.

    Returns
    -------
    (n, q, r) ndarray
    """
    decay, scale = DECAYS[0], SCALES[0]
    if not (cases_by_node >= CASES_PER_TERM * learned.gram.shape[1]).all():
        def error(decay: float, scale: float) -> float:
            return held.error(solve_heads(learned, features(scale), decay))

        decay = min(DECAYS, key=lambda value: error(value, scale))
        scale = min(SCALES, key=lambda value: error(decay, value))
    return solve_heads(learned.plus(held), features(scale), decay)


def gather(answers: UnitAnswers, unknown: Callable[[int, NodeCases], np.ndarray],
           trunk: Callable[[np.ndarray], np.ndarray], validation: np.ndarray,
           terms: int) -> tuple[Statistics, Statistics, np.ndarray]:
    """Read every node's cases once.

    Parameters
    ----------
    answers : UnitAnswers
    unknown : callable
        (n, R) answers of a node's cases, without what needs no learning.
    trunk : callable
        (n, q) complex values at points (n, 2).
    validation : (n_case,) ndarray of bool
    terms : int
        q.

    Returns
    -------
    learned, held : Statistics
        Of the cases to learn from and of those for validation.
    spread : (R, R) ndarray
        Sum of outer products of the relative targets to learn from.
    """
    rank = answers.vectors.shape[1]
    learned, held = (Statistics.empty(len(answers.cases_by_node), terms, rank) for _ in range(2))
    spread = np.zeros((rank, rank))
    for node in np.flatnonzero(answers.cases_by_node).tolist():
        cases = answers.of_node(node)
        target = unknown(node, cases) / cases.norm[:, None]
        design = trunk(cases.point) / cases.norm[:, None]
        aside = validation[cases.position]
        for statistics, some in ((learned, ~aside), (held, aside)):
            if some.any():
                statistics.add(node, design[some], target[some])
        rows = np.concatenate([target[~aside].real, target[~aside].imag])
        spread += rows.T @ rows
    return learned, held, spread
