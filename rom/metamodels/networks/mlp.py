"""Perceptrons for the vibrating fingertip: one of the whole answer, one of what mechanics leaves unexplained.

Loads enter by position and normal, so that a node never seen means something. With s = omega^2 / (1 + i eta) a unit
force f answers u = (K - s M)^-1 f / (1 + i eta), a function of position and the single complex variable s. `mlp` is the
plain network of position, frequency and loss factor. `mlp-residual` sums the load's static response v = K^-1 f, what m
modes add to it, and a network times powers of s, which is what the left-out modes add (|s| < lambda_(m+1)):

    (1 + i eta) u = v + sum_(k <= m) phi_k (phi_k^T f) s / (lambda_k (lambda_k - s)) + sum_j s^j network_j(position).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy.linalg as sla
import xarray as xr

from rom.datasets.splits import carve_validation
from rom.metamodels.basis import Basis, combine
from rom.metamodels.networks.network import Network, as_tensor
from rom.metamodels.pod import pod_of
from rom.scenes import CaseArrays, HarmonicPointForce, Scene

if TYPE_CHECKING:
    import torch


DEFAULT_RANK = 200


class Mlp(Network):
    """A perceptron of the complex POD coefficients of one unit force's answer.

    Parameters
    ----------
    rank : int, optional
        Number of POD modes; default: 200, or all that the snapshots span where they are fewer.
    width, depth : int
        Of the hidden layers.
    steps, batch : int
        Training steps, and cases in each.
    learning_rate, weight_decay : float
        Of AdamW; the rate at its peak.
    seed : int
    precision : {"float64", "float32"}
        Of the stored POD modes.
    """

    name: ClassVar[str] = "mlp"
    summary: ClassVar[str] = "a plain perceptron of the loaded position, frequency and loss factor"
    scenes: ClassVar[tuple[str, ...]] = (HarmonicPointForce.name,)

    def __init__(self, scene: Scene, rank: int | None = None, width: int = 512, depth: int = 2, steps: int = 1500,
                 batch: int = 256, learning_rate: float = 2e-3, weight_decay: float = 1e-2, seed: int = 0,
                 precision: str = "float32") -> None:
        super().__init__(scene, seed, precision, rank=rank, width=width, depth=depth, steps=steps, batch=batch,
                         learning_rate=learning_rate, weight_decay=weight_decay)

    def _inputs(self, cases: CaseArrays) -> torch.Tensor:
        """(n_case n_force, 8) Tensor: place, frequency and loss factor of each force, of about one."""
        n_force = cases.node.shape[1]
        point = np.column_stack([2 * cases.frequency / self.scene.band_hz - 1, 4 * cases.loss_factor - 1])
        return as_tensor(np.concatenate([self._place[cases.node.ravel()], np.repeat(point, n_force, axis=0)], axis=1))

    def _fit(self, train: xr.Dataset) -> None:
        from rom.metamodels.networks.training import reproducible

        space, self.borrowed_seconds = pod_of(self.scene, train)
        vectors = space.truncated(self.settings["rank"] or min(DEFAULT_RANK, space.vectors.shape[1]))
        arrays, values = self._begin(train)
        self._place = self._places()
        coefficients = values @ vectors
        size = np.linalg.norm(values, axis=1, keepdims=True)
        target = np.concatenate([coefficients.real, coefficients.imag], axis=1) / size
        with reproducible(self.settings["seed"]) as generator:
            module = self._learn(self._inputs(arrays), arrays.force / size, target, generator)
        self._basis = Basis(vectors.T, self.scene.pad_rows, self.settings["precision"])
        self._keep(module)

    def _learn(self, inputs: torch.Tensor, share: np.ndarray, target: np.ndarray, generator) -> torch.nn.Module:
        import torch

        from rom.metamodels.networks.training import train

        weight, goal = as_tensor(share), as_tensor(target)
        inputs = inputs.view(*weight.shape, -1)
        learned, held = (torch.from_numpy(part) for part in carve_validation(len(goal), seed=self.settings["seed"]))
        # a unit force's answer is the target over the share; its root mean square sets each output's size
        rms = (goal.square().mean(0) / weight.square().sum(1).mean()).sqrt()
        module = self._module_of(torch.where(rms > 0, rms, torch.ones(())))

        def errors(part: torch.Tensor) -> torch.Tensor:
            each = module(inputs[part].flatten(0, 1)).unflatten(0, (len(part), -1))
            return ((weight[part, :, None] * each).sum(1) - goal[part]).square().sum(1)

        setting = self.settings
        self.history = train(
            module, lambda part: errors(learned if part is None else learned[part]), lambda: errors(held), len(learned),
            steps=setting["steps"], batch=setting["batch"], learning_rate=setting["learning_rate"],
            weight_decay=setting["weight_decay"], generator=generator, progress=self.progress)
        return module

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        import torch

        with torch.inference_mode():
            unit = self._module(self._inputs(cases)).numpy()
        unit = unit.reshape(*cases.node.shape, -1)
        parts = np.einsum("cf,cfr->cr", cases.force, unit) if unit.shape[1] > 1 else unit[:, 0] * cases.force
        half = parts.shape[1] // 2
        return combine(parts[:, :half] + 1j * parts[:, half:], self._basis.rows(outputs), out)

    # ---- module and files -----------------------------------------------------------------------------------

    def _module_of(self, scale: torch.Tensor) -> torch.nn.Module:
        from rom.metamodels.networks.modules import CaseFeatures, Perceptron

        return Perceptron(CaseFeatures(), scale, self.settings["width"], self.settings["depth"])

    def _build(self, weights: dict[str, torch.Tensor]) -> torch.nn.Module:
        return self._module_of(weights["scale"])

    def _keep(self, module: torch.nn.Module) -> None:
        super()._keep(module)
        self._place = self._places()


class MlpResidual(Network):
    """A perceptron of what static responses and the lowest modes leave, times powers of s.

    Parameters
    ----------
    modes : int
        Number of natural modes.
    rank : int
        Number of POD modes of what they leave.
    powers : int
        Highest power of s.
    width, depth : int
        Of the hidden layers.
    steps : int
        Training steps.
    learning_rate : float
        At its peak.
    seed : int
    precision : {"float64", "float32"}
        Of the stored fields.
    """

    name: ClassVar[str] = "mlp-residual"
    summary: ClassVar[str] = "static responses and modes, and a perceptron of what they leave"
    scenes: ClassVar[tuple[str, ...]] = (HarmonicPointForce.name,)

    def __init__(self, scene: Scene, modes: int = 40, rank: int = 64, powers: int = 2, width: int = 256,
                 depth: int = 3, steps: int = 1000, learning_rate: float = 5e-3, seed: int = 0,
                 precision: str = "float32") -> None:
        super().__init__(scene, seed, precision, modes=modes, rank=rank, powers=powers, width=width, depth=depth,
                         steps=steps, learning_rate=learning_rate)

    @property
    def model_bytes(self) -> int:
        return super().model_bytes + self._static.nbytes + self.participation.nbytes

    @property
    def online_bytes(self) -> int:
        return super().online_bytes + self._static.field[0].nbytes

    def best_approximation(self, values: np.ndarray) -> np.ndarray | None:
        return None  # each load has a static response of its own

    def _point(self, cases: CaseArrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """1 + i eta, s [rad^2/s^2], and powers of s over the band's omega^2; (n_case, 1), (n_case, 1), (n_case, J)."""
        stiffness = (1.0 + 1j * cases.loss_factor)[:, None]
        s = (2.0 * np.pi * cases.frequency[:, None]) ** 2 / stiffness
        relative = s / (2.0 * np.pi * self.scene.band_hz) ** 2
        return stiffness, s, relative ** np.arange(1, self.settings["powers"] + 1)

    def _modal(self, load: np.ndarray, s: np.ndarray) -> np.ndarray:
        """(n_case, m) ndarray: what each mode adds to its static share, from (n_case, m) modal forces."""
        return load * (s / (self.eigenvalue * (self.eigenvalue - s)))

    def _fit(self, train: xr.Dataset) -> None:
        from rom.metamodels.networks.training import reproducible

        model, pad_rows, precision = self.scene.full_order, self.scene.pad_rows, self.settings["precision"]
        arrays, values = self._begin(train)
        modes = model.natural_modes(count=self.settings["modes"])
        static = model.solve_static(self.scene.unit_loads).T
        self.eigenvalue, self.participation = modes.eigenvalue, self.scene.unit_loads.T @ modes.shape
        loads = self._load_matrix(arrays)
        stiffness, s, powers = self._point(arrays)
        size = np.linalg.norm(values, axis=1, keepdims=True) * np.abs(stiffness)
        left = (values * stiffness - loads @ static - self._modal(loads @ self.participation, s) @ modes.shape.T) / size
        vectors = leading_vectors(np.concatenate([left.real, left.imag]), self.settings["rank"])
        with reproducible(self.settings["seed"]) as generator:
            module = self._learn(loads / size, powers, left @ vectors, generator)
        self._static = Basis(static, pad_rows, precision)
        self._basis = Basis(np.concatenate([modes.shape.T, vectors.T]), pad_rows, precision)
        self._keep(module)

    def _learn(self, loads: np.ndarray, powers: np.ndarray, target: np.ndarray, generator) -> torch.nn.Module:
        import torch

        from rom.metamodels.networks.training import train

        tokens, weight = torch.from_numpy(self._places()), as_tensor(loads)
        power = as_tensor(np.concatenate([powers.real, powers.imag]))
        goal = as_tensor(np.concatenate([target.real, target.imag]))
        count = len(weight)
        # the size of the first power's network, so that all outputs begin at about one
        strength = weight.square().sum(1).repeat(2) * power[:, 0].square()
        rms = (goal.square().sum(0) / strength.sum()).sqrt().repeat(powers.shape[1])
        module = self._module_of(torch.where(rms > 0, rms, torch.ones(())))

        def errors(part: torch.Tensor) -> torch.Tensor:
            each = (weight[part] @ module(tokens)).unflatten(1, (powers.shape[1], -1)).repeat(2, 1, 1)
            both = torch.cat([part, part + count])
            square = (torch.einsum("cj,cjr->cr", power[both], each) - goal[both]).square().sum(1)
            return square[:len(part)] + square[len(part):]

        learned, held = (torch.from_numpy(part) for part in carve_validation(count, seed=self.settings["seed"]))
        self.history = train(
            module, lambda _: errors(learned), lambda: errors(held), len(learned), steps=self.settings["steps"],
            batch=len(learned), learning_rate=self.settings["learning_rate"], weight_decay=0.0, generator=generator,
            progress=self.progress)
        return module

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        import torch

        stiffness, s, powers = self._point(cases)
        node, inverse = np.unique(cases.node, return_inverse=True)
        with torch.inference_mode():
            unit = self._module(self._tokens[torch.from_numpy(node)]).numpy()
        unit = np.concatenate([self.participation[node], unit], axis=1)[inverse.reshape(cases.node.shape)]
        load = np.einsum("cf,cfr->cr", cases.force, unit)
        n_mode = len(self.eigenvalue)
        learned = np.einsum("cj,cjr->cr", powers, load[:, n_mode:].reshape(*powers.shape, -1))
        coefficients = np.concatenate([self._modal(load[:, :n_mode], s), learned], axis=1) / stiffness
        out = combine(coefficients, self._basis.rows(outputs), out)
        static, share = self._static.rows(outputs), (cases.force / stiffness).astype(out.dtype)
        for i, j in np.argwhere(cases.force):
            row = static[cases.node[i, j]]
            out.real[i] += share[i, j].real * row
            out.imag[i] += share[i, j].imag * row
        return out

    # ---- module and files -----------------------------------------------------------------------------------

    def _module_of(self, scale: torch.Tensor) -> torch.nn.Module:
        from rom.metamodels.networks.modules import Perceptron, place_features

        return Perceptron(place_features(2.0, 32), scale, self.settings["width"], self.settings["depth"])

    def _build(self, weights: dict[str, torch.Tensor]) -> torch.nn.Module:
        return self._module_of(weights["scale"])

    def _keep(self, module: torch.nn.Module) -> None:
        import torch

        super()._keep(module)
        self._tokens = torch.from_numpy(self._places())

    def _arrays(self) -> dict[str, np.ndarray]:
        return {"static": self._static.field, "eigenvalue": self.eigenvalue, "participation": self.participation}

    def _take_arrays(self, arrays: dict[str, np.ndarray]) -> None:
        self.eigenvalue, self.participation = arrays["eigenvalue"], arrays["participation"]
        self._static = Basis(arrays["static"], self.scene.pad_rows, self.settings["precision"])


def leading_vectors(rows: np.ndarray, rank: int) -> np.ndarray:
    """(n, rank) ndarray: POD modes of ``rows`` (m, n) as they are weighted, by the Gram matrix.

    Raises
    ------
    ValueError
        Where the rows cannot span that many dimensions.
    """
    if rank > min(rows.shape):
        raise ValueError(f"rank {rank} is out of reach: {rows.shape[0]} rows of {rows.shape[1]} span at most "
                         f"{min(rows.shape)} dimensions; ask for less or make more cases")
    _, weights = sla.eigh(rows @ rows.T, subset_by_index=[len(rows) - rank, len(rows) - 1])
    return np.linalg.qr(rows.T @ weights[:, ::-1])[0]
