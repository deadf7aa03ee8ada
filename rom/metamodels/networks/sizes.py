"""Three sizes of every network, for curves of error against size, and where trained weights of them lie.

The last size has the defaults of its class.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rom.provenance import PACKAGE
from rom.scenes import Scene

FOLDER = PACKAGE.parent / "data" / "weights"
TRAINED = "trained"
"""A setting that comparisons know: the size whose weights come with the toolkit, trained on the whole published set.
Without it a network learns from the comparison's own snapshots, as all other learners do."""
LARGE = {TRAINED: "large"}
SIZES: dict[str, dict[str, dict[str, Any]]] = {
    "transformer": {"small": {"width": 32, "heads": 2}, "medium": {"width": 48}, "large": {}},
    "mlp": {"small": {"rank": 200, "terms": 16, "width": 32, "steps": 200},
            "medium": {"rank": 250, "terms": 22, "width": 48, "steps": 300}, "large": {}},
    "mlp-residual": {"small": {"modes": 20, "rank": 32, "width": 16}, "medium": {"modes": 30, "rank": 64}, "large": {}},
    "pole-network": {"small": {"rank": 64, "poles": 12}, "medium": {"rank": 96, "poles": 15}, "large": {}},
}


def settings_of_size(method: str, size: str) -> dict[str, Any]:
    """Settings of a network at a size.

    Raises
    ------
    ValueError
        For a method or size that does not exist.
    """
    if method not in SIZES:
        raise ValueError(f"{method!r} is no network: choose from {', '.join(SIZES)}")
    if size not in SIZES[method]:
        raise ValueError(f"{size!r} is no size of {method}: choose from {', '.join(SIZES[method])}")
    return dict(SIZES[method][size])


def weights_path(method: str, size: str = "large", split: str = "published") -> Path:
    """Where trained weights lie, if they come with the toolkit; ValueError for a method or size that does not exist."""
    settings_of_size(method, size)
    return FOLDER / f"{method}-{size}-{split}.safetensors"


def trained_here(method: str, scene: Scene, size: str = "large") -> bool:
    """Whether trained weights of a network come with the toolkit for this scene's mesh."""
    from rom.datasets.tensors import read_attributes

    path = weights_path(method, size)
    return path.exists() and read_attributes(path)["mesh_hash"] == scene.mesh_hash


def constructor_settings(method: str, settings: dict[str, Any]) -> dict[str, Any]:
    """What the method's class is made with: the settings of the size where trained weights are named."""
    if TRAINED not in settings:
        return settings
    return {**settings_of_size(method, settings[TRAINED]), **{k: v for k, v in settings.items() if k != TRAINED}}
