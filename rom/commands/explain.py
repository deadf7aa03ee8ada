"""`rom explain`: what a scene and a method build, what they leave out and why."""

from __future__ import annotations

import argparse
from typing import Any

from rom.commands.fingertip_options import add_fingertip_options, fingertip_from


def add(commands: Any) -> None:
    """Add the sub-command."""
    parser = commands.add_parser("explain", help="the plan of a scene: what is built, what is left out and why")
    parser.add_argument("scene", metavar="SCENE")
    parser.add_argument("--method", metavar="NAME", help="default: the one that is recommended for the scene")
    parser.add_argument("--outputs", metavar="WHAT", help="field (default) or pad")
    add_fingertip_options(parser, preset="metamodel")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Draw up the plan and print it."""
    from rom.comparison.plan import explain, plan
    from rom.scenes import get_scene

    print(explain(plan(get_scene(arguments.scene, fingertip_from(arguments)), arguments.method, arguments.outputs)))
