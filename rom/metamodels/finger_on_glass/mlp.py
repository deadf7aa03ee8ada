"""`mlp` of load paths: one perceptron a variant, from the inputs and a station to the POD coordinates there.

Trained with torch; answers need no torch, since a few matrix products are all that a small perceptron is.
"""

from __future__ import annotations

from itertools import pairwise
from typing import ClassVar

import numpy as np

from rom.checks import real_number, whole_number
from rom.datasets.splits import carve_validation
from rom.metamodels.facts import Needs
from rom.metamodels.finger_on_glass.on_modes import OnModes
from rom.scenes import Scene
from rom.scenes.finger_on_glass import FingerOnGlass


class PathMlp(OnModes):
    """A perceptron of four ratios and the place along the path; the best weights on a validation part are kept.

    Parameters
    ----------
    rank : int, optional
        Number of displacement modes of each variant; None: all that the training paths span.
    width, depth : int
        Of the hidden layers.
    steps, batch : int
        Of AdamW, and training paths in each.
    learning_rate, weight_decay : float
        The rate at its peak.
    seed : int
    registration : {"auto", "slip", "none"}
        See :class:`rom.metamodels.finger_on_glass.on_modes.OnModes`.
    """

    name: ClassVar[str] = "mlp"
    seeded: ClassVar[bool] = True
    colour: ClassVar[str] = "#D55E00"
    summary: ClassVar[str] = "a perceptron of the inputs and the place along the path gives POD coordinates, in float32"

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(stiffness=False, network=True)

    def __init__(self, scene: FingerOnGlass, rank: int | None = 40, width: int = 64, depth: int = 3, steps: int = 1500,
                 batch: int = 12, learning_rate: float = 5e-3, weight_decay: float = 1e-3, seed: int = 0,
                 registration: str = "auto") -> None:
        for key, value, least in (("width", width, 1), ("depth", depth, 1), ("steps", steps, 1), ("batch", batch, 1),
                                  ("seed", seed, 0)):
            whole_number(key, value, least)
        real_number("learning_rate", learning_rate, above=0.0)
        real_number("weight_decay", weight_decay, 0.0)
        super().__init__(scene, rank, registration, width=width, depth=depth, steps=steps, batch=batch,
                         learning_rate=learning_rate, weight_decay=weight_decay, seed=seed)

    def _forget(self) -> None:
        super()._forget()
        self._layers: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
        self._scales: dict[int, np.ndarray] = {}

    @property
    def model_bytes(self) -> int:
        return super().model_bytes + sum(w.nbytes + b.nbytes for layers in self._layers.values() for w, b in layers)

    def _places(self, count: int) -> np.ndarray:
        """(n_station, 5) ndarray: share of the normal force, and where the station lies in the slide, of about one.

        Two waves beside the place itself: without them a smooth perceptron rounds the kink at the onset off.
        """
        press = self._press
        share = np.append(np.arange(1, press + 1) / press, np.ones(count - press))
        slid = np.append(np.zeros(press), np.linspace(0, 1, count - press))
        waves = [np.sin(k * np.pi * slid) for k in (1, 2)]
        return np.column_stack([2 * share - 1, 2 * slid - 1, np.log(share), *waves])

    def _inputs(self, v: int, features: np.ndarray, count: int) -> np.ndarray:
        """(n_path n_station, 9) ndarray."""
        places = self._places(count)
        scaled = (features - self._scales[v][0]) / self._scales[v][1]
        return np.concatenate([np.repeat(scaled, count, axis=0), np.tile(places, (len(features), 1))],
                              axis=1).astype(np.float32)

    def _learn(self, v: int, features: np.ndarray, target: np.ndarray) -> None:
        import torch

        from rom.metamodels.networks.determinism import reproducible
        from rom.metamodels.networks.training import train

        setting, count = self.settings, target.shape[1]
        self._scales[v] = np.stack([features.mean(axis=0), np.maximum(features.std(axis=0), 1e-9)])
        learned, held = (torch.from_numpy(part) for part in carve_validation(len(features), seed=setting["seed"]))
        with reproducible(setting["seed"]) as generator:
            inputs = torch.from_numpy(self._inputs(v, features, count)).view(len(features), count, -1)
            goal = torch.from_numpy(target.astype(np.float32))
            # outputs of about one: the coordinates' sizes differ by orders of magnitude, and so do their weights
            size = goal.square().mean((0, 1)).sqrt().clamp_min(1e-6)
            sizes = [inputs.shape[-1], *[setting["width"]] * setting["depth"], goal.shape[-1]]
            layers: list[torch.nn.Module] = []
            for a, b in pairwise(sizes):
                layers += [torch.nn.Linear(a, b), torch.nn.SiLU()]
            module = torch.nn.Sequential(*layers[:-1])

            def errors(part: torch.Tensor) -> torch.Tensor:
                return ((module(inputs[part]) * size - goal[part]).square()).sum(-1).mean(-1)

            train(module, lambda part: errors(learned if part is None else learned[part]), lambda: errors(held),
                  len(learned), steps=setting["steps"], batch=setting["batch"], learning_rate=setting["learning_rate"],
                  weight_decay=setting["weight_decay"], generator=generator)
        linear = [part for part in module if isinstance(part, torch.nn.Linear)]
        arrays = [(part.weight.detach().numpy().T.copy(), part.bias.detach().numpy().copy()) for part in linear]
        last = arrays[-1]
        arrays[-1] = last[0] * size.numpy(), last[1] * size.numpy()
        self._layers[v] = arrays

    def _coordinates(self, v: int, features: np.ndarray) -> np.ndarray:
        values = self._inputs(v, features, len(self._means[v]))
        for weight, bias in self._layers[v][:-1]:
            values = values @ weight + bias
            values = values / (1.0 + np.exp(-np.maximum(values, -80.0)))  # SiLU
        weight, bias = self._layers[v][-1]
        return (values @ weight + bias).reshape(len(features), *self._means[v].shape)

    def _learned(self, v: int) -> dict[str, np.ndarray]:
        arrays = {"input_scale": self._scales[v]}
        for k, (weight, bias) in enumerate(self._layers[v]):
            arrays |= {f"weight_{k}": weight, f"bias_{k}": bias}
        return arrays

    def _keep_learned(self, v: int, arrays: dict[str, np.ndarray]) -> None:
        self._scales[v] = arrays["input_scale"]
        self._layers[v] = [(arrays[f"weight_{k}"], arrays[f"bias_{k}"]) for k in range(self.settings["depth"] + 1)]
