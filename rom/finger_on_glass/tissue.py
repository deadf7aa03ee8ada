"""The tissue: an isotropic ground matrix with families of collagen fibres that carry tension only (HGO).

W = c (I1bar - 3) + k1 / (2 k2) sum_a [exp(k2 <lambda_a^2 - 1>^2) - 1], with lambda_a^2 = a . Cbar a, Cbar = J^(-2/3) C:
Holzapfel, Gasser and Ogden, J. Elasticity 61 (2000) 1-48, as used in the publication (its equation 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rom.checks import choice, real_number, whole_number
from rom.finger_on_glass.section import Section, SectionMesh

VARIANTS = ("radial", "circumferential", "random")
PUBLISHED_K1 = {"radial": 0.150, "circumferential": 0.003, "random": 0.003}
"""Fibre stiffness of each variant [MPa]."""
FIBRE_CAP = 0.9
"""lambda^2 - 1 up to which the exponential is followed; trial states continue quadratically, answers end there."""


@dataclass(frozen=True)
class Tissue:
    """Properties of the tissue.

    Parameters
    ----------
    variant : {"radial", "circumferential", "random"}
        Along the gradient of the distance to the bone; around the bone; three families at a random angle and
        +-120 degrees at every integration point.
    c : float [MPa]
        Of the ground matrix; its shear modulus is ``2 c``.
    k1 : float [MPa], optional
        Of the fibres; default: the published one of the variant.
    k2 : float
        Rate at which fibres stiffen.
    bulk_ratio : float
        Bulk modulus over shear modulus.
    seed : int
        Of the random variant's angles.

    Raises
    ------
    ValueError
    """

    variant: str = "radial"
    c: float = 0.003
    k1: float | None = None
    k2: float = 15.0
    bulk_ratio: float = 1000.0
    seed: int = 0

    def __post_init__(self) -> None:
        choice("variant", self.variant, VARIANTS)
        if self.k1 is None:
            object.__setattr__(self, "k1", PUBLISHED_K1[self.variant])
        for name, least, most, unit in (("c", 0.0, 1e3, "MPa"), ("k1", 0.0, 1e3, "MPa"), ("k2", 0.0, 1e3, ""),
                                        ("bulk_ratio", 1.0, 1e8, "")):
            object.__setattr__(self, name, real_number(name, getattr(self, name), above=least, most=most, unit=unit))
        object.__setattr__(self, "seed", whole_number("seed", self.seed, 0))

    @property
    def bulk(self) -> float:
        """Bulk modulus [MPa]."""
        return 2.0 * self.c * self.bulk_ratio


def fibre_directions(tissue: Tissue, section: Section, mesh: SectionMesh) -> np.ndarray:
    """(n_quad, 4, n_family, 2) ndarray: unit vectors of the fibres at the integration points."""
    points = mesh.gauss_points()
    n_quad = len(points)
    if tissue.variant == "random":
        first = np.random.default_rng(tissue.seed).uniform(0, np.pi, (n_quad, 4, 1))
        angle = first + 2 * np.pi / 3 * np.array([0, 1, -1])
        return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    radial = section.radial_directions(points.reshape(-1, 2)).reshape(n_quad, 4, 1, 2)
    if tissue.variant == "radial":
        return np.ascontiguousarray(radial)
    return np.ascontiguousarray(np.stack([-radial[..., 1], radial[..., 0]], axis=-1))
