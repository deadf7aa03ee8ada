"""Small models on which bounds may fail: clusters, cancellation, weak holds, scales from 1e-30 to 1e30."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from rom.bodies import Body, Loads
from rom.scenes import CaseArrays, LinearScene

KINDS = ("chain", "dense", "copies", "cluster", "weakly held", "badly scaled", "diagonal", "stiff parts")
LOSS_FACTORS = (0.0, 1e-12, 1e-6, 1e-3, 0.05, 0.1, 0.5, 1.0, 30.0)


@dataclass(frozen=True)
class SmallModel:
    """A drawn model.

    Parameters
    ----------
    seed : int
    kind : str
        Of :data:`KINDS`.
    stiffness, mass : (n, n) ndarray
    loads : (n, n_load) ndarray
    """

    seed: int
    kind: str
    stiffness: np.ndarray
    mass: np.ndarray
    loads: np.ndarray

    def scene(self, harmonic: bool) -> LinearScene:
        """Its scene, at rest or vibrating."""
        mass = sp.csr_array(self.mass) if harmonic else None
        body = Body(sp.csr_array(self.stiffness), mass, name=self.kind)
        band = (0.0, 2.0 * float(np.sqrt(np.max(self.stiffness.diagonal() / self.mass.diagonal()))))
        options = {"frequency": band, "loss_factor": (0.05, 0.5)} if harmonic else {}
        return LinearScene(body, Loads.named(self.loads, [f"load {i}" for i in range(self.loads.shape[1])]), **options)


def draw(seed: int, largest: int = 40) -> SmallModel:
    """The model of a seed, of 3 to about ``largest`` degrees of freedom."""
    rng = np.random.default_rng([seed, 14])
    kind = KINDS[int(rng.integers(len(KINDS)))]
    n = int(rng.integers(3, largest + 1))
    stiffness, mass = _matrices(kind, n, rng)
    if rng.random() < 0.3:
        stiffness, mass = (matrix * 10.0 ** rng.uniform(-30, 30) for matrix in (stiffness, mass))
    n = len(stiffness)
    return SmallModel(seed, kind, stiffness, mass, _loads(n, int(rng.integers(1, 6)), rng))


def _chain(n: int, rng: np.random.Generator, spread: float = 1.0) -> np.ndarray:
    """Springs from dof to dof, some to others further away, and a few to the ground."""
    matrix = np.zeros((n, n))
    pairs = [(i, i + 1) for i in range(n - 1)] + [tuple(rng.choice(n, 2, replace=False)) for _ in range(n // 3)]
    for i, j in pairs:
        spring = 10.0 ** rng.uniform(-spread, spread)
        matrix[[i, j], [i, j]] += spring
        matrix[[i, j], [j, i]] -= spring
    return _held(matrix, rng, 1.0)


def _held(matrix: np.ndarray, rng: np.random.Generator, strength: float) -> np.ndarray:
    where = rng.choice(len(matrix), max(1, len(matrix) // 5), replace=False)
    matrix[where, where] += strength * rng.uniform(0.5, 2.0, len(where))
    return matrix


def _dense(n: int, rng: np.random.Generator) -> np.ndarray:
    factor = rng.standard_normal((n, n))
    return _symmetric(factor @ factor.T / n + 10.0 ** rng.uniform(-6, 0) * np.eye(n))


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return np.tril(matrix) + np.tril(matrix, -1).T


def _mass(n: int, rng: np.random.Generator) -> np.ndarray:
    if rng.random() < 0.5:
        return np.diag(10.0 ** rng.uniform(-1, 1, n))
    mass = np.diag(rng.uniform(2.0, 4.0, n))
    for i in range(n - 1):
        mass[i, i + 1] = mass[i + 1, i] = rng.uniform(0.0, 0.9)
    return mass


def _matrices(kind: str, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    if kind == "dense":
        return _dense(n, rng), _mass(n, rng)
    if kind == "diagonal":
        return np.diag(10.0 ** rng.uniform(-3, 3, n)), np.diag(10.0 ** rng.uniform(-3, 3, n))
    if kind == "copies":  # exactly repeated modes
        size = max(1, n // int(rng.integers(2, 5)))
        block, inert = _chain(size, rng) if size > 1 else np.ones((1, 1)), _mass(size, rng)
        copies = max(2, n // size)
        return np.kron(np.eye(copies), block), np.kron(np.eye(copies), inert)
    if kind == "cluster":  # nearly repeated ones, coupled a little
        size = max(2, n // 3)
        block, inert = _chain(size, rng), _mass(size, rng)
        off = 10.0 ** rng.uniform(-14, -3)
        stiffness = np.kron(np.eye(3), block)
        for i in range(3):
            stiffness[i * size, i * size] *= 1.0 + i * off
        spring = off * stiffness[0, 0]
        stiffness[[0, size], [0, size]] += spring
        stiffness[[0, size], [size, 0]] -= spring
        return stiffness, np.kron(np.eye(3), inert)
    stiffness, mass = _chain(n, rng, 1.0 if kind == "chain" else 2.0), _mass(n, rng)
    if kind == "weakly held":
        matrix = np.zeros((n, n))
        for i in range(n - 1):
            spring = rng.uniform(0.5, 2.0)
            matrix[[i, i + 1], [i, i + 1]] += spring
            matrix[[i, i + 1], [i + 1, i]] -= spring
        return _held(matrix, rng, 10.0 ** rng.uniform(-13, -2)), mass
    if kind == "badly scaled":  # other units for every degree of freedom
        scale = np.exp2(np.round(rng.uniform(-1, 1, n) * rng.uniform(2, 24)))
        return stiffness * np.outer(scale, scale), mass * np.outer(scale, scale)
    if kind == "stiff parts":
        scale = np.where(rng.random(n) < 0.3, 10.0 ** rng.uniform(2, 8), 1.0)
        return _symmetric(stiffness + np.diag(scale * stiffness.diagonal())), mass
    return stiffness, mass


def _loads(n: int, count: int, rng: np.random.Generator) -> np.ndarray:
    columns = np.zeros((n, count))
    for j in range(count):
        what = rng.random()
        if j and what < 0.2:  # nearly another one
            columns[:, j] = columns[:, j - 1] * (1.0 + 10.0 ** rng.uniform(-15, -3) * rng.standard_normal(n))
        elif what < 0.6:
            columns[rng.integers(n), j] = rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 3.0)
        else:
            columns[:, j] = rng.standard_normal(n) * 10.0 ** rng.uniform(-2, 2)
    return columns


def draw_cases(model: SmallModel, count: int, eigenvalue: np.ndarray | None = None) -> CaseArrays:
    """Cases of a model: one or several forces, some that nearly cancel; frequencies at, near and far from resonances.

    Parameters
    ----------
    model : SmallModel
    count : int
    eigenvalue : (n,) ndarray, optional
        Of the model; without them the cases are static.
    """
    rng = np.random.default_rng([model.seed, 15])
    n_load, forces = model.loads.shape[1], int(rng.integers(1, 4))
    node = rng.integers(n_load, size=(count, forces))
    force = rng.uniform(0.1, 1.0, (count, forces)) * rng.choice([-1.0, 1.0], (count, forces))
    for i in range(count):
        if forces > 1 and rng.random() < 0.4:  # opposed but for a rest, at one load or at two alike
            node[i, 1] = node[i, 0] if rng.random() < 0.5 else node[i, 1]
            force[i, 1] = -force[i, 0] * (1.0 - rng.choice([0.0, 1e-15, 1e-12, 1e-8, 1e-3]))
    if rng.random() < 0.2:
        force = force * 10.0 ** rng.uniform(-90, 90)
    if eigenvalue is None:
        return CaseArrays(node, force)
    if rng.random() < 0.3:
        force = force * np.exp(2j * np.pi * rng.random(force.shape))
    near = np.sqrt(np.abs(rng.choice(eigenvalue, count))) / (2 * np.pi)
    frequency = np.where(rng.random(count) < 0.4, near * (1.0 + rng.choice(
        [0.0, 1e-15, 1e-10, 1e-6, 1e-3, 0.3], count) * rng.choice([-1.0, 1.0], count)),
        rng.uniform(0.0, 1.5, count) * np.sqrt(np.median(np.abs(eigenvalue))) / (2 * np.pi))
    frequency = np.where(rng.random(count) < 0.1, 0.0, frequency)
    return CaseArrays(node, force, frequency, rng.choice(LOSS_FACTORS, count))
