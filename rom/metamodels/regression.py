"""POD coefficients by regression with scikit-learn: no full-order model needed after the snapshots.

Statics: the answer is linear in the forces, so the features are radial functions of the loaded positions weighted by
the forces, and ridge regression on them is linear in the forces too. Harmonics: kernel ridge regression on position,
normal, frequency and loss factor, for a unit force; the amplitude multiplies exactly.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import xarray as xr

from rom.metamodels.basis import Basis, check_precision, combine
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.pod import pod_of
from rom.scenes import CaseArrays, HarmonicPointForce, Scene, StaticPointForces


class PodRegression(Metamodel):
    """Ridge (statics) or kernel ridge regression (harmonics) of POD coefficients.

    Parameters
    ----------
    rank : int
        Number of POD modes.
    width : float
        Of the radial functions: over the pad's size in statics, over the scaled inputs in harmonics.
    ridge : float
        Regularisation.
    """

    name: ClassVar[str] = "pod-regression"
    summary: ClassVar[str] = "learns POD coefficients from snapshots by (kernel) ridge regression"
    scenes: ClassVar[tuple[str, ...]] = (StaticPointForces.name, HarmonicPointForce.name)
    learns: ClassVar[bool] = True

    def __init__(self, scene: Scene, rank: int = 100, width: float = 0.3, ridge: float = 1e-6,
                 precision: str = "float64") -> None:
        if width <= 0 or ridge < 0:
            raise ValueError(f"width={width:g}, ridge={ridge:g} cannot be: width must be positive, ridge not negative")
        super().__init__(scene, rank=rank, width=width, ridge=ridge, precision=check_precision(precision))
        self._basis: Basis | None = None

    @property
    def fitted(self) -> bool:
        return self._basis is not None

    @property
    def model_bytes(self) -> int:
        return self._basis.nbytes + self._centres.nbytes + self._weights.nbytes

    @property
    def online_bytes(self) -> int:
        return self._basis.field.nbytes + self._weights.nbytes

    # ---- features -------------------------------------------------------------------------------------------

    def _features(self, cases: CaseArrays, j: int = 0) -> np.ndarray:
        """(n_case, d) ndarray of the inputs of each case's force number ``j``, scaled to about one."""
        node = cases.node[:, j]
        places = np.concatenate([self.scene.pad_positions / np.ptp(self.scene.pad_positions, axis=0).max(),
                                 0.3 * self.scene.pad_normals], axis=1)
        if not self.scene.harmonic:
            return places[node]
        return np.column_stack([places[node], cases.frequency / 100.0, cases.loss_factor / 0.5])

    def _kernel(self, features: np.ndarray) -> np.ndarray:
        from sklearn.metrics.pairwise import rbf_kernel

        return rbf_kernel(features, self._centres, gamma=0.5 / self.settings["width"] ** 2)

    def _design(self, cases: CaseArrays) -> np.ndarray:
        """(n_case, n_centre) ndarray: kernel values weighted by the forces."""
        if self.scene.harmonic:
            return sum(self._kernel(self._features(cases, j)) * cases.force[:, j:j + 1]
                       for j in range(cases.node.shape[1]))
        table = self._kernel(self._features(self._each_pad_node()))
        return np.einsum("cf,cfk->ck", cases.force, table[cases.node])

    def _each_pad_node(self) -> CaseArrays:
        n = self.scene.n_pad
        return CaseArrays(np.arange(n)[:, None], np.ones((n, 1)))

    # ---- the metamodel --------------------------------------------------------------------------------------

    def _fit(self, train: xr.Dataset | None) -> None:
        from sklearn.kernel_ridge import KernelRidge
        from sklearn.linear_model import Ridge

        vectors = pod_of(self.scene, train).truncated(self.settings["rank"])
        arrays = self.scene.case_arrays(train)
        coefficients = self.scene.values(train) @ vectors
        ridge, gamma = self.settings["ridge"], 0.5 / self.settings["width"] ** 2
        if self.scene.harmonic:
            if arrays.force.shape[1] > 1:
                raise ValueError(f"{self.name} learns harmonic cases of one force each: split those with several")
            self._centres = self._features(arrays)
            target = coefficients / arrays.force
            size = np.linalg.norm(target, axis=1).mean()
            model = KernelRidge(alpha=ridge, kernel="rbf", gamma=gamma)
            model.fit(self._centres, np.concatenate([target.real, target.imag], axis=1) / size)
            self._weights = size * model.dual_coef_
        else:
            loaded = np.unique(arrays.node[arrays.force != 0.0])
            self._centres = self._features(self._each_pad_node().take(loaded))
            size = np.linalg.norm(coefficients, axis=1).mean()
            model = Ridge(alpha=ridge, fit_intercept=False, solver="cholesky")
            model.fit(self._design(arrays), coefficients / size)
            self._weights = size * np.ascontiguousarray(model.coef_.T)
        self._basis = Basis(vectors.T, self.scene.pad_rows, self.settings["precision"])

    def _evaluate(self, cases: CaseArrays, outputs: str) -> np.ndarray:
        coefficients = self._design(cases) @ self._weights
        if self.scene.harmonic:
            half = coefficients.shape[1] // 2
            coefficients = coefficients[:, :half] + 1j * coefficients[:, half:]
        return combine(coefficients, self._basis.rows(outputs))

    def best_approximation(self, values: np.ndarray) -> np.ndarray:
        rows = self._basis.field
        return (values @ rows.T) @ rows

    def _state(self) -> xr.Dataset:
        return xr.Dataset({
            "pod_mode": (("rank", "dof"), self._basis.field, {"long_name": "POD mode", "units": "1"}),
            "centre": (("centre_case", "feature"), self._centres, {"long_name": "centres of the radial functions"}),
            "weight": (("centre_case", "output"), self._weights, {"long_name": "regression weights"})})

    def _restore(self, data: xr.Dataset) -> None:
        self._centres, self._weights = data["centre"].values, data["weight"].values
        self._basis = Basis(data["pod_mode"].values, self.scene.pad_rows, self.settings["precision"])
