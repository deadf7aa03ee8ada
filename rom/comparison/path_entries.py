"""The entries of a comparison of load paths: a method at a setting, fitted for each split, found again in the cache."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import xarray as xr

from rom.cache import cached_path
from rom.comparison.entries import Entry, every_method_has_a_headline, rows_of
from rom.comparison.settings import Curve, label
from rom.datasets import SPLITS, select
from rom.errors import SchemaError
from rom.metamodels import create, load, metamodel_class
from rom.metamodels.contact.base import ContactMetamodel
from rom.provenance import source_digest, versions
from rom.scenes import FingerOnGlass

log = logging.getLogger(__name__)

SLOW = {"direct": 16, "coarse-fem": 4}
"""One held-out path in so many is followed where each takes seconds: `direct` is the truth itself, and the error of a
coarse mesh varies little. All other methods answer every held-out path."""
SOURCES = ("finger_on_glass", "scenes", "datasets/contact_schema.py", "datasets/path_solutions.py",
           "metamodels/contact")


def fit_entries(scene: FingerOnGlass, curves: dict[str, Curve], data: xr.Dataset, key: str, seed: int,
                progress: Callable) -> tuple[list[Entry], list[str]]:
    """Fit every setting of every method to each split, or load what was fitted before.

    Returns
    -------
    entries : list of Entry
    omitted : list of str
        Settings that cannot be fitted to these paths, each with the reason.
    """
    entries, omitted = [], []
    for method, settings, headline in progress(list(rows_of(curves))):
        kind = metamodel_class(method, scene.name)
        models: dict[str, ContactMetamodel] = {}
        keys: dict[str, str] = {}
        try:
            for split in SPLITS:
                if models and not kind.learns:
                    models[split], keys[split] = models[SPLITS[0]], keys[SPLITS[0]]
                else:
                    models[split], keys[split] = _fit_or_load(scene, method, settings, data, key, split, seed)
        except SchemaError:
            raise
        except ValueError as error:
            log.warning("%s is left out: %s", label(method, settings), error)
            omitted.append(f"{label(method, settings)}: {error}")
            continue
        snapshots = data["solve_seconds"].values[select(data, SPLITS[0], "train")].sum() if kind.learns else 0.0
        entries.append(Entry(method, settings, headline, models, keys, float(snapshots)))
    every_method_has_a_headline(entries)
    return entries, omitted


def _fit_or_load(scene: FingerOnGlass, method: str, settings: dict[str, Any], data: xr.Dataset, key: str, split: str,
                 seed: int) -> tuple[ContactMetamodel, str]:
    kind = metamodel_class(method, scene.name)
    if "seed" in kind.__init__.__code__.co_varnames:
        settings = {**settings, "seed": seed}
    recipe = {"method": method, "settings": settings, "scene": scene.to_json(), "content": scene.content_hash,
              "data": [key, split] if kind.learns else None, "versions": versions(), "source": source_digest(*SOURCES)}
    path = cached_path("models", recipe, ".nc")
    if path.exists():
        try:
            return load(path, scene), path.stem
        except SchemaError as error:
            log.warning("a cached model is fitted again: %s", error)
    model = create(method, scene, **settings)
    model.fit(data.isel(path=select(data, split, "train")) if kind.learns else None)
    model.save(path)
    return model, path.stem
