"""Extremes of the fingertip itself: nearly incompressible, stiff, soft, missing and very thin tissues."""

from __future__ import annotations

from dataclasses import replace

from atlas.level import (
    POINT,
    STATIC,
    Level,
    dimension_change,
    full_order,
    harmonic_cases,
    networks,
    static_cases,
    tissue_change,
)
from rom.fingertip import Fingertip

LOCKING = 0.25
"""Difference of full integration to B-bar that is right: at Poisson's ratio 0.3, where nothing locks, the two differ by
about 0.2 on the atlas's coarse mesh."""


def _pair(axis: str, name: str, words: str, change, **options) -> list[Level]:
    """The same fingertip asked at rest and at 30 and 150 Hz; networks see inputs and no matrices, so are left out."""
    options["skip"] = networks()
    return [Level(axis, f"{name}, static", f"{words}, at rest", STATIC, static_cases, change, **options),
            Level(axis, f"{name}, vibrating", f"{words}, at 30 and 150 Hz", POINT, harmonic_cases([30.0, 150.0]),
                  change, **options)]


def nearly_incompressible(ratio: float):
    """Dermis and hypodermis of this Poisson's ratio."""
    return tissue_change(dermis={"poisson_ratio": ratio}, hypodermis={"poisson_ratio": ratio})


def incompressibility() -> list[Level]:
    """Poisson's ratio of the soft tissues up to nearly one half, as the fingertip is and fully integrated."""
    levels = []
    for ratio in (0.3, 0.48, 0.499, 0.4999, 0.49999, 0.4999999):
        levels += _pair("incompressibility", f"ν {ratio}", f"Poisson's ratio {ratio} of dermis and hypodermis",
                        nearly_incompressible(ratio))
    for ratio in (0.3, 0.48, 0.499, 0.49999):  # locked or not, the matrices are well solved: B-bar is the judge
        change = nearly_incompressible(ratio)

        def full(tip: Fingertip, change=change) -> Fingertip:
            return replace(change(tip), formulation="full")
        words = f"full integration at Poisson's ratio {ratio}, against B-bar on the same mesh"
        levels += [
            Level("incompressibility", f"full ν {ratio}, static", f"{words}, at rest", STATIC, static_cases, full,
                  truth=change, methods=full_order(), tolerance=LOCKING),
            Level("incompressibility", f"full ν {ratio}, vibrating", f"{words}, at 30 and 150 Hz", POINT,
                  harmonic_cases([30.0, 150.0]), full, truth=change, methods=full_order(),
                  tolerance=LOCKING)]
    return levels


def nail() -> list[Level]:
    """The nail plate from missing to stiffer than any material."""
    levels = []
    for modulus, name in ((170.0, "as published"), (17e3, "17 GPa"), (1.7e6, "1.7 TPa"), (1.7e9, "1.7 PPa"),
                          (0.034, "soft as hypodermis"), (3.4e-8, "missing")):
        levels += _pair("nail", name, f"a nail plate of {modulus:g} MPa",
                        tissue_change(nail_plate={"elastic_modulus": modulus}))
    return levels


def soft_hypodermis() -> list[Level]:
    """The hypodermis from published to hardly there."""
    levels = []
    for modulus in (0.034, 0.34e-3, 0.34e-5, 0.34e-8):
        levels += _pair("soft hypodermis", f"{1e3 * modulus:g} kPa", f"a hypodermis of {1e3 * modulus:g} kPa",
                        tissue_change(hypodermis={"elastic_modulus": modulus}))
    return levels


def slivers() -> list[Level]:
    """Layers so thin that elements become slivers."""
    levels = []
    for field, thickness in (("epidermis_thickness", 0.1), ("epidermis_thickness", 0.005),
                             ("epidermis_thickness", 1e-4), ("epidermis_thickness", 1e-7),
                             ("stratum_corneum_thickness", 0.005), ("nail_plate_thickness", 0.005),
                             ("dermis_thickness", 0.005)):
        layer = field.removesuffix("_thickness").replace("_", " ")
        levels += _pair("slivers", f"{layer} {thickness:g} mm", f"{layer} {thickness:g} mm thin",
                        dimension_change(**{field: thickness}))
    return levels
