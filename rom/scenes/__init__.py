"""The questions that the toolkit answers, a file a scene; a third party's come in by the entry point ``rom.scenes``."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from rom.checks import shown
from rom.fingertip import Fingertip
from rom.scenes.cases import NO_FORCE, CaseArrays
from rom.scenes.fingertip_scene import fingertip_from
from rom.scenes.inputs import Input, Quantity
from rom.scenes.linear_scene import LinearScene
from rom.scenes.population import Population, RangePopulation
from rom.scenes.question import Question
from rom.scenes.scene import Answers, Cases, Scene

__all__ = ["NO_FORCE", "SCENES", "Answers", "CaseArrays", "Cases", "Input", "LinearScene", "Population", "Quantity",
           "Question", "RangePopulation", "Scene", "get_scene", "quick_scene", "scene_from_json", "scene_names",
           "scene_options"]

SCENES = {
    "static-point-forces": "rom.scenes.static_point_forces:static_point_forces",
    "harmonic-point-force": "rom.scenes.harmonic_point_force:harmonic_point_force",
    "harmonic-patch-forces": "rom.scenes.harmonic_patch_forces:harmonic_patch_forces",
    "finger-on-glass": "rom.scenes.finger_on_glass:FingerOnGlass",
}
"""Factories of the scenes that come with the toolkit, by name."""


@cache
def _factories() -> dict[str, str]:
    return {**{point.name: point.value for point in entry_points(group="rom.scenes")}, **SCENES}


def scene_names() -> list[str]:
    """Names of all scenes, third parties' last."""
    return [*SCENES, *(name for name in _factories() if name not in SCENES)]


def _factory(name: Any) -> Callable[..., Scene]:
    if not isinstance(name, str) or name not in _factories():
        raise ValueError(f"{shown(name)} is no scene: choose one of {', '.join(scene_names())}")
    module, _, member = _factories()[name].partition(":")
    return getattr(import_module(module), member)


def scene_options(name: str) -> list[str]:
    """Names of the arguments that a scene is made from: a fingertip, its own options; ValueError for no scene."""
    return list(inspect.signature(_factory(name)).parameters)


def get_scene(name: str, fingertip: Fingertip | None = None, outputs: str = "field", **options: Any) -> Any:
    """The scene called ``name``, on the `metamodel` preset unless a fingertip is given.

    Parameters
    ----------
    fingertip : Fingertip, optional
        Of scenes on a fingertip.
    outputs : str
        What the lean calls give: "field", or the scene's part.
    **options
        Of this scene alone, such as the ``sites`` of `harmonic-patch-forces` or the ``rays`` of `finger-on-glass`.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        For a name that is not a scene, or an option that the scene does not take.
    """
    factory = _factory(name)
    known = scene_options(name)
    unknown = [option for option in options if option not in known]
    if unknown:
        raise ValueError(f"{name} does not take the option {unknown[0]}: leave it out")
    if "fingertip" in known:
        options["fingertip"] = Fingertip.preset("metamodel") if fingertip is None else fingertip
    elif fingertip is not None:
        raise ValueError(f"{name} has a body of its own and takes no 3D fingertip: leave it out")
    return factory(outputs=outputs, **options)


def quick_scene(name: str) -> Any:
    """The scene called ``name`` on a coarse mesh: for checks that everything runs.

    A factory that takes a fingertip gets a coarse one; another says by its attribute ``quick_options`` what it takes.
    """
    factory = _factory(name)
    coarse = Fingertip.preset("quick") if "fingertip" in inspect.signature(factory).parameters else None
    return get_scene(name, coarse, **getattr(factory, "quick_options", {}))


def scene_from_json(text: str) -> Any:
    """The scene that its ``to_json`` described.

    Raises
    ------
    ValueError
        For any other text, and for a scene of a body that only its maker has.
    """
    try:
        record = json.loads(text)
        name, tip = record["scene"], fingertip_from(record) if "anatomy" in record else None
        if name not in _factories():
            raise ValueError(f"the scene {shown(name)} stands on a body that is not registered here: give the scene "
                             "itself, or register its factory as an entry point of the group rom.scenes")
        return get_scene(name, tip, record["outputs"], **record.get("options", {}))
    except (KeyError, TypeError, json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{shown(text)} describes no scene: write it with Scene.to_json") from error
