"""The entries of a comparison: a method at a setting, fitted once for each split."""

from __future__ import annotations

import hashlib
import logging
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rom.cache import cached_path
from rom.comparison.truth import Truth
from rom.datasets import SPLITS
from rom.errors import NoWeightsError, SchemaError
from rom.metamodels import Curve, Metamodel, applicable, create, load, metamodel_class
from rom.metamodels.networks.sizes import TRAINED, weights_path
from rom.provenance import source_digest, versions
from rom.scenes import Scene

log = logging.getLogger(__name__)

REFITTED_SECONDS = 30.0
"""A fit that takes less is not kept: it is measured again in every comparison."""
STORED_BYTES = 50e6
"""Of a model that is kept."""


@dataclass(eq=False)
class Entry:
    """A method at a setting.

    Parameters
    ----------
    kind : type of Metamodel
    settings : dict
    headline : bool
        Whether it speaks for its method.
    """

    kind: type[Metamodel]
    settings: dict[str, Any]
    headline: bool
    model: Any = None
    """Fitted to the first split, as long as it is needed: the one that is timed."""
    facts: dict[str, Any] = field(default_factory=dict)
    """What was measured of it, by variable."""

    @property
    def method(self) -> str:
        return self.kind.name

    @property
    def label(self) -> str:
        return label(self.method, self.settings)

    @property
    def setting(self) -> str:
        return " ".join(setting_words(self.settings))

    @property
    def trained(self) -> bool:
        """Whether it has weights that come with the toolkit, trained on the whole published set."""
        return TRAINED in self.settings


def chosen_curves(scene: Scene, methods: list[str] | None, quick: bool) -> dict[str, Curve]:
    """Settings of the methods that are compared: all that apply, or those asked for and the full-order ones.

    Raises
    ------
    ValueError
        For a method that is unknown or does not apply.
    """
    for name in methods or ():
        metamodel_class(name, scene)
    kinds = [metamodel_class(name, scene) for name, reason in applicable(scene).items() if reason is None]
    return {kind.name: kind.quick_curve(scene) if quick else kind.curve(scene) for kind in kinds
            if methods is None or kind.name in methods or kind.full_order}


def entries_of(scene: Scene, curves: dict[str, Curve]) -> list[Entry]:
    """An entry for each setting of each method."""
    return [Entry(metamodel_class(method, scene), settings, i == curve.headline % len(curve.settings))
            for method, curve in curves.items() for i, settings in enumerate(curve.settings)]


def every_method_has_a_headline(entries: list[Entry]) -> None:
    """Where a method's headline was left out, its last entry speaks for it."""
    for method in {entry.method for entry in entries}:
        mine = [entry for entry in entries if entry.method == method]
        if not any(entry.headline for entry in mine):
            mine[-1].headline = True


def fitted(entry: Entry, scene: Scene, truth: Truth, split: str) -> Metamodel | None:
    """The entry's method fitted to a split; None where no trained weights for a further split come with the toolkit.

    Raises
    ------
    ValueError
        Where it cannot be fitted to these data: a rank that few cases do not span, say, or weights that are missing.
    SchemaError
        Where the truth is damaged.
    """
    if not entry.trained:
        return fit_or_load(entry.kind, scene, entry.settings, truth, split)
    from rom.metamodels.networks.weights import trained_network

    try:
        return trained_network(entry.method, scene, entry.settings[TRAINED], split, truth.seed,
                               entry.settings.get("precision"))
    except NoWeightsError:
        if split == SPLITS[0]:
            raise
        return None


def fit_or_load(kind: type[Metamodel], scene: Scene, settings: dict[str, Any], truth: Truth, split: str = SPLITS[0]
                ) -> Metamodel:
    """A fitted method, from the cache where an earlier fit took long."""
    path = model_path(kind, scene, settings, truth.key, truth.seed, split)
    if path.exists():
        try:
            return load(path, scene)
        except SchemaError as error:
            log.warning("a cached model is fitted again: %s", error)
    # a scene of its own: no method profits unbilled from a factor that another one made
    model = create(kind.name, scene.afresh(), **seeded(kind, settings, truth.seed))
    model.fit(truth.training(split) if kind.learns else None)
    if model.offline_seconds >= REFITTED_SECONDS and model.model_bytes <= STORED_BYTES:
        model.save(path)
    model.scene = scene
    return model


def model_path(kind: type[Metamodel], scene: Scene, settings: dict[str, Any], truth_key: str, seed: int,
               split: str = SPLITS[0]) -> Path:
    """Where in the cache a method fitted at a setting lies, or would lie.

    Parameters
    ----------
    kind : type of Metamodel
    scene : Scene
    settings : dict
    truth_key : str
        Of the dataset that it learns from, if it learns.
    seed : int
        What takes a seed starts from it.
    split : str
    """
    parts = (kind, *map(type, (scene, getattr(scene, "body", scene))))
    recipe = {"method": kind.name, "settings": seeded(kind, settings, seed), "scene": scene.to_json(),
              "content": scene.content_hash, "data": [truth_key, split] if kind.learns else None,
              "versions": versions(), "source": source_digest(*sorted({part.__module__ for part in parts}))}
    return cached_path("models", recipe, kind.suffix)


def seeded(kind: type[Metamodel], settings: dict[str, Any], seed: int) -> dict[str, Any]:
    """The settings, with the seed where the method takes one."""
    return {**settings, "seed": seed} if kind.seeded else settings


def settings_digest(curves: dict[str, Curve]) -> list[Any]:
    """JSON-able: settings, and what lies in the files of trained weights that they name."""
    weights = {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for method, curve in curves.items()
               for settings in curve.settings if TRAINED in settings for split in SPLITS
               if (path := weights_path(method, settings[TRAINED], split)).exists()}
    return [{method: list(curve) for method, curve in curves.items()}, weights]


def offline(entry: Entry, scene: Scene, truth: Truth) -> dict[str, Any]:
    """What an entry cost before its first answer, and what that was spent on."""
    model = entry.model
    snapshots, cases, source = 0.0, np.nan, ""
    if entry.trained:
        origin = model.learned_from
        snapshots, cases = float(origin["seconds"]), float(origin["cases"])
        source = "a verified reduced model" if scene.harmonic else "direct"
    elif entry.kind.learns:
        snapshots, source = truth.snapshot_seconds(SPLITS[0]), "direct"
    return {"snapshot_seconds": snapshots, "fit_seconds": model.offline_seconds, "learned_cases": cases,
            "snapshot_source": source, "model_bytes": float(model.model_bytes)}


def label(method: str, settings: dict[str, Any]) -> str:
    """Name of an entry: the method and its settings."""
    return " ".join([method, *setting_words(settings)])


def setting_words(settings: dict[str, Any]) -> list[str]:
    """``name=value`` of each setting."""
    return [f"{name}={'all' if value is None else value}" for name, value in settings.items()]

