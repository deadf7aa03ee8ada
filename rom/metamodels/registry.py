"""The canonical names and where they live; a method's module is imported when it is asked for, not before."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from rom.datasets.storage import open_netcdf
from rom.errors import SchemaError
from rom.fingertip.shape import shown
from rom.metamodels.metamodel import Metamodel
from rom.scenes import Scene

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


def metamodel_class(name: str) -> type[Metamodel]:
    """The class called ``name``.

    Raises
    ------
    ValueError
        For an unknown method.
    """
    if not isinstance(name, str) or name not in METHODS:
        raise ValueError(f"{shown(name)} is no method: choose from {', '.join(METHODS)}")
    module, kind = METHODS[name]
    return getattr(import_module(f"rom.metamodels.{module}"), kind)


def create(name: str, scene: Scene, **settings: Any) -> Metamodel:
    """A metamodel of ``scene``, not yet fitted; ValueError for an unknown method, setting or scene."""
    kind = metamodel_class(name)
    if not isinstance(scene, Scene):
        raise ValueError(f"the scene is {shown(scene)}: make one with rom.scenes.get_scene")
    try:
        return kind(scene, **settings)
    except (TypeError, OverflowError) as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{name} does not take the settings {', '.join(settings)}: {reason}") from error


def applicable(scene_name: str) -> list[str]:
    """Names of the methods that answer a scene; imports every method's module but no torch."""
    return [name for name in METHODS if scene_name in metamodel_class(name).scenes]


def load(path: str | Path, scene: Scene | None = None) -> Metamodel:
    """Read any fitted metamodel back, whatever its method.

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
    if name not in METHODS:
        raise SchemaError(f"{path} is no metamodel of this toolkit: it names the method {name!r}")
    return metamodel_class(name).load(path, scene)
