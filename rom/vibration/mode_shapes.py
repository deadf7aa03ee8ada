"""What a mode shape looks like, in numbers, and whether it looks as published.

The modal study (Serhat and Kuchenbecker, Appl. Sci. 2021, 11, 5709, section 4.2) describes its first seven modes in
words, from pictures. Each description becomes a criterion on measures that are shares (0 to 1) or signed (-1 to 1).
The thresholds are the natural ones: more than half, larger than the competing pattern, of opposite sign; none is
tuned, but which pattern stands for which words was chosen with computed modes in view. A mode may meet several
descriptions or none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rom.fingertip import FingertipMesh
from rom.vibration.parity import ANTISYMMETRIC, SYMMETRIC
from rom.vibration.skin_motion import Floats, Ints, Skin, on_all_nodes, opposition

HALF = 0.5

MEASURES = {
    "torsion": "share of the skin's motion in a rigid rotation about the bone's axis",
    "lateral_rotation": "share of the skin's motion in the best rigid rotation about a line parallel to y",
    "pad_slide": "share of the motion of the skin's lower half in one translation along the finger",
    "distal_lateral": "share of the distal skin's motion in one lateral translation",
    "distal_torsion": "share of the distal skin's motion in a rotation about the bone's axis",
    "proximal_lateral": "share of the proximal skin's motion in one lateral translation",
    "proximal_torsion": "share of the proximal skin's motion in a rotation about the bone's axis",
    "contraction": "opposition of normal motion at the fingerprint centroid and at the sides",
    "side_lengthwise": "opposition of the two sides' common normal motion, distal against proximal",
    "lower_normal": "share of normal motion in the motion of the lower-left and lower-right skin",
    "lower_diagonal": "opposition of normal motion of the lower sides, distal against proximal",
    "vertical_antiphase": "share of the skin's motion in vertical motion, distal against proximal",
    "vertical_uniform": "share of the skin's motion in one vertical translation",
    "longitudinal_uniform": "share of the skin's motion in one translation along the finger",
    "side_diagonal": "opposition of left-right normal motion of the sides, distal against proximal",
}
"""Measures by name; all dimensionless."""

SIGNED = ("contraction", "side_lengthwise", "lower_diagonal", "side_diagonal")
"""Measures from -1 (in phase) to 1 (out of phase); the others are shares, 0 to 1."""


def shape_measures(mesh: FingertipMesh, free_dofs: Ints, shape: Floats) -> dict[str, Floats]:
    """Every measure of `MEASURES` for each mode.

    Parameters
    ----------
    mesh : FingertipMesh
    free_dofs : (n_free,) ndarray
    shape : (n_free, m) ndarray
        Of any scale and sign, none of which matters.

    Returns
    -------
    measures : dict of (m,) ndarray [1]
        Keyed as `MEASURES`.

    Notes
    -----
    Distal and proximal part at the fingerprint centroid, about which the descriptions speak. Sides and lower sides are
    octants of the section (see `rom.vibration.skin_motion`); half the difference of left and right counts.
    """
    skin = Skin(mesh)
    field = on_all_nodes(mesh, free_dofs, shape)[mesh.skin_nodes]
    normal = skin.normal_motion(field)
    rms = np.sqrt(np.einsum("i,ijm->m", skin.area, field**2) / skin.area.sum())
    distal, proximal = skin.distal, ~skin.distal
    lateral, torsion = [skin.translation(1)], [skin.torsion()]
    centroid = skin.mean(normal, skin.centroid_patch)
    sides_distal, sides_proximal = (skin.mean(normal, skin.sides & part) for part in (distal, proximal))
    lower = np.where(skin.lower_sides, skin.area, 0.0)
    antiphase = np.where(distal, 1.0, -1.0)[:, None] * skin.translation(2)

    def diagonal(region: NDArray[np.bool_]) -> Floats:
        here, there = (skin.left_minus_right(normal, region & part) for part in (distal, proximal))
        return opposition(here, there, rms)

    return {
        "torsion": skin.share(torsion, field),
        "lateral_rotation": skin.lateral_axis(field)[0],
        "pad_slide": skin.share([skin.translation(0)], field, skin.lower_half),
        "distal_lateral": skin.share(lateral, field, distal),
        "distal_torsion": skin.share(torsion, field, distal),
        "proximal_lateral": skin.share(lateral, field, proximal),
        "proximal_torsion": skin.share(torsion, field, proximal),
        "contraction": opposition(centroid, skin.mean(normal, skin.sides), rms),
        "side_lengthwise": opposition(sides_distal, sides_proximal, rms),
        "lower_normal": _part(lower @ normal**2, np.einsum("i,ijm->m", lower, field**2)),
        "lower_diagonal": diagonal(skin.lower_sides),
        "vertical_antiphase": skin.share([antiphase], field),
        "vertical_uniform": skin.share([skin.translation(2)], field),
        "longitudinal_uniform": skin.share([skin.translation(0)], field),
        "side_diagonal": diagonal(skin.sides),
    }


def _part(held: Floats, whole: Floats) -> Floats:
    return np.divide(held, whole, out=np.zeros_like(whole), where=whole > 0)


@dataclass(frozen=True)
class Description:
    """A published mode shape as a criterion.

    Parameters
    ----------
    mode : int
        Published mode number.
    words : str
        What is described.
    parity : str
        That the description implies.
    rule : str
        The criterion in words, beside the parity.
    holds : callable
        Measures to (m,) ndarray of bool.
    """

    mode: int
    words: str
    parity: str
    rule: str
    holds: Callable[[Mapping[str, Floats]], NDArray[np.bool_]]


DESCRIPTIONS = (
    Description(
        1, "torsion about the bone", ANTISYMMETRIC,
        "a rotation about the bone's axis holds more than half of the skin's motion",
        lambda m: m["torsion"] > HALF,
    ),
    Description(
        2, "rotation about the lateral axis", SYMMETRIC,
        "a rotation about a lateral axis holds more than half of the skin's motion, and carries the pad along: more "
        "than half of the lower half's motion is one slide along the finger",
        lambda m: (m["lateral_rotation"] > HALF) & (m["pad_slide"] > HALF),
    ),
    Description(
        3, "distal part moves sideways, torsion at the proximal side", ANTISYMMETRIC,
        "sideways translation outweighs torsion in the distal skin, torsion outweighs it in the proximal skin",
        lambda m: (m["distal_lateral"] > m["distal_torsion"]) & (m["proximal_torsion"] > m["proximal_lateral"]),
    ),
    Description(
        4, "contraction about the fingerprint centroid, expansion at the sides", SYMMETRIC,
        "normal motion at the centroid and at the sides is out of phase; along the finger the sides are in phase, and "
        "vertical motion is rather in phase than out of phase",
        lambda m: (m["contraction"] > 0) & (m["side_lengthwise"] < 0)
        & (m["vertical_uniform"] > m["vertical_antiphase"]),
    ),
    Description(
        5, "out-of-phase normal motion of lower left and lower right", ANTISYMMETRIC,
        "the lower left and right move mostly along their normal, distal and proximal parts in phase",
        lambda m: (m["lower_normal"] > HALF) & (m["lower_diagonal"] < 0),
    ),
    Description(
        6, "out-of-phase vertical motion of distal and proximal sections", SYMMETRIC,
        "vertical motion of distal against proximal skin outweighs one vertical and one longitudinal translation",
        lambda m: m["vertical_antiphase"] > np.maximum(m["vertical_uniform"], m["longitudinal_uniform"]),
    ),
    Description(
        7, "distal left and proximal right against distal right and proximal left", ANTISYMMETRIC,
        "each side moves normally out of phase with itself, distal against proximal, and the distal part does not "
        "simply move sideways (less than half of its motion)",
        lambda m: (m["side_diagonal"] > 0) & (m["distal_lateral"] < HALF),
    ),
)
"""The seven published descriptions in order."""


def descriptions_met(measures: Mapping[str, Floats], parity: NDArray[np.str_]) -> NDArray[np.bool_]:
    """Which mode meets which description.

    Parameters
    ----------
    measures : mapping of (m,) ndarray
        Of `shape_measures`.
    parity : (m,) ndarray of str
        Of `rom.vibration.parity.parity`.

    Returns
    -------
    met : (7, m) ndarray of bool
        Descriptions in the order of `DESCRIPTIONS`.
    """
    names = np.asarray(parity)
    return np.stack([(names == one.parity) & one.holds(measures) for one in DESCRIPTIONS])
