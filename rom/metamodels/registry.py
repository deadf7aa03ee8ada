"""The canonical names and where they live; a method's module is imported when it is asked for, not before."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import Any

from rom.checks import shown
from rom.datasets.storage import open_netcdf
from rom.errors import SchemaError
from rom.scenes import CONTACT_SCENES, FingerOnGlass, Scene

METHODS: dict[str, tuple[str, str]] = {
    "direct": ("direct", "Direct"),
    "direct-reused": ("direct", "DirectReused"),
    "coarse-fem": ("coarse_fem", "CoarseFem"),
    "superposition": ("superposition", "Superposition"),
    "modal": ("modal", "Modal"),
    "modal-static": ("modal", "ModalStatic"),
    "modal-krylov": ("modal", "ModalKrylov"),
    "lookup-table": ("lookup_table", "LookupTable"),
    "pod-galerkin": ("pod", "PodGalerkin"),
    "pod-regression": ("regression", "PodRegression"),
    "transformer": ("networks.transformer", "Transformer"),
    "mlp": ("networks.mlp", "Mlp"),
    "mlp-residual": ("networks.mlp_residual", "MlpResidual"),
    "pole-network": ("networks.pole_network", "PoleNetwork"),
}
"""Of the linear scenes."""

CONTACT_METHODS: dict[str, tuple[str, str]] = {
    "direct": ("direct", "ContactDirect"),
    "coarse-fem": ("coarse_fem", "ContactCoarseFem"),
    "interpolation": ("interpolation", "ContactInterpolation"),
    "pod-galerkin": ("galerkin", "ContactGalerkin"),
    "pod-regression": ("regression", "ContactRegression"),
    "mlp": ("mlp", "ContactMlp"),
}
"""Of the scenes whose cases are load paths; the same name is the same idea."""


def metamodel_class(name: str, scene_name: str | None = None) -> Any:
    """The class called ``name``; with ``scene_name`` that which serves this scene, if any does.

    Raises
    ------
    ValueError
        For an unknown method, or one that a contact scene has no use for.
    """
    known = METHODS | CONTACT_METHODS
    if not isinstance(name, str) or name not in known:
        raise ValueError(f"{shown(name)} is no method: choose from {', '.join(known)}")
    if scene_name in CONTACT_SCENES:
        if name not in CONTACT_METHODS:
            raise ValueError(f"{name} does not apply to {scene_name}: choose from {', '.join(CONTACT_METHODS)}")
        return _class("contact.", *CONTACT_METHODS[name])
    return _class("", *METHODS[name]) if name in METHODS else _class("contact.", *CONTACT_METHODS[name])


def _class(folder: str, module: str, kind: str) -> Any:
    return getattr(import_module(f"rom.metamodels.{folder}{module}"), kind)


def create(name: str, scene: Scene | FingerOnGlass, **settings: Any) -> Any:
    """A metamodel of ``scene``, not yet fitted; ValueError for an unknown method, setting or scene.

    Returns
    -------
    Metamodel or ContactMetamodel
    """
    if not isinstance(scene, Scene | FingerOnGlass):
        metamodel_class(name)
        raise ValueError(f"the scene is {shown(scene)}: make one with rom.scenes.get_scene")
    kind = metamodel_class(name, scene.name)
    try:
        return kind(scene, **settings)
    except (TypeError, OverflowError) as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{name} does not take the settings {', '.join(settings)}: {reason}") from error


def applicable(scene_name: str) -> list[str]:
    """Names of the methods that answer a scene; imports the linear methods' modules but no torch."""
    if scene_name in CONTACT_SCENES:
        return list(CONTACT_METHODS)
    return [name for name in METHODS if scene_name in metamodel_class(name).scenes]


def load(path: str | Path, scene: Scene | FingerOnGlass | None = None) -> Any:
    """Read any fitted metamodel back, whatever its method.

    Returns
    -------
    Metamodel or ContactMetamodel

    Raises
    ------
    SchemaError
        Where the file is damaged, foreign or of another mesh.
    """
    if Path(path).suffix == ".safetensors":
        from rom.metamodels.networks.files import read_attributes

        attributes = read_attributes(path)
    else:
        with open_netcdf(path) as data:
            attributes = dict(data.attrs)
    name = attributes.get("method")
    if name not in METHODS | CONTACT_METHODS:
        raise SchemaError(f"{path} is no metamodel of this toolkit: it names the method {name!r}")
    return metamodel_class(name, _scene_name(attributes)).load(path, scene)


def _scene_name(attributes: dict[str, Any]) -> str | None:
    """Name of the scene that a file's metamodel was fitted to, if it says so."""
    try:
        return json.loads(attributes["scene_parameters"])["scene"]
    except (KeyError, TypeError, json.JSONDecodeError):
        return None
