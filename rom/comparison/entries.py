"""The entries of a comparison: a method at a setting, fitted once for each split and found again in the cache."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.comparison.settings import Curve, label, setting_words
from rom.datasets import SPLITS, read_dataset, select
from rom.datasets.storage import open_netcdf
from rom.errors import SchemaError
from rom.metamodels import METHODS, Metamodel, create, load, metamodel_class
from rom.provenance import source_digest, versions
from rom.scenes import Scene, get_scene

log = logging.getLogger(__name__)


@dataclass
class Entry:
    """A method at a setting with a fitted model for each split (the same one twice where it learns nothing)."""

    method: str
    settings: dict[str, Any]
    headline: bool
    models: dict[str, Metamodel]
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
    def model(self) -> Metamodel:
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
    rows = list(_rows(curves))
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
            snapshots = truth.snapshot_seconds(SPLITS[0]) if metamodel_class(method).learns else 0.0
            entries.append(Entry(method, settings, headline, models, keys, snapshots))
    for method in {entry.method for entry in entries}:
        mine = [entry for entry in entries if entry.method == method]
        if not any(entry.headline for entry in mine):
            mine[-1].headline = True
    return entries, list(omitted.values())


def _rows(curves: dict[str, Curve]) -> Iterator[tuple[str, dict[str, Any], bool]]:
    for method, curve in curves.items():
        for i, settings in enumerate(curve.settings):
            yield method, settings, i == curve.headline % len(curve.settings)


def _fit_or_load(scene: Scene, method: str, settings: dict[str, Any], truth: Truth, split: str
                 ) -> tuple[Metamodel, str]:
    learns = metamodel_class(method).learns
    network = METHODS[method][0].startswith("networks.")
    if network:
        settings = {**settings, "seed": truth.seed}
    recipe = {"method": method, "settings": settings, "scene": scene.to_json(), "content": scene.content_hash,
              "data": [truth.key, split] if learns else None, "versions": versions(),
              "source": source_digest("fullorder", "fingertip", "scenes", "datasets",
                                      *([f"metamodels/{name}.py" for name in SOURCES]),
                                      *(["metamodels/networks"] if network else []))}
    path = cached_path("models", recipe, ".safetensors" if network else ".nc")
    if path.exists():
        try:
            return load(path, scene), path.stem
        except SchemaError as error:
            log.warning("a cached model is fitted again: %s", error)
    # a scene of its own: no method profits unbilled from a factor that another one made
    own = get_scene(scene.name, scene.fingertip, scene.outputs)
    model = create(method, own, **settings).fit(truth.training(split) if learns else None)
    model.save(path)
    model.scene = scene
    return model, path.stem


SOURCES = ("metamodel", "basis", "direct", "superposition", "certificate", "modal", "modal_certificate",
           "pod", "coarse_fem", "regression", "regressors", "lookup_table", "residual_bound", "validity")
