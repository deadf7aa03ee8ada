"""What harmonic networks learn from: answers to unit forces, node by node, in coordinates of a POD basis.

The published set has 2,700 operating points at each of 239 nodes. Read node by node it never needs more memory than one
node's cases, whether it lies whole in memory or reduced on disk. Answers are (1 + i eta) u / F, functions of the node
and of s = omega^2 / (1 + i eta) alone, and as smooth in frequency and loss factor as the mechanics allows.
"""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr

from rom.datasets.reduced import ReducedField
from rom.metamodels.pod import pod_of
from rom.metamodels.pod_space import PodSpace, pod
from rom.scenes import LinearScene

POD_CASES = 1200
"""Cases of a set on disk, spread over the nodes, from which its POD basis is made."""
ADDED = 1e-6
"""Share of a known shape that a basis may lack."""
POD_RANK = 400
"""POD modes in which a set on disk is read: on the published set they lose less than 1e-3 of any answer."""


@dataclass(frozen=True)
class NodeCases:
    """The training cases of one node.

    point : (n, 2) ndarray
        Frequency [Hz] and loss factor.
    answer : (n, R) ndarray, complex [m N^-1]
        (1 + i eta) u / F in POD coordinates.
    norm : (n,) ndarray [m N^-1]
        ``||(1 + i eta) u / F||`` of the whole field.
    position : (n,) ndarray of int
        Of each case in the training set.
    """

    point: np.ndarray
    answer: np.ndarray
    norm: np.ndarray
    position: np.ndarray

    def __len__(self) -> int:
        return len(self.point)

    def take(self, index: np.ndarray) -> NodeCases:
        return NodeCases(self.point[index], self.answer[index], self.norm[index], self.position[index])


class UnitAnswers(ABC):
    """A training set by nodes.

    Attributes
    ----------
    vectors : (n_free, R) ndarray
        The POD basis, orthonormal columns by falling singular value.
    count : int
        Number of training cases.
    digest : str
        Of which cases they are.
    seconds : float
        What reading and decomposing took that an earlier fit has paid [s].
    """

    vectors: np.ndarray
    count: int
    seconds: float = 0.0

    def __init__(self, scene: LinearScene, node: np.ndarray) -> None:
        order = np.argsort(node, kind="stable")
        edges = np.searchsorted(node[order], np.arange(scene.n_loads + 1))
        self._positions = [order[a:b] for a, b in pairwise(edges)]
        self.count = len(node)
        self.digest = ""

    @property
    def cases_by_node(self) -> np.ndarray:
        """(n_load,) ndarray of int: number of cases of each pad node."""
        return np.array([len(position) for position in self._positions])

    @abstractmethod
    def of_node(self, node: int) -> NodeCases:
        """The cases of the pad node in row ``node``."""


class AnswersInMemory(UnitAnswers):
    """Unit answers of a labelled training dataset.

    Parameters
    ----------
    scene : LinearScene
        With one force a case.
    train : xr.Dataset
    shapes : (m, n_free) ndarray
        What the basis has to hold beside the POD modes.
    """

    def __init__(self, scene: LinearScene, train: xr.Dataset, shapes: np.ndarray) -> None:
        arrays, values = scene.read(train), scene.values(train)
        moving = np.flatnonzero((np.linalg.norm(values, axis=1) > 0) & (arrays.force[:, 0] != 0))
        if len(moving) < 2:
            raise ValueError(f"{len(moving)} training case is too few for a network: give at least two that move")
        super().__init__(scene, arrays.node[moving, 0])
        space, self.seconds = pod_of(scene, train)
        self.vectors = widened(space.vectors, shapes)
        unit = values[moving] * ((1.0 + 1j * arrays.loss_factor[moving]) / arrays.force[moving, 0])[:, None]
        self._answer, self._norm = unit @ self.vectors, np.linalg.norm(unit, axis=1)
        self._point = np.column_stack([arrays.frequency[moving], arrays.loss_factor[moving]])
        self.digest = hashlib.sha256(arrays.node[moving].tobytes() + self._point.tobytes()).hexdigest()

    def of_node(self, node: int) -> NodeCases:
        at = self._positions[node]
        return NodeCases(self._point[at], self._answer[at], self._norm[at], at)


class AnswersOnDisk(UnitAnswers):
    """Unit answers of cases of a dataset that is stored reduced.

    Parameters
    ----------
    scene : LinearScene
    field : ReducedField
    cases : (n,) ndarray of int
        Positions of the training cases in the dataset; nothing else of it is read.
    shapes : (m, n_free) ndarray
        What the basis has to hold beside the POD modes.
    seed : int
        Draws the cases of the POD basis.
    """

    def __init__(self, scene: LinearScene, field: ReducedField, cases: np.ndarray, shapes: np.ndarray, seed: int = 0
                 ) -> None:
        super().__init__(scene, field.load[cases])
        self._field, self._cases = field, cases
        self.digest = hashlib.sha256(np.ascontiguousarray(cases, dtype=np.int64).tobytes()).hexdigest()
        rng = np.random.default_rng([seed, 31])
        each = -(-POD_CASES // scene.n_loads)
        chosen = np.concatenate([cases[rng.permutation(position)[:each]] for position in self._positions])
        space: PodSpace = pod(field.fields(np.sort(chosen)))
        self.vectors = widened(space.vectors[:, :POD_RANK], shapes)

    def of_node(self, node: int) -> NodeCases:
        cases = self._cases[self._positions[node]]
        factor, arrays = self._field.stiffness[cases] / self._field.force[cases], self._field.arrays(cases)
        return NodeCases(
            np.column_stack([arrays.frequency, arrays.loss_factor]),
            self._field.project(self.vectors, cases) * factor[:, None],
            self._field.norms(cases) * np.abs(factor), self._positions[node])


def widened(vectors: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """(n_free, R + m) ndarray: orthonormal ``vectors`` (n_free, R) and what rows of ``shapes`` (m, n_free) add to them.

    What is taken from an answer has to lie in the basis as wholly as the answer does, or the rest would not.
    """
    size = np.linalg.norm(shapes, axis=1)
    rest = (shapes[size > 0] / size[size > 0, None]).T
    if not rest.size:
        return vectors
    for _ in range(2):  # twice is enough (Parlett 1980)
        rest = rest - vectors @ (vectors.T @ rest)
    u, singular, _ = np.linalg.svd(rest, full_matrices=False)
    return np.concatenate([vectors, u[:, singular > ADDED]], axis=1)


def random_validation(answers: UnitAnswers, seed: int, fraction: float = 0.1) -> np.ndarray:
    """(n_case,) ndarray of bool: random cases kept from learning, to choose settings by."""
    rng = np.random.default_rng([seed, 32])
    validation = rng.random(answers.count) < fraction
    validation[rng.integers(answers.count)] = True
    return validation


def split_validation(answers: UnitAnswers, seed: int, fraction: float = 0.1) -> np.ndarray:
    """(n_case,) ndarray of bool: whole nodes where some pad nodes have no case, since those are then to be answered
    too; random cases otherwise."""
    number = answers.cases_by_node
    if (number > 0).all():
        return random_validation(answers, seed, fraction)
    seen = np.flatnonzero(number)
    chosen = np.random.default_rng([seed, 35]).choice(seen, max(1, round(fraction * len(seen))), replace=False)
    validation = np.zeros(answers.count, dtype=bool)
    for node in chosen.tolist():
        validation[answers.of_node(node).position] = True
    return validation
