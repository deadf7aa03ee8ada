"""The fingertip's dimensions and tissues: tables 1 and 2 of the DigiTip model.

Source: Serhat and Kuchenbecker, "Free and Forced Vibration Modes of the Human Fingertip", Appl.  Sci.
2021, 11, 5709.  Lengths are in mm, moduli in MPa and densities in g/cm3, the tables' own units;
`rom.fingertip.mesh` and `rom.fingertip.elasticity` convert them to SI once.

Every object here is immutable; `Anatomy.replace` and `Anatomy.replace_tissue` make changed copies.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Self

from rom.checks import shown
from rom.errors import AnatomyError
from rom.fingertip.shape import SurfaceShape, real_number

TISSUES = ("stratum_corneum", "epidermis", "dermis", "hypodermis", "nail_bed", "nail_plate")
"""Tissue names in the order of their integer ids in a mesh."""

SMALLEST, LARGEST = 1e-15, 1e15
"""Range of every positive number of an anatomy, in the tables' own units: double precision holds no others together."""


@dataclass(frozen=True)
class Tissue:
    """A linear elastic, isotropic tissue.

    Parameters
    ----------
    elastic_modulus : float [MPa]
        Greater than zero; moduli and densities within :data:`SMALLEST` and :data:`LARGEST`.
    poisson_ratio : float [-]
        Between -1 and 0.5, both excluded.
    density : float [g/cm3]
        Greater than zero.

    Raises
    ------
    AnatomyError
        For a value outside these bounds.
    """

    elastic_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        for name, unit in (("elastic_modulus", "MPa"), ("density", "g/cm3")):
            value = real_number(f"Tissue {name}", getattr(self, name), SMALLEST, LARGEST, unit=unit)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "poisson_ratio", real_number("Tissue poisson_ratio", self.poisson_ratio))
        if not -1 < self.poisson_ratio < 0.5:
            raise AnatomyError(
                f"Tissue poisson_ratio is {self.poisson_ratio:g}, but it must satisfy -1 < nu < 0.5: "
                "use for example 0.4999 for a nearly incompressible tissue."
            )

    @property
    def shear_modulus(self) -> float:
        """float [MPa] : mu = E / (2 (1 + nu))."""
        return self.elastic_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def bulk_modulus(self) -> float:
        """float [MPa] : kappa = E / (3 (1 - 2 nu))."""
        return self.elastic_modulus / (3 * (1 - 2 * self.poisson_ratio))


