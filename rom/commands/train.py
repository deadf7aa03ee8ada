"""`rom train`: train a harmonic network on a whole dataset that is stored reduced, resumable."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rom.commands.progress import bar

STORED_NETWORKS = ("mlp", "mlp-residual", "pole-network")


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("train", help="train a network on a whole dataset, resumable: run again after a kill")
    parser.add_argument("method", metavar="METHOD", help=", ".join(STORED_NETWORKS))
    parser.add_argument("dataset", metavar="DATASET", type=Path, help="made by `rom dataset --whole`")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE", help="weights, ending in .safetensors")
    parser.add_argument("--split", default="published", help="whose training cases: published (default) or hard")
    parser.add_argument("--size", default="large", help="small, medium or large (default)")
    parser.add_argument("--seed", type=int, default=0, metavar="N")
    parser.add_argument("--float32", action="store_true", help="store weights in single precision, not in half")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Train, save, and say what it took and what validation found."""
    from rom.datasets import select
    from rom.datasets.storage import open_netcdf
    from rom.errors import SchemaError
    from rom.metamodels import create
    from rom.metamodels.networks.sizes import settings_of_size
    from rom.scenes import scene_from_json

    method, path = arguments.method, arguments.output
    if method not in STORED_NETWORKS:
        raise ValueError(f"{method!r} is not trained on whole datasets: choose from {', '.join(STORED_NETWORKS)}")
    if path.suffix != ".safetensors":
        raise ValueError(f"{path} is no name for weights: let it end in .safetensors")
    settings = settings_of_size(method, arguments.size)
    with open_netcdf(arguments.dataset) as data:
        if "scene_parameters" not in data.attrs or "split_published" not in data:
            raise SchemaError(f"{arguments.dataset} is no whole dataset: make one with `rom dataset --whole`")
        scene = scene_from_json(data.attrs["scene_parameters"])
        cases = select(data, arguments.split, "train")
    storage = "float32" if arguments.float32 else "float16"
    model: Any = create(method, scene, **settings, seed=arguments.seed, storage=storage)
    model.checkpoint = path.with_name(path.name + ".training")
    model.progress = lambda steps: bar(steps, "training")
    model.fit_stored(arguments.dataset, cases, split=arguments.split)
    model.save(path)
    model.checkpoint.unlink(missing_ok=True)
    print(f"{path}: {len(cases):,} cases of the {arguments.split} split, {model.offline_seconds:.0f} s, "
          f"validation error {min(model.history.validation):.1e} (root mean square)")
