"""`rom dataset` of the scenes whose cases are load paths: options of the section's mesh and of the cluster."""

from __future__ import annotations

import argparse

from rom.commands.progress import bar

OPTIONS = {"rays": "elements around the bone (default 100)", "layers": "elements from bone to skin (default 12)",
           "workers": "processes of the local cluster (default one a core; 1: no cluster)"}
LINEAR = ("preset", "formulation")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add ``--rays``, ``--layers``, ``--workers`` and ``--scheduler``."""
    group = parser.add_argument_group("of finger-on-glass")
    for name, text in OPTIONS.items():
        group.add_argument(f"--{name}", type=int, help=text)
    group.add_argument("--scheduler", metavar="ADDRESS", help="of a running dask cluster, such as tcp://host:8786")


def refuse_options(arguments: argparse.Namespace) -> None:
    """ValueError where an option of the load paths is given to a linear scene."""
    _refuse(arguments, (*OPTIONS, "scheduler"))


def run(arguments: argparse.Namespace) -> None:
    """Make the dataset and print its path.

    Raises
    ------
    ValueError
        For options of the linear scenes, and numbers that cannot be.
    """
    _refuse(arguments, LINEAR)
    if arguments.whole:
        raise ValueError(f"--whole is for harmonic-point-force, not for {arguments.scene}: say --cases")
    from rom.datasets.contact_paths import make_paths
    from rom.scenes import get_scene

    mesh = {name: getattr(arguments, name) for name in ("rays", "layers") if getattr(arguments, name) is not None}
    print(make_paths(get_scene(arguments.scene, **mesh), arguments.cases, arguments.output,
                     beyond=arguments.beyond or 0, seed=arguments.seed, compress=arguments.compress,
                     scheduler=arguments.scheduler, workers=arguments.workers,
                     progress=lambda items: bar(items, "paths")))


def _refuse(arguments: argparse.Namespace, names: tuple[str, ...]) -> None:
    for name in names:
        if getattr(arguments, name) is not None:
            raise ValueError(f"--{name} means nothing to {arguments.scene}: leave it out")
