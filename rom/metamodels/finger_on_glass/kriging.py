"""Regression of many outputs over few inputs: Gaussian process, ridge, neighbours; plain arrays throughout.

All outputs share the hyperparameters of the Gaussian process (a separable covariance), so that one Cholesky factor
serves them all and the likelihood has a closed form (Rasmussen and Williams, Gaussian Processes for Machine Learning,
2006, ch. 5; the signal's variance is eliminated).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NUGGET = (1e-7, 1.0)
"""Variance of what the process leaves unexplained, over the signal's."""
LENGTH = (0.05, 400.0)
"""Length scales, in standard deviations of each input."""
RIDGES = tuple(10.0 ** k for k in range(-6, 2))
NEIGHBOURS = (2, 3, 4, 5, 6, 8)


def matern(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(n, m) ndarray: Matern covariance of smoothness 5/2 between scaled inputs (n, d) and (m, d)."""
    r = np.sqrt(5.0 * np.maximum(((left[:, None] - right[None]) ** 2).sum(axis=-1), 0.0))
    return (1.0 + r + r * r / 3.0) * np.exp(-r)


@dataclass(eq=False)
class Regressor:
    """What is learned, as arrays.

    Parameters
    ----------
    kind : {"gp", "ridge", "knn"}
    centre, scale : (d,) ndarray
        Of the inputs; the scale is the process's length scale in each.
    inputs : (n, d) ndarray
        Scaled inputs of the training points.
    weights : (n or n_feature, m) ndarray
        Multiplies covariances, polynomial features or the neighbours' shares.
    number : float
        Nugget, ridge, or count of neighbours.
    """

    kind: str
    centre: np.ndarray
    scale: np.ndarray
    inputs: np.ndarray
    weights: np.ndarray
    number: float

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(k, m) ndarray of outputs at inputs (k, d)."""
        scaled = (points - self.centre) / self.scale
        if self.kind == "gp":
            return matern(scaled, self.inputs) @ self.weights
        if self.kind == "ridge":
            return quadratic(scaled) @ self.weights
        return _shares(scaled, self.inputs, int(self.number)) @ self.weights

    @property
    def nbytes(self) -> int:
        return self.inputs.nbytes + self.weights.nbytes


def fit_regressor(kind: str, points: np.ndarray, outputs: np.ndarray) -> Regressor:
    """Learn (n, m) outputs, of mean zero, at (n, d) points; the one free number by likelihood or leaving one out."""
    centre, scale = points.mean(axis=0), np.maximum(points.std(axis=0), 1e-9)
    scaled = (points - centre) / scale
    if kind == "gp":
        length, nugget = most_likely(scaled, outputs)
        scaled = scaled / length
        covariance = matern(scaled, scaled) + nugget * np.eye(len(points))
        return Regressor(kind, centre, scale * length, scaled, np.linalg.solve(covariance, outputs), nugget)
    if kind == "ridge":
        features = quadratic(scaled)
        errors = [_ridge_left_out(features, outputs, ridge) for ridge in RIDGES]
        ridge = RIDGES[int(np.argmin(errors))]
        gram = features.T @ features + ridge * len(points) * np.eye(features.shape[1])
        return Regressor(kind, centre, scale, scaled, np.linalg.solve(gram, features.T @ outputs), ridge)
    counts = [k for k in NEIGHBOURS if k < len(points)]
    missed = [np.square(_shares(scaled, scaled, k, leave_out=True) @ outputs - outputs).sum() for k in counts]
    return Regressor(kind, centre, scale, scaled, outputs, float(counts[int(np.argmin(missed))]))


def most_likely(points: np.ndarray, outputs: np.ndarray) -> tuple[np.ndarray, float]:
    """Length scales (d,) and nugget that make the outputs most likely, by quasi-Newton from one start."""
    from scipy.linalg import cho_factor, cho_solve
    from scipy.optimize import minimize

    n, d = points.shape
    # the likelihood sees the outputs through their Gram matrix alone
    gram = outputs @ outputs.T / outputs.shape[1]
    gram = gram / max(np.trace(gram) / n, 1e-300)
    difference = points[:, None] - points[None]

    def minus(theta: np.ndarray) -> tuple[float, np.ndarray]:
        length, nugget = np.exp(theta[:d]), np.exp(theta[d])
        squares = (difference / length) ** 2
        r = np.sqrt(5.0 * squares.sum(axis=-1))
        decay = np.exp(-r)
        factor = cho_factor((1.0 + r + r * r / 3.0) * decay + nugget * np.eye(n), lower=True)
        inverse = cho_solve(factor, np.eye(n))
        misfit = inverse @ gram
        total = float(np.trace(misfit))
        value = 0.5 * n * np.log(total) + float(np.log(np.diag(factor[0])).sum())
        slope = 0.5 * inverse - 0.5 * n / total * (misfit @ inverse)
        common = 5.0 / 3.0 * (1.0 + r) * decay
        by_length = np.einsum("ij,ij,ijk->k", slope, common, squares)
        return value, np.append(by_length, nugget * np.trace(slope))

    start = np.append(np.full(d, np.log(3.0)), np.log(1e-3))
    bounds = [tuple(np.log(LENGTH))] * d + [tuple(np.log(NUGGET))]
    found = minimize(minus, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 200})
    return np.exp(found.x[:d]), float(np.exp(found.x[d]))


def quadratic(points: np.ndarray) -> np.ndarray:
    """(n, 1 + d + d (d + 1) / 2) ndarray: all monomials up to the second degree."""
    i, j = np.triu_indices(points.shape[1])
    return np.column_stack([np.ones(len(points)), points, points[:, i] * points[:, j]])


def _ridge_left_out(features: np.ndarray, outputs: np.ndarray, ridge: float) -> float:
    """Sum of squared errors where each point is predicted from the others."""
    gram = features.T @ features + ridge * len(features) * np.eye(features.shape[1])
    hat = features @ np.linalg.solve(gram, features.T)
    left = np.maximum(1.0 - np.diag(hat), 1e-9)
    return float(np.square((outputs - hat @ outputs) / left[:, None]).sum())


def _shares(points: np.ndarray, known: np.ndarray, count: int, leave_out: bool = False) -> np.ndarray:
    """(n, m) ndarray: shares of the ``count`` nearest known points, by inverse square distance."""
    distance = np.linalg.norm(points[:, None] - known[None], axis=2)
    if leave_out:
        np.fill_diagonal(distance, np.inf)
    near = np.argsort(distance, axis=1, kind="stable")[:, :count]
    weight = 1.0 / np.maximum(np.take_along_axis(distance, near, axis=1), 1e-12) ** 2
    shares = np.zeros_like(distance)
    np.put_along_axis(shares, near, weight / weight.sum(axis=1, keepdims=True), axis=1)
    return shares
