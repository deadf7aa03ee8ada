"""What table 1 leaves open about the surfaces: assumptions, each with its reason.

The published text gives dimensions, not surfaces ("quarter ellipsoids, slightly deflated inward and inflated
outward").  The calibrated numbers below were fitted to the published volume and natural frequencies by
`experiments/surface_calibration.py`: agreement with those figures is no prediction.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from rom import checks
from rom.errors import AnatomyError


def real_number(name: str, value: Any, *limits: float, **more: Any) -> float:
    """:func:`rom.checks.real_number`, whose refusals are AnatomyErrors."""
    try:
        return checks.real_number(name, value, *limits, **more)
    except ValueError as error:
        raise AnatomyError(str(error)) from None


@dataclass(frozen=True)
class SurfaceShape:
    """Assumptions about exterior, bone and pad.

    Parameters
    ----------
    lower_exponent : float [-]
        Exponent of the lower front surface, palmar fullness.  Calibrated.
        (The upper exponent is no assumption: it follows from the nail's height.)
    equator_exponent : float [-]
        Exponent of the widest section, seen from above; 2 is an ellipse.  Calibrated.
    dorsal_fraction : float [-]
        Share of the height above the widest section.  Calibrated.
    bone_axis_rise : float [mm]
        How much higher the bone's axis lies at its tip than at the joint.  Calibrated.
    bone_base_length : float [mm]
        Length of the bone's constant proximal section.  Calibrated.
    bone_section_exponent : float [-]
        Exponent of the bone's cross-section; 2 is an ellipse, more is squarer.  Calibrated.
    tuft_fraction : float [-]
        Where the tuft is widest, from neck (0) to bone tip (1).  Calibrated.
    bone_end_exponent : float [-]
        Exponent of the bone's profile beyond the tuft; 2 is an ellipse, less is more pointed.  Calibrated,
        on its least permitted value in the fit.
    nail_bed_thickness : float [mm]
        Depth of the nail bed below the nail plate.  Calibrated; the skin beside it is 1.6 deep.
    pad_centre : float [-]
        Pad centre's x over the fingertip's length.  Assumed: half way, the "center of the finger pad".
    pad_start : float [-]
        The loadable pad is the skin distal of this share of the fingertip's length, away from the rear
        edge, and
    pad_depth : float [-]
        below the widest section by this share of the palmar height, away from the nail.
        Both chosen: the `metamodel` preset then holds the published 239 nodes.
    least_hypodermis : float [-]
        Least share of hypodermis in the tissue over the bone; where the skin's layers would leave less,
        they are squeezed alike.  Assumed: acts beside the bone's base only, where table 1 leaves 0.1 mm.

    Raises
    ------
    AnatomyError
        For a value outside its bounds.
    """

    lower_exponent: float = 3.1827
    equator_exponent: float = 2.205
    dorsal_fraction: float = 0.444
    bone_axis_rise: float = 0.55
    bone_base_length: float = 1.56
    bone_section_exponent: float = 2.69
    tuft_fraction: float = 0.68
    bone_end_exponent: float = 1.6
    nail_bed_thickness: float = 2.0
    pad_centre: float = 0.5
    pad_start: float = 0.23
    pad_depth: float = 0.365
    least_hypodermis: float = 0.07

    def __post_init__(self) -> None:
        bounds = {
            "lower_exponent": (1.05, 12.0),
            "equator_exponent": (1.05, 12.0),
            "dorsal_fraction": (0.2, 0.8),
            "bone_axis_rise": (-10.0, 10.0),
            "bone_base_length": (0.0, 100.0),
            "bone_section_exponent": (1.05, 12.0),
            "tuft_fraction": (0.05, 0.95),
            "bone_end_exponent": (1.05, 12.0),
            "nail_bed_thickness": (0.01, 20.0),
            "pad_centre": (0.05, 0.95),
            "pad_start": (0.0, 0.95),
            "pad_depth": (0.0, 0.95),
            "least_hypodermis": (0.01, 0.5),
        }
        for item in fields(self):
            value = real_number(f"SurfaceShape {item.name}", getattr(self, item.name), *bounds[item.name])
            object.__setattr__(self, item.name, value)
