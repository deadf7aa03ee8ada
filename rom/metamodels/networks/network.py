"""What the networks share: settings, positions of the loads, weights on disk.

A network answers unit forces; amplitudes multiply and forces add outside of it, exactly, since the model is linear.
"""

from __future__ import annotations

import json
from abc import abstractmethod
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray as xr

from rom.datasets.tensors import read_weights, write_weights
from rom.metamodels.basis import Basis, check_precision
from rom.metamodels.facts import Needs
from rom.metamodels.metamodel import Metamodel
from rom.scenes import CaseArrays, LinearScene, Scene

if TYPE_CHECKING:
    import torch

    from rom.metamodels.networks.training import Checkpoint, History

POSITIVE = ("rank", "width", "depth", "heads", "steps", "batch", "learning_rate", "modes", "powers",
            "poles", "terms")
STORED = {"float32": np.float32, "float16": np.float16}
"""In which fields and coefficients can be stored."""
WEIGHT = "weight."
"""Prefix of the module's tensors in a file; arrays without it belong to the method."""


class Network(Metamodel):
    """A network in reduced coordinates.

    Parameters
    ----------
    scene : Scene
    seed : int
        Decides the weights, alone, on a given machine.
    precision : {"float64", "float32"}
        Of the stored basis; the network itself computes in single precision.
    **settings
        Named in each class.

    Attributes
    ----------
    progress : callable
        Wraps the iteration over training steps, to show a bar.
    history : History
        Training and validation error of the last fit.
    checkpoint : path, optional
        A file from which a killed training goes on to the same result, where a network can; None for none.
    learned_from : dict
        ``split``, ``split_seed``, number of ``cases`` and ``seconds`` that they cost, where that was said.
    """

    learns: ClassVar[bool] = True
    seeded: ClassVar[bool] = True
    suffix: ClassVar[str] = ".safetensors"
    trained_sizes: ClassVar[tuple[str, ...]] = ("large",)
    """Sizes of which trained weights come with the toolkit, for the scene that they belong to."""

    @classmethod
    def needs(cls, scene: Scene) -> Needs:
        return Needs(stiffness=False, network=True)

    def __init__(self, scene: LinearScene, seed: int, precision: str, **settings: Any) -> None:
        for name in POSITIVE:
            value = settings.get(name)
            if value is not None and not value > 0:
                raise ValueError(f"{name}={value} cannot be: give a value above zero")
        if settings.get("weight_decay", 0.0) < 0:
            raise ValueError(f"weight_decay={settings['weight_decay']:g} cannot be: give zero or more")
        if settings["storage"] not in STORED:
            raise ValueError(f"storage={settings['storage']!r} is unknown: choose one of {', '.join(STORED)}")
        super().__init__(scene, **settings, seed=seed, precision=check_precision(precision))
        self.progress: Callable[[Iterable[int]], Iterable[int]] = iter
        self.history: History | None = None
        self.checkpoint: str | Path | None = None
        self.learned_from: dict[str, Any] = {}
        self._module: Any = None  # torch.nn.Module once fitted; torch is not imported here
        self._basis: Basis
        self._file_arrays: dict[str, np.ndarray] = {}  # beside the weights, rounded as a file holds them

    @property
    def _module_bytes(self) -> int:
        return sum(tensor.nbytes for tensor in self._module.state_dict().values()) if self._module else 0

    @property
    def model_bytes(self) -> int:
        return self._module_bytes + self._basis.nbytes

    @property
    def online_bytes(self) -> int:
        planes = 2 if self.scene.harmonic else 1
        return self._module_bytes + self._basis.field.nbytes + planes * self._basis.field[0].nbytes

    # ---- inputs ---------------------------------------------------------------------------------------------

    def _places(self) -> np.ndarray:
        """(n_load, 6) ndarray [-]: positions, centred and scaled to at most one, and outward normals."""
        position = self.scene.loads.position - self.scene.loads.position.mean(axis=0)
        places = np.concatenate([position / np.abs(position).max(), self.scene.loads.direction], axis=1)
        return places.astype(np.float32)

    def _load_matrix(self, cases: CaseArrays) -> np.ndarray:
        """(n_case, n_load) ndarray [N]: force at each load."""
        loads = np.zeros((len(cases), self.scene.n_loads))
        np.add.at(loads, (np.arange(len(cases))[:, None], cases.node), cases.force)
        return loads

    def _begin(self, train: xr.Dataset) -> tuple[CaseArrays, np.ndarray]:
        """Inputs and (n_case, n_free) answers of the training cases that have an answer to be relative to."""
        arrays, values = self.scene.read(train), self.scene.values(train)
        if len(arrays) < 2:
            raise ValueError(f"{len(arrays)} training case is too few for {self.name}: give at least two")
        moving = np.linalg.norm(values, axis=1) > 0
        return (arrays, values) if moving.all() else (arrays.take(moving), values[moving])

    def _checkpoint(self, cases_digest: str) -> Checkpoint | None:
        """Where training is kept and what it belongs to, if it is to be kept."""
        if self.checkpoint is None:
            return None
        from rom.metamodels.networks.training import Checkpoint

        recipe = {"method": self.name, "settings": self.settings, "scene": self.scene.content_hash,
                  "cases": cases_digest}
        return Checkpoint(Path(self.checkpoint), json.dumps(recipe, sort_keys=True))

    def best_approximation(self, cases: CaseArrays, values: np.ndarray) -> np.ndarray | None:
        return values @ self._basis.field.T @ self._basis.field

    def in_precision(self, precision: str) -> Self:
        """The same network with its fields in another precision.

        Raises
        ------
        NotFittedError
        ValueError
            For a precision that does not exist.
        """
        self._check_fitted()
        other = type(self)(self.scene, **{**self.settings, "precision": precision})
        other._take_tensors(self._tensors())
        for name in ("trained", "offline_seconds", "borrowed_seconds", "history", "learned_from", "fitted"):
            setattr(other, name, getattr(self, name, None))
        return other

    # ---- files ----------------------------------------------------------------------------------------------

    def _write(self, path: str | Path, data: xr.Dataset) -> None:
        write_weights(path, self._tensors(), data.attrs)

    @classmethod
    def read(cls, path: str | Path) -> xr.Dataset:
        """What a file of a fitted metamodel holds; `load` makes the metamodel of it."""
        attributes, arrays = read_weights(path)
        return xr.Dataset({name: ([f"{name}_{axis}" for axis in range(array.ndim)], array)
                           for name, array in arrays.items()}, attrs=attributes)

    def _restored(self, data: xr.Dataset) -> None:
        self._take_tensors({str(name): variable.values for name, variable in data.items()})

    def _file_attributes(self) -> dict[str, Any]:
        history = vars(self.history) if self.history else None
        return {**super()._file_attributes(), "learned_from": self.learned_from, "history": history}

    @classmethod
    def _from_attributes(cls, attributes: dict[str, Any], path: str | Path, scene: Scene | None) -> Self:
        from rom.metamodels.networks.training import History

        model = super()._from_attributes(attributes, path, scene)
        model.learned_from = attributes.get("learned_from") or {}
        if attributes.get("history"):
            model.history = History(**attributes["history"])
        return model

    def _tensors(self) -> dict[str, np.ndarray]:
        """Everything that was learned, as a file holds it."""
        return {**self._file_arrays,
                **{WEIGHT + name: tensor.numpy() for name, tensor in self._module.state_dict().items()}}

    def _take_tensors(self, arrays: dict[str, np.ndarray]) -> None:
        import torch

        from rom.metamodels.networks.determinism import reproducible

        weights = {name.removeprefix(WEIGHT): torch.from_numpy(array)
                   for name, array in arrays.items() if name.startswith(WEIGHT)}
        self._take_arrays(arrays)
        with reproducible(0):  # initial weights are drawn, then overwritten
            module = self._build(weights)
        module.load_state_dict(weights)
        self._keep(module)

    def _keep(self, module: torch.nn.Module) -> None:
        """Take a trained module for answering."""
        self._module = module.eval()

    @abstractmethod
    def _take_arrays(self, arrays: dict[str, np.ndarray]) -> None:
        """Keep the arrays of a file, and make of them what answering needs."""

    def _rounded(self, name: str, array: np.ndarray) -> dict[str, np.ndarray]:
        """An array as a file holds it, in the precision of ``storage``, and the size of each of its rows."""
        size = largest_power(array)
        return {name: (array / size).astype(STORED[self.settings["storage"]]), f"{name}_size": size}

    @abstractmethod
    def _build(self, weights: dict[str, torch.Tensor]) -> torch.nn.Module:
        """An untrained module of the shapes of ``weights``."""


def largest_power(array: np.ndarray) -> np.ndarray:
    """Powers of two just above the largest magnitude along the last axis, which is kept; 1 where all is zero."""
    largest = np.abs(array).max(axis=-1, keepdims=True)
    return np.ldexp(1.0, np.frexp(np.where(largest > 0, largest, 1.0))[1])


def as_tensor(array: np.ndarray) -> torch.Tensor:
    """Single precision, contiguous."""
    import torch

    return torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32))
