"""Trained weights that come with the toolkit, and how such weights are trained.

``data/weights/METHOD-SIZE-SPLIT.safetensors`` holds a network trained on the whole published grid. What it learned from
stands in the file: the split, the seed of the split and the number of cases. Whoever judges it takes held-out cases of
that same seed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from rom.datasets import read_dataset, select
from rom.datasets.reduced import is_reduced
from rom.datasets.storage import open_netcdf
from rom.datasets.tensors import read_attributes
from rom.errors import NoWeightsError, SchemaError
from rom.files import check_output, only_writer
from rom.metamodels.networks.network import Network
from rom.metamodels.networks.sizes import settings_of_size, weights_path
from rom.metamodels.registry import create, load
from rom.scenes import LinearScene, Scene, scene_from_json


def trained_network(method: str, scene: Scene, size: str = "large", split: str = "published",
                    split_seed: int | None = None, precision: str | None = None) -> Network:
    """A network with the weights that come with the toolkit.

    Parameters
    ----------
    method, size, split : str
    scene : Scene
    split_seed : int, optional
        Refuse weights that learned from the split of another seed, to which held-out cases mean nothing.
    precision : {"float32", "float64"}, optional
        Of the fields in memory; default: that with which it was trained.

    Raises
    ------
    NoWeightsError
        Where there are none for this mesh, or they learned from another split.
    SchemaError
        Where they are damaged.
    """
    path = weights_path(method, size, split)
    if not path.exists():
        raise NoWeightsError(f"no weights of {method} ({size}, {split} split) come with the toolkit: train them with "
                         f"`rom train {method} DATASET --output FILE`, or leave them out")
    attributes = read_attributes(path)
    origin = attributes.get("learned_from") or {}
    if split_seed is not None and (origin.get("split"), origin.get("split_seed")) != (split, split_seed):
        raise NoWeightsError(f"{path.name} learned from the {origin.get('split')} split of seed "
                         f"{origin.get('split_seed')}: cases held out by the {split} split of seed {split_seed} may be "
                         "known to it")
    if attributes["mesh_hash"] != scene.mesh_hash:
        raise NoWeightsError(f"{path.name} is for another body or mesh: train weights for this one with `rom train`")
    model = load(path, scene)
    return model if precision is None else model.in_precision(precision)


def train_network(method: str, dataset: str | Path, output: str | Path, *, size: str = "large",
                  split: str = "published", seed: int = 0, cases: int | None = None, storage: str = "float16",
                  settings: dict[str, Any] | None = None,
                  progress: Callable[[Iterable[int]], Iterable[int]] = iter) -> Network:
    """Train a network and save it; a killed training goes on from ``OUTPUT.training`` to the same weights.

    Parameters
    ----------
    method, size : str
    dataset : path
        Stored reduced (harmonic networks), or labelled cases.
    output : path
        Ending in ``.safetensors``.
    split : {"published", "hard"}
        Whose training cases are learned from.
    seed : int
        Decides the weights, alone, on a given machine.
    cases : int, optional
        Learn from so many training cases drawn at random; default: all.
    storage : {"float16", "float32"}
        Of the weights in the file.
    settings : dict, optional
        Beside those of the size.
    progress : callable
        Wraps the iteration over training steps, to show a bar.

    Raises
    ------
    ValueError
        For a method, size, split or number of cases that cannot be.
    SchemaError
        Where the dataset is damaged, has no such split, or a file to resume from belongs to another training.
    """
    output = Path(output)
    if output.suffix != ".safetensors":
        raise ValueError(f"{output} is no name for weights: let it end in .safetensors")
    check_output(output)
    chosen = {**settings_of_size(method, size), **(settings or {}), "seed": seed, "storage": storage}
    with open_netcdf(dataset) as data:
        if "scene_parameters" not in data.attrs or "split_published" not in data:
            raise SchemaError(f"{dataset} is no dataset with splits: make one with `rom dataset`")
        scene = scene_from_json(data.attrs["scene_parameters"])
        if not isinstance(scene, LinearScene):
            raise ValueError(f"{dataset} holds load paths of {scene.name}: networks of the linear scenes learn from "
                             "cases; its own network is fitted by `rom compare`")
        try:
            split_seed = json.loads(data.attrs["recipe"])["seed"]
        except (KeyError, TypeError, ValueError, RecursionError) as error:
            raise SchemaError(f"{dataset} does not say by which seed it was split: make one with "
                              "`rom dataset`") from error
        learned, reduced = select(data, split, "train"), is_reduced(data)
        if cases is not None:
            if not 2 <= cases <= len(learned):
                raise ValueError(f"{cases} training cases cannot be drawn: the {split} split has {len(learned)}")
            learned = np.sort(np.random.default_rng([seed, 36]).choice(learned, cases, replace=False))
        seconds = float(data["solve_seconds"].values[learned].sum())
    model: Any = create(method, scene, **chosen)
    model.checkpoint = output.with_name(output.name + ".training")
    model.progress = progress
    model.learned_from = {"split": split, "split_seed": split_seed, "cases": len(learned), "seconds": seconds}
    with only_writer(output.with_name(f".{output.name}.lock"), output):
        if reduced:
            model.fit_stored(dataset, learned)
        else:
            model.fit(read_dataset(dataset, learned))
        model.save(output)
        model.checkpoint.unlink(missing_ok=True)
    return model
