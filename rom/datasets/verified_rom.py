"""Galerkin answers that are as good as direct ones, and the proof: the true residual in every case.

Modes that all loads share and load-dependent vectors of each (:mod:`rom.fullorder.load_vectors`); with 40 and 10 of
them the residual of a load on the fingertip's pad stays near what rounding leaves of a direct solve.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import xarray as xr

from rom.datasets.storage import read_netcdf, write_netcdf
from rom.errors import SolverError
from rom.files import is_intact
from rom.fullorder import Modes, SecondOrderModel
from rom.fullorder.load_vectors import load_vectors
from rom.fullorder.poles import Poles, operating_points
from rom.scenes import LinearScene

RESIDUAL_LIMIT = 1e-8
"""Largest true relative residual of a case that is stored."""


def kept_modes(scene: LinearScene, count: int, path: Path) -> Modes:
    """The shared modes, computed once and kept: pieces of different runs must build on the same."""
    if not is_intact(path):
        found = scene.model.natural_modes(count=min(count, scene.n_free - 1))
        write_netcdf(xr.Dataset({"shape": (("dof", "mode"), found.shape), "eigenvalue": ("mode", found.eigenvalue)},
                                attrs={"bound": found.next_eigenvalue_bound}), path)
    data = read_netcdf(path)
    bound = float(data.attrs["bound"])
    value, shape = data["eigenvalue"].values, data["shape"].values
    return Modes(value, shape, np.zeros(len(value)), len(value), bound, bound)


def make_piece(scene: LinearScene, modes: Modes, loads: np.ndarray, vectors: int, points: np.ndarray, path: Path
               ) -> None:
    """Vectors, poles and true residuals of the unit loads ``loads`` at all ``points`` (n_point, 2), as a file.

    Raises
    ------
    SolverError
        Where a residual exceeds :data:`RESIDUAL_LIMIT`.
    """
    start = time.perf_counter()
    unit = np.ascontiguousarray(scene.unit_loads[:, loads])
    found = load_vectors(scene.model, modes, unit, vectors)
    participation = unit.T @ modes.shape
    residual = np.empty((len(loads), len(points)))
    difference = np.empty_like(residual)
    check = ResidualCheck(scene.model, modes.shape)
    for i in range(len(loads)):
        own = np.ascontiguousarray(found.vectors[i].T)
        coefficients = pole_coefficients(modes.eigenvalue, participation[i], found.theta[i], found.first[i], points)
        residual[i] = check.residuals(own, unit[:, i], coefficients, points)
        difference[i] = single_precision_errors(np.concatenate([modes.shape, own], axis=1), coefficients)
    if not residual.max() <= RESIDUAL_LIMIT:
        i, k = divmod(int(np.argmax(residual)), residual.shape[1])
        raise SolverError(f"load {loads[i]} at {points[k, 0]:g} Hz and loss factor {points[k, 1]:g} is answered with "
                          f"the relative residual {residual[i, k]:.1e}, above {RESIDUAL_LIMIT:g}: give more modes or "
                          "more vectors")
    write_netcdf(xr.Dataset({
        "vector": (("load", "vector", "dof"), found.vectors), "theta": (("load", "vector"), found.theta),
        "share": (("load", "vector"), found.first), "participation": (("load", "mode"), participation),
        "residual": (("load", "point"), residual), "difference": (("load", "point"), difference)},
        attrs={"seconds": time.perf_counter() - start}), path)


def pole_coefficients(eigenvalue: np.ndarray, participation: np.ndarray, theta: np.ndarray, share: np.ndarray,
                      points: np.ndarray) -> np.ndarray:
    """(n_point, m + p) ndarray, complex: coefficients of one unit load's answers."""
    point = operating_points(*points.T)
    return np.concatenate([Poles.of_modes(eigenvalue).at(participation, *point),
                           Poles.of_vectors(theta).at(share, *point)], axis=1)


class ResidualCheck:
    """``||Z u - f|| / ||f||`` of many answers ``u = shapes @ c`` to one force after another.

    ``Z u - f`` lies in the span of ``[K shapes, M shapes, f]``; its norm is taken from that block's triangular factor,
    which loses nothing to cancellation beyond rounding of the block itself, where a Gram matrix would lose half of the
    digits. What all forces share is factorised once.

    Parameters
    ----------
    model : SecondOrderModel
        Without a loss stiffness.
    shared : (n, m) ndarray
        The shapes of every answer.
    """

    def __init__(self, model: SecondOrderModel, shared: np.ndarray) -> None:
        self.model, self.m = model, shared.shape[1]
        self.q, self.r = np.linalg.qr(np.concatenate([model.stiffness @ shared, model.mass @ shared], axis=1))

    def residuals(self, own: np.ndarray, force: np.ndarray, coefficients: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Residuals of the answers to one force.

        Parameters
        ----------
        own : (n, p) ndarray
            Shapes of these answers alone.
        force : (n,) ndarray [N]
        coefficients : (n_point, m + p) ndarray
        points : (n_point, 2) ndarray
            Frequency [Hz] and loss factor.

        Returns
        -------
        (n_point,) ndarray
        """
        block = np.concatenate([self.model.stiffness @ own, self.model.mass @ own, force[:, None]], axis=1)
        head = self.q.T @ block
        block -= self.q @ head
        again = self.q.T @ block  # twice is enough
        block -= self.q @ again
        tail = np.asarray(np.linalg.qr(block, mode="r"))
        stiffness, inertia = operating_points(*points.T)
        shared, rest = coefficients[:, :self.m], coefficients[:, self.m:]
        shared = np.concatenate([stiffness * shared, -inertia * shared], axis=1)
        rest = np.concatenate([stiffness * rest, -inertia * rest, np.full((len(points), 1), -1.0)], axis=1)
        along, beside = shared @ self.r.T + rest @ (head + again).T, rest @ tail.T
        return np.hypot(np.linalg.norm(along, axis=1), np.linalg.norm(beside, axis=1)) / np.linalg.norm(force)


def single_precision_errors(shapes: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """(n_point,) ndarray: relative change of ``u = shapes @ c`` where the shapes (n, r) are rounded to float32."""
    lost = shapes.astype(np.float32) - shapes
    miss, whole = (np.sqrt(np.einsum("pi,pi->p", coefficients.conj() @ gram, coefficients).real)
                   for gram in (lost.T @ lost, shapes.T @ shapes))
    return miss / whole
