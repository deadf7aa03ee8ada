"""Every registered method on each small scene that it answers, at tiny settings."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp

from rom.bodies import Body, Loads
from rom.metamodels import METHODS, applicable, metamodel_class
from rom.scenes import LinearScene, get_scene

FINGERTIP = ("static-point-forces", "harmonic-point-force", "harmonic-patch-forces")
GLASS, COARSE_GLASS = "finger-on-glass", "finger-on-coarse-glass"
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
        {"rank": 20, "regressor": name} for name in ("ridge", "knn", "gp", "extra-trees")),
    ("coarse-fem", COARSE_GLASS): ({"scale": 0.9},),
    ("interpolation", GLASS): ({}, {"kind": "inverse-distance", "neighbours": 2}, {"kind": "nearest"}),
    ("pod-galerkin", GLASS): ({"rank": 8, "pressure_rank": 4},),
    ("pod-regression", GLASS): (
        {"rank": 8}, {"rank": 8, "registration": "slip"},
        {"rank": None, "regressor": "ridge", "registration": "none"}, {"rank": 8, "regressor": "knn"}),
    ("mlp", GLASS): ({"rank": 6, "width": 12, "depth": 2, "steps": 20, "seed": 5},),
    # eight loads span eight dimensions at rest, a few more at frequencies
    ("pod-galerkin", "springs"): ({"rank": 8},), ("pod-regression", "springs"): ({"rank": 8},),
    ("transformer", "springs"): (NETWORK | {"rank": 8, "heads": 2},),
    **{(method, "springs-at-a-frequency"): (NETWORK | {"rank": 8, **more},) for method, more in (
        ("mlp", {}), ("mlp-residual", {"modes": 12}))},
    ("pole-network", "springs-at-a-frequency"): ({"rank": 8, "poles": 6, "steps": 5, "seed": 5},),
}
"""Settings on one scene, in place of those above."""


def springs(harmonic: bool) -> LinearScene:
    """Sixty springs and masses in a row between two walls: two matrices and eight named loads, no mesh."""
    n, places = 60, np.arange(3, 60, 7)[:8]
    stiffness = 1e3 * sp.diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    columns = np.zeros((n, 8))
    columns[places, np.arange(8)] = 1.0
    position = np.column_stack([places / n, 0.1 * np.sin(places), 0.1 * np.cos(places)])
    loads = Loads.named(columns, [f"at-{place}" for place in places], position, position[::-1])
    body = Body(stiffness, sp.diags_array(np.full(n, 1e-3)) if harmonic else None, name="springs",
                dof_names=[f"mass-{i}" for i in range(n)])
    # the 60 natural frequencies lie between 8 and 318 Hz
    return LinearScene(body, loads, name="springs-at-a-frequency" if harmonic else "springs", frequency=(1.0, 60.0),
                       part=[f"mass-{place}" for place in places])


@dataclass(frozen=True)
class Row:
    """A method at a setting on a scene."""

    method: str
    scene: str
    settings: dict[str, Any] = field(default_factory=dict, hash=False)
    learns: bool = False
    seeded: bool = False

    @property
    def single(self) -> bool:
        """Whether answers are computed in single precision somewhere."""
        return self.seeded or self.settings.get("precision") == "float32"

    @property
    def rounding(self) -> float:
        """What another order of the same operations may change of an answer's norm.

        About 1e3 units of single precision (6e-8); 1e-9 in double, since direct solves carry the condition of K
        (unit roundoff 1e-16 times a condition number of about 1e6).
        """
        return 1e-4 if self.single or self.scene in (GLASS, COARSE_GLASS) else 1e-9

    def __str__(self) -> str:
        told = [str(value) for name, value in self.settings.items() if name in (
            "precision", "regressor", "registration", "kind")]
        return "-".join([self.method, *told, self.scene])


def small_scenes() -> dict[str, Any]:
    """The scenes of :data:`ROWS`, by name; those of the fingertip on the default mesh, of which nothing is made yet."""
    return {**{name: get_scene(name) for name in FINGERTIP}, GLASS: get_scene(GLASS, rays=40, layers=5),
            COARSE_GLASS: get_scene(GLASS, rays=36, layers=3),
            "springs": springs(False), "springs-at-a-frequency": springs(True)}


def _rows() -> list[Row]:
    rows = []
    for name, scene in small_scenes().items():
        for method, reason in applicable(scene).items():
            kind = metamodel_class(method, scene) if reason is None and method in METHODS else None
            # a path takes a second on the section that was learned from, a tenth on a coarser one
            if kind is not None and (name not in (GLASS, COARSE_GLASS) or kind.learns == (name == GLASS)):
                chosen = ON_ONE_SCENE.get((method, name), SETTINGS.get(method, ({},)))
                rows += [Row(method, name, settings, kind.learns, kind.seeded) for settings in chosen]
    return rows


ROWS = _rows()
