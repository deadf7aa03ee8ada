"""Volumetric locking: where fully integrated elements are too stiff to be believed."""

from __future__ import annotations

from rom.fingertip.anatomy import TISSUES
from rom.fingertip.fingertip import Fingertip

LOCKED = 0.49
"""Poisson's ratio above which full integration locks on the presets: f1 rises by 4 % at .495, 18 % at .499."""
LOCKED_WHERE_COARSE = 0.45
LAYERS = 6
"""Element layers in dermis and hypodermis, as both presets have, below which it locks sooner."""


def locking_reason(fingertip: Fingertip) -> str:
    """Why a fully integrated fingertip is too stiff, or nothing.

    Parameters
    ----------
    fingertip : Fingertip

    Returns
    -------
    str
        One clause; empty for B-bar, which does not lock.
    """
    if fingertip.formulation != "full":
        return ""
    ratio = max(fingertip.anatomy.tissue(name).poisson_ratio for name in TISSUES)
    coarse = sum(fingertip.density.layers[2:]) < LAYERS
    if ratio <= (LOCKED_WHERE_COARSE if coarse else LOCKED):
        return ""
    return (f"full integration locks at Poisson's ratio {ratio:g}" + (" on so coarse a mesh" if coarse else "")
            + ": formulation b-bar does not")
