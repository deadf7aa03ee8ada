"""The rows of the conformance suite: every registered method on each scene that it answers, at tiny settings."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from rom.metamodels import METHODS, metamodel_class
from rom.scenes import SCENES, HarmonicPointForce

NETWORK = {"steps": 5, "width": 16, "depth": 1, "seed": 5}
SETTINGS: dict[str, tuple[dict[str, Any], ...]] = {
    "coarse-fem": ({"scale": 0.7},),
    "superposition": ({}, {"precision": "float32"}),
    "modal": ({"modes": 12}, {"modes": 12, "precision": "float32"}),
    "modal-static": ({"modes": 12},),
    "modal-krylov": ({"modes": 12, "vectors": 3}, {"modes": 12, "vectors": 3, "precision": "float32"}),
    "lookup-table": ({"modes": 12, "vectors": 3, "frequencies": 11, "loss_factors": 4},
                     {"modes": 12, "vectors": 3, "frequencies": 11, "loss_factors": 4, "precision": "float32"}),
    "pod-galerkin": ({"rank": 20}, {"rank": 20, "precision": "float32"}),
    "pod-regression": ({"rank": 20},),
    "transformer": (NETWORK | {"rank": 20, "heads": 2},),
    "mlp": (NETWORK | {"rank": 20},),
    "mlp-residual": (NETWORK | {"rank": 20, "modes": 12},),
    "pole-network": ({"rank": 20, "poles": 6, "steps": 5, "seed": 5},),
}
"""What keeps each fit below a second or two; a method that is not named here runs at its defaults."""

ON_ONE_SCENE: dict[tuple[str, str], tuple[dict[str, Any], ...]] = {
    ("pod-regression", "harmonic-point-force"): tuple(
        {"rank": 20, "regressor": name} for name in ("knn", "gp", "extra-trees")),
}
"""Further settings that a method takes on one scene alone."""


@dataclass(frozen=True)
class Row:
    """A method at a setting on a scene."""

    method: str
    scene: str
    settings: dict[str, Any] = field(default_factory=dict, hash=False)

    @property
    def network(self) -> bool:
        return METHODS[self.method][0].startswith("networks.")

    @property
    def single(self) -> bool:
        """Whether answers are computed in single precision somewhere."""
        return self.network or self.settings.get("precision") == "float32"

    @property
    def rounding(self) -> float:
        """What another order of the same operations may change of an answer's norm.

        About 1e3 units of single precision (6e-8); 1e-9 in double, since direct solves carry the condition of K
        (unit roundoff 1e-16 times a condition number of about 1e6).
        """
        return 1e-4 if self.single else 1e-9

    @property
    def suffix(self) -> str:
        return ".safetensors" if self.network else ".nc"

    @property
    def learns(self) -> bool:
        return metamodel_class(self.method).learns

    def __str__(self) -> str:
        precision = "-float32" if self.settings.get("precision") == "float32" else ""
        regressor = f"-{self.settings['regressor']}" if "regressor" in self.settings else ""
        return f"{self.method}{precision}{regressor}-{self.scene}"


ROWS = [Row(method, scene, settings) for method in METHODS for scene in SCENES
        if scene in metamodel_class(method).scenes
        for settings in (*SETTINGS.get(method, ({},)), *ON_ONE_SCENE.get((method, scene), ()))]
