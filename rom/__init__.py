"""Reduced-order models side by side: which metamodel can be trusted, how wrong it is, and how much faster.

The names below are all that most users need; each is imported when it is first asked for, so that ``import rom`` itself
costs next to nothing.

Examples
--------
A plate of two masses on springs, from two matrices and named degrees of freedom:

>>> import numpy as np, scipy.sparse as sp, rom
>>> stiffness = sp.csr_array([[300.0, -100.0], [-100.0, 100.0]])
>>> mass = sp.csr_array(np.diag([1e-3, 2e-3]))
>>> body = rom.Body(stiffness, mass, dof_names=["root", "tip"], name="two-masses")
>>> scene = rom.LinearScene(body, rom.Loads.named([[0.0], [1.0]], ["tip"]), frequency=(1.0, 60.0))
>>> cases = scene.cases_from(scene.sample(3, seed=0))
>>> answer = rom.solve(scene, cases, tolerance=1e-9)
>>> sorted(answer.displacement.dims)
['case', 'dof']
>>> bool((answer.error_estimate < 1e-9).all())
True
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

_PUBLIC = {
    "Anatomy": "rom.fingertip",
    "Body": "rom.bodies",
    "Curve": "rom.metamodels",
    "Fingertip": "rom.fingertip",
    "Grid": "rom.bodies",
    "LinearScene": "rom.scenes",
    "Loads": "rom.bodies",
    "Metamodel": "rom.metamodels",
    "Scene": "rom.scenes",
    "SecondOrderModel": "rom.fullorder",
    "Stored": "rom.metamodels",
    "ValidityWarning": "rom.metamodels",
    "compare": "rom.comparison",
    "create": "rom.metamodels",
    "load": "rom.metamodels",
    "make_dataset": "rom.datasets",
    "open_dataset": "rom.datasets",
    "register": "rom.metamodels",
    "solve": "rom.solving",
    "write_report": "rom.reporting",
}
"""Where each public name lives."""

__all__ = ["Anatomy", "Body", "Curve", "Fingertip", "Grid", "LinearScene", "Loads", "Metamodel", "Scene",
           "SecondOrderModel", "Stored", "ValidityWarning", "compare", "create", "load", "make_dataset", "open_dataset",
           "register", "scene", "solve", "write_report"]

if TYPE_CHECKING:
    from rom.bodies import Body, Grid, Loads
    from rom.comparison import compare
    from rom.datasets import make_dataset, open_dataset
    from rom.fingertip import Anatomy, Fingertip
    from rom.fullorder import SecondOrderModel
    from rom.metamodels import Curve, Metamodel, Stored, ValidityWarning, create, load, register
    from rom.reporting import write_report
    from rom.scenes import LinearScene, Scene
    from rom.scenes import get_scene as scene
    from rom.solving import solve


def __getattr__(name: str) -> Any:
    """A public name, imported when it is first asked for."""
    if name == "scene":
        return import_module("rom.scenes").get_scene
    if name not in _PUBLIC:
        raise AttributeError(f"module 'rom' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
