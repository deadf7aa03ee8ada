"""Forces as tokens: a transformer of the static displacement's POD coefficients.

Each force is a token of its position and normal that attends to tokens of the pad's loaded nodes; the answer is the
sum of the tokens' answers, each times its amplitude. So any number of forces is answered, in any order, exactly
homogeneous, and linearity need not be learned. Training cases are superposed exactly: combined linearly into those
nearest to one force each, which is all that an additive network can learn from them. The values that attention weighs
are its output layer, and linear: least squares settle them at the end.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr

from rom.datasets.splits import carve_validation
from rom.metamodels.basis import Basis, combine
from rom.metamodels.facts import Curve
from rom.metamodels.linear import not_linear
from rom.metamodels.networks.network import Network, as_tensor
from rom.metamodels.networks.sizes import LARGE, trained_here
from rom.metamodels.pod import pod_of
from rom.scenes import CaseArrays, LinearScene, Scene

if TYPE_CHECKING:
    import torch

RANGE = 1e-8
"""Singular value, relative to the largest, from which combinations of training loads count as independent."""
HIDDEN = 0.01
"""Weight of the squared error where each node's own token is hidden, as if the node had never been seen."""
SEEN = 0.1
"""Least norm of the training loads' nearest combination to one force with which that force is learned."""


