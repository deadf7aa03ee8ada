"""The entries of a comparison: a method at a setting, fitted once for each split and found again in the cache."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.settings import TRAINED, Curve, label, setting_words
from rom.datasets import SPLITS, read_dataset, select
from rom.datasets.storage import open_netcdf
from rom.errors import NoWeightsError, SchemaError
from rom.metamodels import METHODS, Metamodel, create, load, metamodel_class
from rom.metamodels.networks.sizes import weights_path
from rom.provenance import source_digest, versions
from rom.scenes import Scene, get_scene

log = logging.getLogger(__name__)


@dataclass
class Entry:
    """A method at a setting with a fitted model for each split: the same one twice where it learns nothing; none for
    the second where no trained weights for it come with the toolkit."""

    method: str
    settings: dict[str, Any]
    headline: bool
    models: dict[str, Any]
    """Metamodels, or those of load paths."""
    keys: dict[str, str]
    """Digest of everything that each model depends on."""
    snapshot_seconds: float

    @property
    def label(self) -> str:
        return label(self.method, self.settings)

    @property
    def setting(self) -> str:
        return " ".join(setting_words(self.settings))

    @property
    def trained(self) -> bool:
        """Whether it has weights that were trained on the whole published set."""
        return TRAINED in self.settings

    @property
    def model(self) -> Any:
        """The one that is timed."""
        return self.models[SPLITS[0]]


class Truth:
    """A dataset on disk of which only what is asked for is read.

    Parameters
    ----------
    path : Path
    key : str
        Identifies its content in cache recipes.
    seed : int
        What it was drawn from; networks start from the same.
    """

    def __init__(self, path: Path, key: str, seed: int) -> None:
        self.path, self.key, self.seed = path, key, seed
        self.index = read_dataset_index(path)
        self._training: dict[str, xr.Dataset] = {}

    def training(self, split: str) -> xr.Dataset:
        """Training cases of a split, kept until another split or :meth:`forget`, so that methods share one POD."""
        if split not in self._training:
            self.forget()
            self._training[split] = read_dataset(self.path, select(self.index, split, "train"))
        return self._training[split]

    def forget(self) -> None:
        """Let the training cases go."""
        self._training.clear()

    def snapshot_seconds(self, split: str) -> float:
        """What the training cases of a split cost to solve [s]."""
        return float(self.index["solve_seconds"].values[select(self.index, split, "train")].sum())

    def held_out(self) -> np.ndarray:
        """Positions of the cases that any split holds out."""
        return np.unique(np.concatenate([select(self.index, split, "test") for split in SPLITS]))


def read_dataset_index(path: Path) -> xr.Dataset:
    """A dataset without its fields: inputs, splits, residuals."""
    with open_netcdf(path) as data:
        return data.drop_vars(["displacement", "mesh_volume_nodes", "tissue"], errors="ignore").load()


def fit_entries(scene: Scene, curves: dict[str, Curve], truth: Truth, progress: Callable
                ) -> tuple[list[Entry], list[str]]:
    """Fit every setting of every method, or load what was fitted before.

    Returns
    -------
    entries : list of Entry
    omitted : list of str
        Settings that cannot be fitted to these data, each with the reason.
    """
    rows = list(rows_of(curves))
    found: dict[str, dict[str, tuple[Metamodel, str]]] = {}
    omitted: dict[str, str] = {}
    for split, (method, settings, _) in progress([(split, row) for split in SPLITS for row in rows]):
        name = label(method, settings)
        if name in omitted:
            continue
        first = found.setdefault(name, {})
        if first and not metamodel_class(method).learns:
            first[split] = first[SPLITS[0]]
            continue
        try:
            first[split] = _fit_or_load(scene, method, settings, truth, split)
        except SchemaError:  # a damaged truth is no reason to leave a method out
            raise
        except NoWeightsError as error:
            if split == SPLITS[0]:
                log.warning("%s is left out: %s", name, error)
                omitted[name] = f"{name}: {error}"
        except ValueError as error:  # a rank that few quick cases do not span, say
            log.warning("%s is left out: %s", name, error)
            omitted[name] = f"{name}: {error}"
    truth.forget()
    entries = []
    for method, settings, headline in rows:
        name = label(method, settings)
        if name not in omitted:
            models = {split: model for split, (model, _) in found[name].items()}
            keys = {split: key for split, (_, key) in found[name].items()}
            entry = Entry(method, settings, headline, models, keys, 0.0)
            if entry.trained:
                entry.snapshot_seconds = float(entry.model.learned_from["seconds"])
            elif metamodel_class(method).learns:
                entry.snapshot_seconds = truth.snapshot_seconds(SPLITS[0])
            entries.append(entry)
    every_method_has_a_headline(entries)
    return entries, list(omitted.values())


def every_method_has_a_headline(entries: list[Entry]) -> None:
    """Where a method's headline was left out, its last entry speaks for it."""
    for method in {entry.method for entry in entries}:
        mine = [entry for entry in entries if entry.method == method]
        if not any(entry.headline for entry in mine):
            mine[-1].headline = True


