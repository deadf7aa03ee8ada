"""Regressors with scikit-learn from inputs to POD coefficients: neighbours, a Gaussian process, extremely random trees.

Each keeps plain arrays and answers from them, so that a file holds no pickle and needs no refit. Targets weigh by their
relative size, since errors are judged relative to each answer. Settings are chosen on a validation set by the median
relative miss, as everywhere.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp

NEIGHBOURS = (1, 2, 4, 8, 16)
POINT_SCALES = (0.5, 1.0, 2.0, 4.0)
"""How much frequency and loss factor count against position when neighbours are sought."""
TREES = 100
LEAVES = (1, 2, 4)
"""Fewest training cases of a leaf."""
LENGTH_CASES, LENGTH_TARGETS = 400, 24
"""Training cases and largest targets on which a Gaussian process finds its length scales: the likelihood costs the cube
of the former, its gradient their square times the latter."""
NOISE = 1e-8
"""Variance of a Gaussian process's noise relative to its own: what keeps its matrix regular."""


class Regressor(ABC):
    """From features to real targets; learnt once, then answered from :attr:`arrays` alone."""

    name: ClassVar[str]
    stored: ClassVar[tuple[str, ...]]
    """Names of its arrays."""

    def __init__(self) -> None:
        self.arrays: dict[str, np.ndarray] = {}

    @abstractmethod
    def fit(self, features: np.ndarray, target: np.ndarray, learn: np.ndarray, validate: np.ndarray) -> None:
        """Learn from all cases, with settings chosen by learning from some and validating with the others.

        Parameters
        ----------
        features : (n_case, d) ndarray
            The last two are the operating point.
        target : (n_case, q) ndarray
        learn, validate : ndarray of int
        """

    @abstractmethod
    def predict(self, features: np.ndarray) -> np.ndarray:
        """(n, q) ndarray at features (n, d)."""

    @property
    def nbytes(self) -> int:
        return sum(array.nbytes for array in self.arrays.values())

    def _choose(self, candidates, features: np.ndarray, target: np.ndarray, learn: np.ndarray, validate: np.ndarray
                ) -> None:
        """Try each candidate's settings, keep the best, learn from all cases with it."""
        size = np.linalg.norm(target[validate], axis=1)
        misses = []
        for settings in candidates:
            self._learn(features[learn], target[learn], settings)
            miss = np.linalg.norm(self.predict(features[validate]) - target[validate], axis=1)
            misses.append(float(np.median(miss / size)))
        self._learn(features, target, candidates[int(np.argmin(misses))])

    def _learn(self, features: np.ndarray, target: np.ndarray, settings: dict[str, Any]) -> None:
        raise NotImplementedError


class NearestNeighbours(Regressor):
    """Mean of the nearest training cases, weighted by the inverse of their distance."""

    name = "knn"
    stored = ("centre", "target", "factor", "neighbours")

    def fit(self, features, target, learn, validate) -> None:
        candidates = [{"neighbours": k, "scale": scale} for k in NEIGHBOURS if k <= len(learn)
                      for scale in POINT_SCALES]
        self._choose(candidates, features, target, learn, validate)

    def _learn(self, features, target, settings) -> None:
        factor = np.ones(features.shape[1])
        factor[-2:] = settings["scale"]
        self.arrays = {"centre": features * factor, "target": target, "factor": factor,
                       "neighbours": np.array(settings["neighbours"])}
        self._tree: Any = None

    def predict(self, features: np.ndarray) -> np.ndarray:
        from sklearn.neighbors import KNeighborsRegressor

        if getattr(self, "_tree", None) is None:  # after loading too: the tree is quickly grown from its points
            self._tree = KNeighborsRegressor(int(self.arrays["neighbours"]), weights="distance", algorithm="kd_tree")
            self._tree.fit(self.arrays["centre"], self.arrays["target"])
        return self._tree.predict(features * self.arrays["factor"])


