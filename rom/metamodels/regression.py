"""POD coefficients by regression with scikit-learn: no full-order model needed after the snapshots.

Statics: the answer is linear in the forces, so the features are radial functions of the loaded positions weighted by
the forces, and ridge regression on them is linear in the forces too. Harmonics: kernel ridge regression on position,
normal, frequency and loss factor, for a unit force; the amplitude multiplies exactly. Other regressors take the same
inputs (:mod:`rom.metamodels.regressors`).
"""

from __future__ import annotations

from itertools import product
from typing import ClassVar

import numpy as np
import xarray as xr

from rom.datasets.splits import carve_validation
from rom.metamodels.basis import Basis, check_precision, combine
from rom.metamodels.facts import Curve, Needs
from rom.metamodels.linear import not_linear
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.pod import pod_of
from rom.metamodels.regressors import REGRESSORS, Regressor
from rom.metamodels.stored import Stored
from rom.scenes import CaseArrays, LinearScene, Scene

WIDTHS = (0.15, 0.3, 0.6, 1.2)
RIDGES = (1e-9, 1e-6, 1e-3)


class PodRegression(Metamodel):
    """Ridge (statics) or kernel ridge regression (harmonics) of POD coefficients, or another regressor.

    Parameters
    ----------
    rank : int, optional
        Number of POD modes; default: all that the snapshots span.
    width : float, optional
        Of the radial functions: over the pad's size in statics, over the scaled inputs in harmonics. Default: the best
        of :data:`WIDTHS` on a validation set carved from the training cases.
    ridge : float, optional
        Regularisation; default: the best of :data:`RIDGES` likewise.
    regressor : {"ridge", "knn", "gp", "extra-trees"}
        All but ridge, which alone is linear in the forces, answer the harmonic scene only.
    """

    name: ClassVar[str] = "pod-regression"
    summary: ClassVar[str] = "learns POD coefficients from snapshots by (kernel) ridge or another regression"
    colour: ClassVar[str] = "#44AA99"
    stored: ClassVar[tuple[Stored, ...]] = (
        Stored("_basis", ("rank", "dof"), "POD mode"), Stored("_learned"), Stored("_width"))
    learns: ClassVar[bool] = True
    _basis: Basis
    _width: float = 0.0
    """Of the radial functions; 0 where there are none."""

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        return not_linear(scene) or scene.not_spatial()  # type: ignore[attr-defined]

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        if not scene.harmonic:
            return Curve(({"rank": 60}, {"rank": None}))
        return Curve((*({"rank": rank} for rank in (50, 100, 200)),
                      *({"regressor": name, "rank": 200} for name in REGRESSORS)), headline=2)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        if not scene.harmonic:
            return Curve(({"rank": None},))
        return Curve(({"rank": 40}, *({"regressor": name, "rank": 40} for name in REGRESSORS)), headline=0)

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(stiffness=False, regression=True)

    def __init__(self, scene: LinearScene, rank: int | None = None, width: float | None = None,
                 ridge: float | None = None,
                 precision: str = "float64", regressor: str = "ridge") -> None:
        if not isinstance(regressor, str) or regressor not in ("ridge", *REGRESSORS):
            raise ValueError(f"regressor={regressor!r} is unknown: choose one of ridge, {', '.join(REGRESSORS)}")
        if regressor != "ridge" and (width is not None or ridge is not None):
            raise ValueError(f"width and ridge are settings of the regressor ridge, not of {regressor}: leave them out")
        if (rank is not None and rank < 1) or (width is not None and width <= 0) or (ridge is not None and ridge < 0):
            raise ValueError(f"rank={rank}, width={width}, ridge={ridge} cannot be: give a rank of one or more, a "
                             "positive width, a ridge of zero or more")
        super().__init__(scene, rank=rank, width=width, ridge=ridge, precision=check_precision(precision),
                         regressor=regressor)
        if regressor != "ridge" and not scene.harmonic:
            raise ValueError(f"regressor={regressor!r} is not linear in several forces: {scene.name} takes ridge alone")
        self._other: Regressor | None = None

    @property
    def _learned_bytes(self) -> int:
        return self._centres.nbytes + self._weights.nbytes if self._other is None else self._other.nbytes

    @property
    def model_bytes(self) -> int:
        return self._basis.nbytes + self._learned_bytes

    @property
    def online_bytes(self) -> int:
        return self._basis.field.nbytes + (self._weights.nbytes if self._other is None else 0)

    # ---- features -------------------------------------------------------------------------------------------

    def _features(self, cases: CaseArrays, j: int = 0) -> np.ndarray:
        """(n_case, d) ndarray of the inputs of each case's force number ``j``, scaled to about one."""
        node = cases.node[:, j]
        position = self.scene.loads.position
        places = np.concatenate([position / np.ptp(position, axis=0).max(), 0.3 * self.scene.loads.direction], axis=1)
        if not self.scene.harmonic:
            return places[node]
        return np.column_stack([places[node], cases.frequency / 100.0, cases.loss_factor / 0.5])

    def _kernel(self, features: np.ndarray) -> np.ndarray:
        from sklearn.metrics.pairwise import rbf_kernel

        return rbf_kernel(features, self._centres, gamma=0.5 / self._width ** 2)

    def _design(self, cases: CaseArrays) -> np.ndarray:
        """(n_case, n_centre) ndarray: kernel values weighted by the forces."""
        if self.scene.harmonic:
            return sum(self._kernel(self._features(cases, j)) * cases.force[:, j:j + 1]
                       for j in range(cases.node.shape[1]))
        table = self._kernel(self._features(self._each_load()))
        return np.einsum("cf,cfk->ck", cases.force, table[cases.node])

    def _each_load(self) -> CaseArrays:
        n = self.scene.n_loads
        return CaseArrays(np.arange(n)[:, None], np.ones((n, 1)))

    # ---- the metamodel --------------------------------------------------------------------------------------

    def _fit(self, train: xr.Dataset) -> None:
        space, self.borrowed_seconds = pod_of(self.scene, train)
        vectors = space.truncated(self.settings["rank"])
        arrays = self.scene.read(train)
        if self.scene.harmonic and arrays.force.shape[1] > 1:
            raise ValueError(f"{self.name} learns harmonic cases of one force each: split those with several")
        coefficients = self.scene.values(train) @ vectors
        learn, validate = carve_validation(len(arrays))
        self._basis = Basis(vectors.T, self.scene.part_rows, self.settings["precision"])
        if self.settings["regressor"] != "ridge":
            self._other = REGRESSORS[self.settings["regressor"]]()
            target = coefficients / arrays.force
            self._other.fit(self._features(arrays), np.concatenate([target.real, target.imag], axis=1), learn, validate)
            return
        size = np.linalg.norm(coefficients[validate], axis=1)
        best = np.inf, WIDTHS[0], RIDGES[0]
        for width, ridge in product(self._choices("width", WIDTHS), self._choices("ridge", RIDGES)):
            self._regress(arrays.take(learn), coefficients[learn], width, ridge)
            miss = np.linalg.norm(self._coefficients(arrays.take(validate)) - coefficients[validate], axis=1)
            best = min(best, (float(np.median(miss / size)), width, ridge))
        self._regress(arrays, coefficients, *best[1:])

    def _choices(self, name: str, candidates: tuple[float, ...]) -> tuple[float, ...]:
        return candidates if self.settings[name] is None else (self.settings[name],)

    def _regress(self, arrays: CaseArrays, coefficients: np.ndarray, width: float, ridge: float) -> None:
        """Weights for the given width and ridge, each case weighing by its relative error."""
        from sklearn.kernel_ridge import KernelRidge
        from sklearn.linear_model import Ridge

        self._width = width
        if self.scene.harmonic:
            self._centres = self._features(arrays)
            target = coefficients / arrays.force
            size = np.linalg.norm(target, axis=1)
            model = KernelRidge(alpha=ridge, kernel="rbf", gamma=0.5 / width ** 2)
            model.fit(self._centres, np.concatenate([target.real, target.imag], axis=1),
                      sample_weight=(size.mean() / size) ** 2)
            self._weights = model.dual_coef_
        else:
            loaded = np.unique(arrays.node[arrays.force != 0.0])
            self._centres = self._features(self._each_load().take(loaded))
            size = np.linalg.norm(coefficients, axis=1)
            model = Ridge(alpha=ridge, fit_intercept=False, solver="svd")
            model.fit(self._design(arrays), coefficients, sample_weight=(size.mean() / size) ** 2)
            self._weights = np.ascontiguousarray(model.coef_.T)

    def _coefficients(self, cases: CaseArrays) -> np.ndarray:
        """(n_case, rank) ndarray: POD coefficients."""
        if self._other is None:
            coefficients = self._design(cases) @ self._weights
        else:
            coefficients = sum(self._other.predict(self._features(cases, j)) * cases.force[:, j:j + 1]
                               for j in range(cases.node.shape[1]))
        if not self.scene.harmonic:
            return coefficients
        half = coefficients.shape[1] // 2
        return coefficients[:, :half] + 1j * coefficients[:, half:]

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        return combine(self._coefficients(cases), self._basis.rows(outputs), out)

    def best_approximation(self, cases: CaseArrays, values: np.ndarray) -> np.ndarray:
        rows = self._basis.field
        return (values @ rows.T) @ rows

    @property
    def _learned(self) -> dict[str, np.ndarray]:
        """What was learned beside the modes, as arrays."""
        if self._other is not None:
            return self._other.arrays
        return {"centre": self._centres, "weight": self._weights}

    @_learned.setter
    def _learned(self, arrays: dict[str, np.ndarray]) -> None:
        if self.settings["regressor"] == "ridge":
            self._centres, self._weights = arrays["centre"], arrays["weight"]
            return
        self._other = REGRESSORS[self.settings["regressor"]]()
        self._other.arrays = {name: arrays[name] for name in self._other.stored}
