"""The questions that the toolkit answers, a file a scene."""

from __future__ import annotations

import json
from typing import Any

from rom.checks import shown
from rom.fingertip import Fingertip
from rom.scenes.cases import NO_FORCE, CaseArrays
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.harmonic_patch_forces import HarmonicPatchForces
from rom.scenes.harmonic_point_force import HarmonicPointForce
from rom.scenes.paths import PathArrays
from rom.scenes.scene import Scene
from rom.scenes.static_point_forces import StaticPointForces

__all__ = ["CONTACT_SCENES", "NO_FORCE", "SCENES", "CaseArrays", "FingerOnGlass", "HarmonicPatchForces",
           "HarmonicPointForce", "PathArrays", "Scene", "StaticPointForces", "get_scene", "scene_from_json"]

SCENES: dict[str, type[Scene]] = {
    kind.name: kind for kind in (StaticPointForces, HarmonicPointForce, HarmonicPatchForces)}
"""The linear scenes, on the 3D fingertip."""
CONTACT_SCENES: dict[str, type[FingerOnGlass]] = {FingerOnGlass.name: FingerOnGlass}
"""The nonlinear ones, on a section: their cases are load paths."""


def get_scene(name: str, fingertip: Fingertip | None = None, outputs: str = "field", **options: Any) -> Any:
    """The scene called ``name``, on the `metamodel` preset unless a fingertip is given.

    Parameters
    ----------
    fingertip : Fingertip, optional
        Of the linear scenes.
    **options
        Of this scene alone, such as the ``sites`` of `harmonic-patch-forces` or the ``rays`` of `finger-on-glass`.

    Returns
    -------
    Scene or FingerOnGlass

    Raises
    ------
    ValueError
        For a name that is not a scene, or an option that the scene does not take.
    """
    if not isinstance(name, str) or name not in {**SCENES, **CONTACT_SCENES}:
        raise ValueError(f"{shown(name)} is no scene: choose one of {', '.join([*SCENES, *CONTACT_SCENES])}")
    kind: Any = SCENES.get(name) or CONTACT_SCENES[name]
    unknown = [option for option in options if option not in kind.__dataclass_fields__]
    if unknown:
        raise ValueError(f"{name} does not take the option {unknown[0]}: leave it out")
    if name in CONTACT_SCENES:
        if fingertip is not None:
            raise ValueError(f"{name} has a section of its own and takes no 3D fingertip: give section=..., or nothing")
        return kind(outputs=outputs, **options)
    return kind(Fingertip.preset("metamodel") if fingertip is None else fingertip, outputs, **options)


def scene_from_json(text: str) -> Any:
    """The scene that its ``to_json`` described.

    Raises
    ------
    ValueError
        For any other text.
    """
    try:
        record = json.loads(text)
        tip = None if record["scene"] in CONTACT_SCENES else Scene.fingertip_from(record)
        return get_scene(record["scene"], tip, record["outputs"], **record.get("options", {}))
    except (KeyError, TypeError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{shown(text)} describes no scene: write it with Scene.to_json") from error
