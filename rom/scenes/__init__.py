"""The questions that the toolkit answers, a file a scene."""

from __future__ import annotations

import json

from rom.fingertip import Fingertip
from rom.scenes.harmonic_point_force import HarmonicPointForce
from rom.scenes.scene import NO_FORCE, CaseArrays, Scene
from rom.scenes.static_point_forces import StaticPointForces

__all__ = ["NO_FORCE", "SCENES", "CaseArrays", "HarmonicPointForce", "Scene", "StaticPointForces", "get_scene",
           "scene_from_json"]

SCENES: dict[str, type[Scene]] = {kind.name: kind for kind in (StaticPointForces, HarmonicPointForce)}


def get_scene(name: str, fingertip: Fingertip | None = None, outputs: str = "field") -> Scene:
    """The scene called ``name``, on the `metamodel` preset unless a fingertip is given.

    Raises
    ------
    ValueError
        For a name that is not a scene.
    """
    if name not in SCENES:
        raise ValueError(f"{name!r} is no scene: choose one of {', '.join(SCENES)}")
    return SCENES[name](fingertip or Fingertip.preset("metamodel"), outputs)


def scene_from_json(text: str) -> Scene:
    """The scene that :meth:`Scene.to_json` described."""
    record = json.loads(text)
    return get_scene(record["scene"], Scene.fingertip_from(record), record["outputs"])