def rows_of(curves: dict[str, Curve]) -> Iterator[tuple[str, dict[str, Any], bool]]:
    """Method, settings and whether they are its headline, of every setting."""
    for method, curve in curves.items():
        for i, settings in enumerate(curve.settings):
            yield method, settings, i == curve.headline % len(curve.settings)


def _fit_or_load(scene: Scene, method: str, settings: dict[str, Any], truth: Truth, split: str
                 ) -> tuple[Metamodel, str]:
    if TRAINED in settings:
        from rom.metamodels.networks.weights import trained_network

        size, precision = settings[TRAINED], settings.get("precision")
        model = trained_network(method, scene, size, split, truth.seed, precision)
        return model, f"{method} {size} {split} {precision} {weights_digest(method, size, split)}"
    path = model_path(scene, method, settings, truth.key, truth.seed, split)
    settings = seeded(method, settings, truth.seed)
    if path.exists():
        try:
            return load(path, scene), path.stem
        except SchemaError as error:
            log.warning("a cached model is fitted again: %s", error)
    # a scene of its own: no method profits unbilled from a factor that another one made
    own = get_scene(scene.name, scene.fingertip, scene.outputs)
    model = create(method, own, **settings).fit(truth.training(split) if metamodel_class(method).learns else None)
    model.save(path)
    model.scene = scene
    return model, path.stem


def model_path(scene: Scene, method: str, settings: dict[str, Any], truth_key: str, seed: int,
               split: str = SPLITS[0]) -> Path:
    """Where in the cache a method fitted at a setting lies, or would lie.

    Parameters
    ----------
    scene : Scene
    method : str
    settings : dict
    truth_key : str
        Of the dataset that it learns from, if it learns.
    seed : int
        Networks start from it.
    split : str
    """
    network = is_network(method)
    recipe = {"method": method, "settings": seeded(method, settings, seed), "scene": scene.to_json(),
              "content": scene.content_hash, "data": [truth_key, split] if metamodel_class(method).learns else None,
              "versions": versions(),
              "source": source_digest("fullorder", "fingertip", "scenes", "datasets",
                                      *([f"metamodels/{name}.py" for name in SOURCES]),
                                      *(["metamodels/networks"] if network else []))}
    return cached_path("models", recipe, ".safetensors" if network else ".nc")


def weights_digest(method: str, size: str, split: str) -> str:
    """sha256 of the trained weights that come with the toolkit, and of what evaluates them."""
    found = hashlib.sha256(weights_path(method, size, split).read_bytes()).hexdigest()
    return found + source_digest("metamodels/networks", "metamodels/basis.py")


def is_network(method: str) -> bool:
    """Whether a method is a network, which needs torch and a seed."""
    return METHODS[method][0].startswith("networks.")


def seeded(method: str, settings: dict[str, Any], seed: int) -> dict[str, Any]:
    """The settings, with the seed where the method is a network."""
    return {**settings, "seed": seed} if is_network(method) else settings


SOURCES = ("metamodel", "basis", "direct", "superposition", "certificate", "modal", "modal_certificate",
           "pod", "coarse_fem", "regression", "regressors", "lookup_table", "residual_bound", "validity")
