"""`rom dataset`: cases of a scene with their answers, made in parallel and in pieces that a killed run finds again."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rom.commands.progress import bar
from rom.commands.seed import seed

ONLY = {"preset": "fingertip", "formulation": "fingertip", "rays": "rays", "layers": "layers"}
"""What a scene must take for an option to mean something."""


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("dataset", help="make a dataset of a scene, resumable")
    parser.add_argument("scene", metavar="SCENE")
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--cases", type=int, help="cases within the ranges, answered by the full-order model")
    which.add_argument("--whole", nargs="?", const="published", choices=("published", "beyond"),
                       help="harmonic-point-force alone: every case of the published grid, or also those beyond it, by "
                            "a ROM whose residual is checked in each; stored reduced")
    parser.add_argument("--beyond", type=int, help="with --cases: further cases outside the ranges (default 0)")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE")
    parser.add_argument("--seed", type=seed, default=0)
    parser.add_argument("--compress", action="store_true", help="smaller and slower to write")
    parser.add_argument("--workers", type=int, help="processes (default one a core; 1: this process alone)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a running dask cluster, such as tcp://host:8786")
    parser.add_argument("--preset", help="mesh of a fingertip: metamodel (default) or study")
    parser.add_argument("--formulation", help="of a fingertip: b-bar (default), or full as published")
    parser.add_argument("--rays", type=int, help="of a section: elements around the bone (default 100)")
    parser.add_argument("--layers", type=int, help="of a section: elements from bone to skin (default 12)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Make the dataset and print its path.

    Raises
    ------
    ValueError
        For options that mean nothing to the scene, and numbers that cannot be.
    """
    from rom.datasets import make_dataset, make_whole_dataset

    scene = _scene(arguments)

    def progress(items):
        return bar(items, "snapshots")

    if arguments.whole:
        for name in ("beyond", "compress", "workers", "scheduler"):
            if getattr(arguments, name):
                raise ValueError(f"--whole takes no --{name}: say `--whole beyond` for the cases outside the published "
                                 "ranges; the file is small and made quickly already")
        path = make_whole_dataset(scene, arguments.output, beyond=arguments.whole == "beyond", seed=arguments.seed,
                                  progress=progress)
    else:
        path = make_dataset(scene, arguments.cases, arguments.output, beyond=arguments.beyond or 0,
                            seed=arguments.seed, compress=arguments.compress, scheduler=arguments.scheduler,
                            workers=arguments.workers, progress=progress)
    print(path)


def _scene(arguments: argparse.Namespace) -> Any:
    from rom.fingertip import Fingertip
    from rom.scenes import get_scene, scene_options

    taken = scene_options(arguments.scene)
    given = {name: value for name in ONLY if (value := getattr(arguments, name)) is not None}
    for name in given:
        if ONLY[name] not in taken:
            raise ValueError(f"--{name} means nothing to {arguments.scene}: leave it out")
    tip = Fingertip.preset(given.pop("preset", "metamodel"), formulation=given.pop("formulation", "b-bar")) \
        if "fingertip" in taken else None
    return get_scene(arguments.scene, tip, **given)