class GaussianProcess(Regressor):
    """Mean of a Gaussian process with a squared-exponential kernel, a length scale for each feature."""

    name = "gp"
    stored = ("centre", "weight", "length")

    def fit(self, features, target, learn, validate) -> None:
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, WhiteKernel

        size = np.linalg.norm(target, axis=1)
        # each answer of unit size: one kernel of unit variance serves all
        unit = target / size.mean()
        few = np.random.default_rng(0).permutation(len(features))[:LENGTH_CASES]
        large = np.argsort(-unit.var(axis=0), kind="stable")[:LENGTH_TARGETS]
        dimensions = features.shape[1]
        kernel = RBF(np.full(dimensions, 0.5), (1e-2, 1e2)) + WhiteKernel(1e-4, (1e-10, 1.0))
        with warnings.catch_warnings():  # a feature that does not matter drives its length to the end of its range
            warnings.simplefilter("ignore", ConvergenceWarning)
            found = GaussianProcessRegressor(kernel).fit(features[few], unit[np.ix_(few, large)])
        length, noise = np.asarray(found.kernel_.k1.length_scale), float(found.kernel_.k2.noise_level)
        final = GaussianProcessRegressor(RBF(length), alpha=max(noise, NOISE) * (size / size.mean()) ** 2,
                                         optimizer=None)
        final.fit(features, unit)
        self.arrays = {"centre": features / length, "length": length,
                       "weight": np.ascontiguousarray(final.alpha_) * size.mean()}

    def predict(self, features: np.ndarray) -> np.ndarray:
        from sklearn.metrics.pairwise import rbf_kernel

        return rbf_kernel(features / self.arrays["length"], self.arrays["centre"], gamma=0.5) @ self.arrays["weight"]


class ExtraTrees(Regressor):
    """Mean over extremely random trees; leaves keep which training cases they hold, not values of their own."""

    name = "extra-trees"
    stored = ("root", "feature", "threshold", "left", "right", "leaf_start", "leaf_case", "leaf_share", "target")

    def fit(self, features, target, learn, validate) -> None:
        self._choose([{"leaf": leaf} for leaf in LEAVES], features, target, learn, validate)

    def _learn(self, features, target, settings) -> None:
        from sklearn.ensemble import ExtraTreesRegressor

        size = np.linalg.norm(target, axis=1)
        weight = (size.mean() / size) ** 2
        model = ExtraTreesRegressor(TREES, min_samples_leaf=settings["leaf"], random_state=0)
        model.fit(features, target, sample_weight=weight)
        trees = [estimator.tree_ for estimator in model.estimators_]
        start = np.concatenate([[0], np.cumsum([tree.node_count for tree in trees])])
        def joined(name: str, shift: bool) -> np.ndarray:
            return np.concatenate([getattr(tree, name) + (start[i] if shift else 0) for i, tree in enumerate(trees)])

        where = (model.apply(features) + start[:-1]).ravel()
        case = np.repeat(np.arange(len(features)), TREES)
        members = sp.csr_array((weight[case], (where, case)), shape=(start[-1], len(features)))
        total = np.asarray(members.sum(axis=1)).ravel()
        members.data /= np.repeat(total, np.diff(members.indptr))
        self.arrays = {
            "root": start[:-1].copy(), "feature": joined("feature", False), "threshold": joined("threshold", False),
            "left": joined("children_left", True), "right": joined("children_right", True),
            "leaf_start": members.indptr.astype(np.int64), "leaf_case": members.indices.astype(np.int64),
            "leaf_share": members.data, "target": target}

    def predict(self, features: np.ndarray) -> np.ndarray:
        a = self.arrays
        values = features.astype(np.float32)  # as scikit-learn compares
        place = np.tile(a["root"], (len(features), 1))
        row = np.broadcast_to(np.arange(len(features))[:, None], place.shape)
        while True:
            feature = a["feature"][place]
            inner = feature >= 0
            if not inner.any():
                break
            below = values[row, np.maximum(feature, 0)] <= a["threshold"][place]
            place = np.where(inner, np.where(below, a["left"][place], a["right"][place]), place)
        leaves = place.ravel()
        first, count = a["leaf_start"][leaves], np.diff(a["leaf_start"])[leaves]
        entry = np.repeat(first - np.concatenate([[0], np.cumsum(count)[:-1]]), count) + np.arange(count.sum())
        owner = np.repeat(row.ravel(), count)
        shares = sp.csr_array((a["leaf_share"][entry] / len(a["root"]), (owner, a["leaf_case"][entry])),
                              shape=(len(features), len(a["target"])))
        return shares @ a["target"]


REGRESSORS: dict[str, type[Regressor]] = {kind.name: kind for kind in (NearestNeighbours, GaussianProcess, ExtraTrees)}
"""Beside ``ridge``, which :mod:`rom.metamodels.regression` itself is."""
