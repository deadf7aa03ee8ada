"""The questions that the toolkit answers, a file a scene."""

from __future__ import annotations

import json
from typing import Any

from rom.fingertip import Fingertip
from rom.fingertip.shape import shown
from rom.scenes.cases import NO_FORCE, CaseArrays
from rom.scenes.harmonic_patch_forces import HarmonicPatchForces
from rom.scenes.harmonic_point_force import HarmonicPointForce
from rom.scenes.scene import Scene
from rom.scenes.static_point_forces import StaticPointForces

__all__ = ["NO_FORCE", "SCENES", "CaseArrays", "HarmonicPatchForces", "HarmonicPointForce", "Scene",
           "StaticPointForces", "get_scene", "scene_from_json"]

SCENES: dict[str, type[Scene]] = {
    kind.name: kind for kind in (StaticPointForces, HarmonicPointForce, HarmonicPatchForces)}


def get_scene(name: str, fingertip: Fingertip | None = None, outputs: str = "field", **options: Any) -> Scene:
    """The scene called ``name``, on the `metamodel` preset unless a fingertip is given.

    Parameters
    ----------
    **options
        Of this scene alone, such as the ``sites`` of `harmonic-patch-forces`.

    Raises
    ------
    ValueError
        For a name that is not a scene, or an option that the scene does not take.
    """
    if not isinstance(name, str) or name not in SCENES:
        raise ValueError(f"{shown(name)} is no scene: choose one of {', '.join(SCENES)}")
    kind = SCENES[name]
    unknown = [option for option in options if option not in kind.__dataclass_fields__]
    if unknown:
        raise ValueError(f"{name} does not take the option {unknown[0]}: leave it out")
    return kind(Fingertip.preset("metamodel") if fingertip is None else fingertip, outputs, **options)


def scene_from_json(text: str) -> Scene:
    """The scene that :meth:`Scene.to_json` described.

    Raises
    ------
    ValueError
        For any other text.
    """
    try:
        record = json.loads(text)
        return get_scene(record["scene"], Scene.fingertip_from(record), record["outputs"], **record.get("options", {}))
    except (KeyError, TypeError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{shown(text)} describes no scene: write it with Scene.to_json") from error