@dataclass(frozen=True)
class Anatomy:
    """All dimensions of table 1, the six tissues of table 2, and the assumed surface shape.

    Parameters
    ----------
    fingertip_length : float [mm]
        l_f, from the joint to the tip.
    fingertip_width : float [mm]
        w_f.
    fingertip_height : float [mm]
        h_f.
    nail_length : float [mm]
        l_n, apparent part and root.  The front surface begins at the nail root, x = l_f - l_n.
    nail_width : float [mm]
        w_n.
    nail_height : float [mm]
        h_n, the sagitta of the nail over its width; it sets the upper exponent of the front surface.
    nail_plate_thickness : float [mm]
        t_n.
    stratum_corneum_thickness, epidermis_thickness, dermis_thickness : float [mm]
        t_sc, t_ep, t_de.
    joint_tissue_thickness : float [mm]
        t_stj, soft tissue at the interphalangeal joint, taken on the dorsal side.
    bone_length : float [mm]
        l_b.
    bone_distal_length : float [mm]
        l_bd, the section distal of the neck.
    bone_distal_width, bone_distal_height : float [mm]
        w_bd, h_bd, at the tuft.
    bone_proximal_width, bone_proximal_height : float [mm]
        w_bp, h_bp, at the joint.
    bone_neck_width, bone_neck_height : float [mm]
        w_bn, h_bn.
    stratum_corneum, epidermis, dermis, hypodermis, nail_bed, nail_plate : Tissue
        Table 2.
    shape : SurfaceShape
        What table 1 leaves open, declared as assumptions.

    Raises
    ------
    AnatomyError
        For a dimension that is not a positive number, or dimensions that cannot go together.
    """

    fingertip_length: float = 28.0
    fingertip_width: float = 18.0
    fingertip_height: float = 15.0
    nail_length: float = 17.6
    nail_width: float = 12.3
    nail_height: float = 2.5
    nail_plate_thickness: float = 0.4
    stratum_corneum_thickness: float = 0.4
    epidermis_thickness: float = 0.1
    dermis_thickness: float = 1.5
    joint_tissue_thickness: float = 2.9
    bone_length: float = 22.5
    bone_distal_length: float = 8.4
    bone_distal_width: float = 8.6
    bone_distal_height: float = 4.2
    bone_proximal_width: float = 13.0
    bone_proximal_height: float = 8.0
    bone_neck_width: float = 5.3
    bone_neck_height: float = 3.8
    stratum_corneum: Tissue = Tissue(1.0, 0.30, 1.100)
    epidermis: Tissue = Tissue(0.140, 0.30, 1.106)
    dermis: Tissue = Tissue(0.080, 0.48, 1.274)
    hypodermis: Tissue = Tissue(0.034, 0.48, 0.920)
    nail_bed: Tissue = Tissue(1.0, 0.30, 1.100)
    nail_plate: Tissue = Tissue(170.0, 0.30, 1.300)
    shape: SurfaceShape = field(default_factory=SurfaceShape)

    def __post_init__(self) -> None:
        for name in DIMENSIONS:
            value = real_number(f"Anatomy {name}", getattr(self, name), SMALLEST, LARGEST, unit="mm")
            object.__setattr__(self, name, value)
        for name in TISSUES:
            if not isinstance(getattr(self, name), Tissue):
                raise AnatomyError(
                    f"Anatomy {name} is {shown(getattr(self, name))}, but it must be a Tissue: "
                    "build Tissue(elastic_modulus, poisson_ratio, density)."
                )
        if not isinstance(self.shape, SurfaceShape):
            raise AnatomyError(f"Anatomy shape is {shown(self.shape)}, but it must be a SurfaceShape: build one.")
        self._check_room()

    def _check_room(self) -> None:
        """Refuse what one comparison of two lengths can tell; `build_mesh` finds the rest on the surfaces."""
        rules = (
            ("nail_length", self.nail_length, "fingertip_length", self.fingertip_length),
            ("nail_width", self.nail_width, "fingertip_width", self.fingertip_width),
            ("nail_height", self.nail_height, "dorsal half height", self.dorsal_height),
            ("bone_distal_length", self.bone_distal_length, "bone_length", self.bone_length),
            ("shape.bone_base_length", self.shape.bone_base_length, "neck position", self.neck_position),
            ("nail root position", self.nail_root, "tuft position", self.tuft_position),
            ("bone_length", self.bone_length, "fingertip_length", self.fingertip_length),
            ("bone_proximal_width", self.bone_proximal_width, "fingertip_width", self.fingertip_width),
            ("bone_distal_width", self.bone_distal_width, "fingertip_width", self.fingertip_width),
            (
                "joint_tissue_thickness + bone_proximal_height",
                self.joint_tissue_thickness + self.bone_proximal_height,
                "fingertip_height",
                self.fingertip_height,
            ),
        )
        for small_name, small, large_name, large in rules:
            if small >= large:
                raise AnatomyError(
                    f"Anatomy cannot exist: {small_name} is {small:g} mm and must be less than {large_name}, "
                    f"{large:g} mm: reduce the first or enlarge the second."
                )

    @property
    def nail_root(self) -> float:
        """float [mm] : x = l_f - l_n, where the rear extrusion ends and the front surface begins."""
        return self.fingertip_length - self.nail_length

    @property
    def dorsal_height(self) -> float:
        """float [mm] : half height of the upper front surface, above the widest section."""
        return self.shape.dorsal_fraction * self.fingertip_height

    @property
    def palmar_height(self) -> float:
        """float [mm] : half height of the lower front surface."""
        return self.fingertip_height - self.dorsal_height

    @property
    def neck_position(self) -> float:
        """float [mm] : x of the bone's neck, l_b - l_bd."""
        return self.bone_length - self.bone_distal_length

    @property
    def tuft_position(self) -> float:
        """float [mm] : x of the tuft's widest section."""
        return self.neck_position + self.shape.tuft_fraction * self.bone_distal_length

    @property
    def bone_axis_height(self) -> float:
        """float [mm] : z of the bone's axis at the joint, from t_stj on the dorsal side."""
        return self.dorsal_height - self.joint_tissue_thickness - self.bone_proximal_height / 2

    @property
    def upper_exponent(self) -> float:
        """float [-] : exponent n of the upper front surface, from the nail's height over its width.

        Solves h_n = c (1 - (1 - (w_n/w_f)^n)^(1/n)), the sagitta at half the nail's width; c is the dorsal
        height.

        Raises
        ------
        AnatomyError
            When no exponent between 1.05 and 12 gives the nail's height.
        """
        from scipy.optimize import brentq

        ratio = self.nail_width / self.fingertip_width

        def excess(n: float) -> float:
            return self.dorsal_height * (1 - (1 - ratio**n) ** (1 / n)) - self.nail_height

        low, high = 1.05, 12.0
        if not excess(high) <= 0 <= excess(low):
            lowest, highest = (excess(n) + self.nail_height for n in (high, low))
            raise AnatomyError(
                f"Anatomy nail_height is {self.nail_height:g} mm, but a nail {self.nail_width:g} mm wide can only be "
                f"{lowest:.3g} to {highest:.3g} mm high: change the nail's height or width."
            )
        return float(brentq(excess, low, high, xtol=1e-13))

    def tissue(self, name: str) -> Tissue:
        """Return the tissue of this name.

        Raises
        ------
        AnatomyError
            For a name outside `TISSUES`.
        """
        if not isinstance(name, str) or name not in TISSUES:
            raise AnatomyError(f"There is no tissue {shown(name)}: choose one of {', '.join(TISSUES)}.")
        return getattr(self, name)

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed, e.g. ``anatomy.replace(dermis_thickness=2.0)``."""
        _refuse_unknown("Anatomy", changes, {item.name for item in fields(self)})
        return dataclasses.replace(self, **changes)

    def replace_tissue(self, name: str, **changes: float) -> Self:
        """Return a copy with one tissue changed, e.g. ``replace_tissue("dermis", poisson_ratio=0.495)``."""
        tissue = self.tissue(name)
        _refuse_unknown("Tissue", changes, {item.name for item in fields(Tissue)})
        changed: dict[str, Any] = {name: dataclasses.replace(tissue, **changes)}
        return dataclasses.replace(self, **changed)

    def replace_shape(self, **changes: float) -> Self:
        """Return a copy with the surface shape changed, e.g. ``replace_shape(bone_axis_rise=0.8)``."""
        _refuse_unknown("SurfaceShape", changes, {item.name for item in fields(SurfaceShape)})
        return dataclasses.replace(self, shape=dataclasses.replace(self.shape, **changes))

    def to_dict(self) -> dict[str, Any]:
        """Return nested dicts of plain floats, fit for JSON and for a content hash."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Rebuild an anatomy from `to_dict`; every key must be there, and no other.

        Raises
        ------
        AnatomyError
            For unknown or missing keys, and for whatever the constructor refuses.
        """
        _match_keys(cls, values)
        parts: dict[str, Any] = dict(values)
        for name, kind in (*((name, Tissue) for name in TISSUES), ("shape", SurfaceShape)):
            _match_keys(kind, values[name])
            parts[name] = kind(**values[name])
        return cls(**parts)


DIMENSIONS = tuple(item.name for item in fields(Anatomy) if item.name not in (*TISSUES, "shape"))
"""Names of the dimensions of table 1 [mm]."""


def _refuse_unknown(owner: str, names: Mapping[str, Any], known: set[str]) -> None:
    unknown = [name for name in names if name not in known]
    if unknown:
        raise AnatomyError(
            f"{owner} has no field {', '.join(shown(name) for name in unknown)}: "
            f"choose among {', '.join(sorted(known))}."
        )


def _match_keys(kind: type, values: Any) -> None:
    if not isinstance(values, Mapping):
        raise AnatomyError(
            f"{kind.__name__} is read from {shown(values)}, but it needs a mapping: use to_dict's form."
        )
    known = {item.name for item in fields(kind)}
    _refuse_unknown(kind.__name__, values, known)
    missing = sorted(known - set(values))
    if missing:
        raise AnatomyError(f"{kind.__name__} lacks the field {', '.join(missing)}: write files with to_dict.")
