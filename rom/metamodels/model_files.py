"""How a file of a fitted metamodel says what it is, and how one is refused that is something else."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rom.errors import SchemaError
from rom.scenes import Scene

MODEL_VERSION = "1.0"


def scene_attributes(scene: Scene) -> dict[str, str]:
    """Attributes that tie a fitted metamodel to its scene."""
    return {"model_version": MODEL_VERSION, "scene_parameters": scene.to_json(), "scene_hash": scene.content_hash,
            "mesh_hash": scene.mesh_hash}


def check_method(attributes: Mapping[str, Any], name: str, path: str | Path) -> None:
    """SchemaError for a file of another method or version."""
    if attributes.get("method") != name:
        raise SchemaError(f"{path} holds {attributes.get('method')!r}, not {name!r}: load it with its own class")
    if attributes.get("model_version") != MODEL_VERSION:
        raise SchemaError(f"{path} has model version {attributes.get('model_version')}, this software reads "
                          f"{MODEL_VERSION}: fit the metamodel again")


def check_fitted_scene(attributes: Mapping[str, Any], scene: Scene, path: str | Path) -> None:
    """SchemaError for a file that was fitted to another scene, body or mesh."""
    fitted = json.loads(attributes["scene_parameters"])["scene"]
    if fitted != scene.name:
        raise SchemaError(f"{path} was fitted to the scene {fitted!r}, not to {scene.name!r}: give its own scene")
    own = scene_attributes(scene)
    if any(attributes.get(name, own[name]) != own[name] for name in ("scene_hash", "mesh_hash")):
        raise SchemaError(f"{path} belongs to another body or mesh, or to other loads "
                          f"({str(attributes.get('scene_hash'))[:12]} instead of {scene.content_hash[:12]}): "
                          "fit the metamodel for this one")
