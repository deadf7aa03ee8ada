"""Eight-node hexahedra of the fingertip: those of `rom.bodies.elements`, without locking by default.

Neither formulation mends bending: slender parts need elements short against their thickness.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.bodies import elements
from rom.bodies.elements import assemble
from rom.checks import shown

__all__ = ["Formulation", "assemble", "check_formulation", "element_mass", "element_stiffness", "element_volumes"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Formulation = Literal["b-bar", "full"]
KIND = "hexahedron"


def check_formulation(formulation: str) -> None:
    """Raise ValueError unless the formulation is known."""
    known = get_args(Formulation)
    if not isinstance(formulation, str) or formulation not in known:
        raise ValueError(f"Formulation is {shown(formulation)}, but only {' and '.join(known)} exist: choose one.")


def element_stiffness(
    nodes: Floats,
    hexahedra: Ints,
    shear_modulus: ArrayLike,
    bulk_modulus: ArrayLike,
    formulation: Formulation = "b-bar",
) -> Floats:
    """(e, 24, 24) ndarray [N/m]: stiffness of each element; parameters as `rom.bodies.elements.element_stiffness`."""
    check_formulation(formulation)
    return elements.element_stiffness(KIND, nodes, hexahedra, shear_modulus, bulk_modulus, formulation)


def element_mass(nodes: Floats, hexahedra: Ints, density: ArrayLike) -> Floats:
    """(e, 8, 8) ndarray [kg]: consistent mass of each element for one component of displacement."""
    return elements.element_mass(KIND, nodes, hexahedra, density)


def element_volumes(nodes: Floats, hexahedra: Ints) -> Floats:
    """Volume of each element: (e,) ndarray [m3]."""
    return elements.geometry(KIND, nodes, hexahedra)[1].sum(axis=1)
