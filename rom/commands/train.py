"""`rom train`: train a network on a dataset, resumable."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rom.commands.progress import bar


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("train", help="train a network on a dataset, resumable: run again after a kill")
    parser.add_argument("method", metavar="METHOD", help="mlp, mlp-residual, pole-network or transformer")
    parser.add_argument("dataset", metavar="DATASET", type=Path,
                        help="made by `rom dataset`, for harmonic networks best with --whole")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE", help="weights, ending in .safetensors")
    parser.add_argument("--split", default="published", help="whose training cases: published (default) or hard")
    parser.add_argument("--size", default="large", help="small, medium or large (default)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="decides the weights (default 0)")
    parser.add_argument("--cases", type=int, metavar="N", help="learn from N random training cases (default: all)")
    parser.add_argument("--float32", action="store_true", help="store weights in single precision, not in half")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Train, save, and say what it took and what validation found."""
    from rom.metamodels.networks.weights import train_network

    model = train_network(
        arguments.method, arguments.dataset, arguments.output, size=arguments.size, split=arguments.split,
        seed=arguments.seed, cases=arguments.cases, storage="float32" if arguments.float32 else "float16",
        progress=lambda steps: bar(steps, "training"))
    validation = min(model.history.validation) if model.history else float("nan")
    print(f"{arguments.output}: {model.learned_from['cases']:,} cases of the {arguments.split} split, "
          f"{model.offline_seconds:.0f} s, validation error {validation:.1e} (root mean square)")
