"""The canonical names and where they live; a method's module is imported when it is asked for, not before.

A name may stand for several classes, one for each kind of scene: the same name is the same idea. Third parties' methods
come in by the entry point group ``rom.metamodels`` (``name = "module:Class"``), or by :func:`register`.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from rom.checks import shown
from rom.datasets.storage import open_netcdf
from rom.datasets.tensors import read_attributes
from rom.errors import SchemaError
from rom.metamodels.metamodel import Metamodel
from rom.scenes import Scene, scene_from_json

METHODS: dict[str, tuple[str, ...]] = {
    "direct": ("rom.metamodels.direct:Direct", "rom.metamodels.finger_on_glass.direct:PathDirect"),
    "direct-reused": ("rom.metamodels.direct:DirectReused",),
    "coarse-fem": ("rom.metamodels.coarse_fem:CoarseFem", "rom.metamodels.finger_on_glass.coarse_fem:PathCoarseFem"),
    "superposition": ("rom.metamodels.superposition:Superposition",),
    "modal": ("rom.metamodels.modal:Modal",),
    "modal-static": ("rom.metamodels.modal:ModalStatic",),
    "modal-krylov": ("rom.metamodels.modal:ModalKrylov",),
    "lookup-table": ("rom.metamodels.lookup_table:LookupTable",),
    "interpolation": ("rom.metamodels.finger_on_glass.interpolation:PathInterpolation",),
    "pod-galerkin": ("rom.metamodels.pod:PodGalerkin", "rom.metamodels.finger_on_glass.galerkin:PathGalerkin"),
    "pod-regression": ("rom.metamodels.regression:PodRegression",
                       "rom.metamodels.finger_on_glass.regression:PathRegression"),
    "transformer": ("rom.metamodels.networks.transformer:Transformer",),
    "mlp": ("rom.metamodels.networks.mlp:Mlp", "rom.metamodels.finger_on_glass.mlp:PathMlp"),
    "mlp-residual": ("rom.metamodels.networks.mlp_residual:MlpResidual",),
    "pole-network": ("rom.metamodels.networks.pole_network:PoleNetwork",),
}
"""Where the methods that come with the toolkit live, by name."""
_REGISTERED: dict[str, tuple[type[Metamodel], ...]] = {}


def register(kind: type[Metamodel]) -> type[Metamodel]:
    """Make a class known under its name for as long as this process lives; usable as a decorator.

    Raises
    ------
    ValueError
        For something that is no metamodel, or a name that is taken.
    """
    named = isinstance(getattr(kind, "name", None), str)
    if not isinstance(kind, type) or not issubclass(kind, Metamodel) or not named:
        raise ValueError(f"{shown(kind)} is no metamodel with a name: derive it from rom.Metamodel")
    if kind.name in METHODS or any(known.__qualname__ != kind.__qualname__ for known in _REGISTERED.get(kind.name, ())):
        raise ValueError(f"the name {kind.name!r} is taken: give the method another")
    _REGISTERED[kind.name] = (kind,)
    return kind


@cache
def _third_parties() -> dict[str, tuple[str, ...]]:
    return {point.name: (point.value,) for point in entry_points(group="rom.metamodels") if point.name not in METHODS}


def method_names() -> list[str]:
    """Names of all methods, the toolkit's own first."""
    return [*METHODS, *_third_parties(), *(name for name in _REGISTERED if name not in _third_parties())]


def metamodel_classes(name: str) -> tuple[type[Metamodel], ...]:
    """The classes called ``name``.

    Raises
    ------
    ValueError
        For an unknown method.
    """
    if isinstance(name, str) and name in _REGISTERED:
        return _REGISTERED[name]
    places = {**_third_parties(), **METHODS}
    if not isinstance(name, str) or name not in places:
        raise ValueError(f"{shown(name)} is no method: choose from {', '.join(method_names())}")
    found = []
    for place in places[name]:
        module, _, member = place.partition(":")
        found.append(getattr(import_module(module), member))
    return tuple(found)


def metamodel_class(name: str, scene: Scene) -> type[Metamodel]:
    """The class called ``name`` that answers a scene.

    Raises
    ------
    ValueError
        For an unknown method, or one that does not apply, with the reason.
    """
    reasons = []
    for kind in metamodel_classes(name):
        reason = kind.why_not(scene)
        if reason is None:
            return kind
        reasons.append(reason)
    raise ValueError(f"{name} does not apply to {scene.name}: {reasons[0]}")


def create(name: str, scene: Scene, **settings: Any) -> Any:
    """A metamodel of ``scene``, not yet fitted; ValueError for an unknown method, setting or scene.

    Returns
    -------
    Metamodel
    """
    if not isinstance(scene, Scene):
        metamodel_classes(name)
        raise ValueError(f"the scene is {shown(scene)}: make one with rom.scene or rom.LinearScene")
    kind = metamodel_class(name, scene)
    try:
        return kind(scene, **settings)
    except (TypeError, OverflowError) as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{name} does not take the settings {', '.join(settings)}: {reason}") from error


def applicable(scene: Scene) -> dict[str, str | None]:
    """Every method with the reason why it does not apply to a scene, or None; imports no torch."""
    found: dict[str, str | None] = {}
    for name in method_names():
        reasons = [kind.why_not(scene) for kind in metamodel_classes(name)]
        found[name] = None if None in reasons else reasons[0]
    return found


def load(path: str | Path, scene: Scene | None = None) -> Any:
    """Read any fitted metamodel back, whatever its method.

    Returns
    -------
    Metamodel

    Raises
    ------
    SchemaError
        Where the file is damaged, foreign or of another mesh.
    """
    if Path(path).suffix == ".safetensors":
        attributes = read_attributes(path)
    else:
        with open_netcdf(path) as data:
            attributes = dict(data.attrs)
    name = attributes.get("method")
    if name not in method_names():
        raise SchemaError(f"{path} is no metamodel of this toolkit: it names the method {shown(name)}")
    try:
        scene = scene or scene_from_json(attributes["scene_parameters"])
    except (KeyError, ValueError) as error:
        raise SchemaError(f"{path} does not say to which scene it was fitted ({error}): give the scene") from error
    kinds = metamodel_classes(name)
    fitting = [kind for kind in kinds if kind.why_not(scene) is None]
    return (fitting or kinds)[0].load(path, scene)