class Transformer(Network):
    """A small transformer over force tokens.

    Parameters
    ----------
    rank : int, optional
        Number of POD modes; default: all that the snapshots span, as responses to point forces do not compress.
    width, depth, heads : int
        Of the attention blocks.
    steps : int
        Training steps.
    learning_rate : float
        At its peak.
    storage : {"float32", "float16"}
        Of the POD modes in a file; half precision halves it and adds 2e-4 to an error.
    seed : int
    precision : {"float64", "float32"}
        Of the POD modes in memory.
    """

    name: ClassVar[str] = "transformer"
    summary: ClassVar[str] = "a small transformer: forces as tokens that attend to the pad, answers added"
    colour: ClassVar[str] = "#E69F00"

    @classmethod
    def why_not(cls, scene: Scene) -> str | None:
        if not_linear(scene):
            return "is the published network for several static forces on a linear body"
        return ("is the published network for several static forces; one force needs no attention"
                if scene.harmonic else scene.not_spatial())  # type: ignore[attr-defined]

    @classmethod
    def curve(cls, scene: Scene) -> Curve:
        # smaller ones learn as well from the comparison's own snapshots, in seconds: weights are kept of one size
        own: tuple[dict[str, Any], ...] = ({"width": 32, "heads": 2}, {"width": 48}, {})
        if not trained_here(cls.name, scene):
            return Curve(own)
        return Curve((*own, LARGE, {**LARGE, "precision": "float64"}), headline=3)

    @classmethod
    def quick_curve(cls, scene: Scene) -> Curve:
        return Curve(({"width": 32, "steps": 300},))

    def __init__(self, scene: LinearScene, rank: int | None = None, width: int = 64, depth: int = 1, heads: int = 4,
                 steps: int = 600, learning_rate: float = 0.02, storage: str = "float32", seed: int = 0,
                 precision: str = "float32") -> None:
        super().__init__(scene, seed, precision, rank=rank, width=width, depth=depth, heads=heads, steps=steps,
                         learning_rate=learning_rate, storage=storage)
        if width % (2 * heads):
            raise ValueError(f"width={width} does not fit heads={heads}: give a multiple of {2 * heads}")

    def _fit(self, train: xr.Dataset) -> None:
        from rom.metamodels.networks.determinism import reproducible

        space, self.borrowed_seconds = pod_of(self.scene, train)
        vectors = space.truncated(self.settings["rank"] or space.vectors.shape[1])
        arrays, values = self._begin(train)
        coefficients, size = values @ vectors, np.linalg.norm(values, axis=1)
        learned, held = carve_validation(len(arrays), seed=self.settings["seed"])
        loads = self._load_matrix(arrays)
        with reproducible(self.settings["seed"]) as generator:
            module = self._learn(superpose(loads[learned], coefficients[learned]),
                                 (loads[held], coefficients[held], size[held]), generator)
        self._take_arrays(self._rounded("basis", vectors.T))
        self._keep(module)

    def _learn(self, superposed, validation, generator) -> Any:
        import torch

        from rom.metamodels.networks.training import train

        known, loads, targets = superposed
        places = torch.from_numpy(self._places())
        weight, goal = as_tensor(loads[:, known]), as_tensor(targets)
        square = goal.square().sum(1)
        held_weight, held_goal, held_size = (as_tensor(array) for array in validation)
        scale = goal.abs().amax(0)
        module = self._module_of(places[known], torch.where(scale > 0, scale, torch.ones(())))
        # where every known node has an answer of its own, attention also learns to do without it
        single = weight.shape[0] == weight.shape[1] and torch.allclose(weight, torch.eye(len(weight)), atol=1e-5)

        def errors(_: torch.Tensor | None) -> torch.Tensor:
            error = (weight @ module(places[known]) - goal).square().sum(1)
            if single and len(weight) > 1:
                error = error + HIDDEN * (module.without_own_token() - goal).square().sum(1)
            return error / square

        self.history = train(
            module, errors,
            lambda: (held_weight @ module(places) - held_goal).square().sum(1) / held_size.square(),
            len(goal), steps=self.settings["steps"], batch=len(goal), learning_rate=self.settings["learning_rate"],
            weight_decay=0.0, generator=generator, progress=self.progress,
            checkpoint=self._checkpoint(hashlib.sha256(loads.tobytes() + targets.tobytes()).hexdigest()))
        if single:
            module.settle(goal)
        return module

    def _evaluate(self, cases: CaseArrays, outputs: str, out: np.ndarray | None) -> np.ndarray:
        import torch

        from rom.metamodels.networks.determinism import one_thread

        # a force may come often in a block, and answers for one node are alike: each is asked once
        node, inverse = np.unique(cases.node, return_inverse=True)
        with one_thread(), torch.inference_mode():
            unit = self._module(self._tokens[torch.from_numpy(node)], self._memory).numpy()
        coefficients = np.einsum("cf,cfr->cr", cases.force, unit[inverse.reshape(cases.node.shape)])
        return combine(coefficients, self._basis.rows(outputs), out)

    # ---- module and files -----------------------------------------------------------------------------------

    def _take_arrays(self, arrays: dict[str, np.ndarray]) -> None:
        self._file_arrays = {name: arrays[name] for name in ("basis", "basis_size")}
        self._basis = Basis(arrays["basis"] * arrays["basis_size"], self.scene.part_rows, self.settings["precision"])

    def _module_of(self, pad: torch.Tensor, scale: torch.Tensor) -> Any:
        from rom.metamodels.networks.modules import PadAttention

        return PadAttention(pad, scale, *(self.settings[name] for name in ("width", "depth", "heads")))

    def _build(self, weights: dict[str, torch.Tensor]) -> torch.nn.Module:
        return self._module_of(weights["pad"], weights["scale"])

    def _keep(self, module: torch.nn.Module) -> None:
        import torch

        super()._keep(module)
        self._tokens = torch.from_numpy(self._places())
        with torch.inference_mode():
            self._memory = self._module.remember()


def superpose(loads: np.ndarray, answers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Combine cases linearly into those nearest to one unit force each.

    Parameters
    ----------
    loads : (n_case, n_pad) ndarray [N]
    answers : (n_case, r) ndarray

    Returns
    -------
    known : (n_known,) ndarray of int
        Pad nodes that the cases load.
    loads : (m, n_pad) ndarray
        Projections of unit forces on the span of the cases' loads: the unit forces themselves where cases suffice.
    answers : (m, r) ndarray
    """
    u, singular, vt = np.linalg.svd(loads, full_matrices=False)
    keep = singular > RANGE * singular[0]
    combination = (vt[keep].T / singular[keep]) @ u[:, keep].T
    combined, superposed = combination @ loads, combination @ answers
    enough = (np.linalg.norm(combined, axis=1) > SEEN) & (np.linalg.norm(superposed, axis=1) > 0)
    return np.flatnonzero(loads.any(axis=0)), combined[enough], superposed[enough]
