"""`rom scenes`: every scene, what it needs and what it leaves out, and which methods answer it."""

from __future__ import annotations

import argparse
from typing import Any


def add(commands: Any) -> None:
    """Add the sub-command."""
    commands.add_parser("scenes", help="list the scenes, what each needs and what it leaves out").set_defaults(run=run)


def run(_: argparse.Namespace) -> None:
    """Print them."""
    from rom.metamodels import applicable
    from rom.scenes import get_scene, scene_names

    for name in scene_names():
        scene = get_scene(name)
        print(f"{scene.name}: {scene.title}\n  question    {scene.question}")
        print(f"  gate        {scene.gate:.0%} at the maximum over held-out cases")
        reasons = applicable(scene)
        _print("inputs", {one.name: one.text for one in scene.inputs})
        _print("needs", scene.needs)
        _print("leaves out", scene.leaves_out)
        print(f"  outputs     full field{f', or the {scene.part_words} alone' if scene.part else ''}")
        print(f"  methods     {', '.join(method for method, reason in reasons.items() if reason is None)}")
        _print("not", {method: reason for method, reason in reasons.items() if reason is not None})
        print()


def _print(heading: str, entries: dict[str, str]) -> None:
    for i, (name, text) in enumerate(entries.items()):
        print(f"  {heading if i == 0 else '':<11} {name}: {text}")
