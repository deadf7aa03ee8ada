"""Fit of the surfaces' assumptions to published facts, on a cheap mesh with exact frequency derivatives.

Modes are told apart by parity and rank within it (A1, A2, ... antisymmetric, S1, S2, ... symmetric), so that two that
cross keep their names. Each fact is a residual over its tolerance: the logarithm of volume or frequency against the
published one; an order of two modes counts only as far as it is missed. A cheap mesh stands for the real one through
factors found at one point, as in space mapping (Bandler et al., IEEE Trans. Microw. Theory Tech. 42, 1994, 2536).
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rom.errors import AnatomyError, SolverError
from rom.fingertip import Anatomy, Fingertip, MeshDensity
from rom.vibration.modal_analysis import analyse_modes
from rom.vibration.parameters import SHAPE
from rom.vibration.parity import ANTISYMMETRIC
from rom.vibration.published import published
from rom.vibration.sensitivity import frequency_sensitivity

log = logging.getLogger(__name__)

Floats = NDArray[np.float64]

ANTISYMMETRIC_MODES, SYMMETRIC_MODES = 5, 4
LABELS = (*(f"A{i + 1}" for i in range(ANTISYMMETRIC_MODES)), *(f"S{i + 1}" for i in range(SYMMETRIC_MODES)))
"""Modes by parity and rank within it."""
REARS = ("free", "fixed")
_MODES = 12  # the lowest; five antisymmetric and four symmetric ones are among them, or the shape is refused
_FAR = 1e3  # residual of a shape that cannot be meshed: the search steps back


class Range(NamedTuple):
    """Where an assumption may lie: plain value to start from, bounds, and how far is a long way."""

    plain: float
    low: float
    high: float
    spread: float


FAMILY: dict[str, Range] = {
    "lower_exponent": Range(3.825, 2.0, 6.0, 3.0),
    "equator_exponent": Range(2.0, 1.8, 2.8, 0.25),
    "dorsal_fraction": Range(0.5, 0.42, 0.6, 0.05),
    "bone_axis_rise": Range(0.0, -1.0, 2.2, 1.5),
    "bone_base_length": Range(5.0, 0.5, 9.0, 3.0),
    "bone_section_exponent": Range(2.0, 1.7, 3.0, 0.5),
    "tuft_fraction": Range(2 / 3, 0.4, 0.92, 0.25),
    "bone_end_exponent": Range(2.0, 1.6, 4.0, 0.7),
    "nail_bed_thickness": Range(1.6, 0.4, 3.5, 0.8),
}
"""The family: fields of `SurfaceShape`.  Plain are ellipses, a level bone, a nail bed as deep as the skin beside it."""

ORDER = (("S1", "A2"), ("S2", "A3"), ("A3", "S3"), ("S3", "A4"))
"""Neighbours in the published order of the first seven modes that the fit must keep apart, lower one first."""
MARGIN = 0.015
"""Least relative distance of such neighbours."""


TOLERANCE = {"volume": 5e-4, "mode_1": 0.004, "mode_2": 0.004, "mode_4_about": 0.01, "mode_7": 0.004, "mode_8": 0.008,
             "order": 0.004, "plain": 1.5}
"""A fifth of the distance that still counts as met, or less; a shape a long way from plain costs as much as a miss."""


@dataclass(frozen=True)
class Facts:
    """Published facts with the relative distance that counts as one unit of residual.

    Parameters
    ----------
    volume : float [mm3]
    frequency : dict of float [Hz]
        By published mode: mode_1, mode_2, mode_4_about, mode_7, mode_8.
    tolerance : dict of float [-]
        Of each fact; "volume", "order" and "plain" (the pull towards plain shapes) among them.
    left_out : tuple of str
        Facts that the fit does not see; "order_fixed" is the order with the rear fixed.
    """

    volume: float
    frequency: Mapping[str, float]
    tolerance: Mapping[str, float] = field(default_factory=TOLERANCE.copy)
    left_out: tuple[str, ...] = ()

    @classmethod
    def published(cls) -> Facts:
        """As the modal study prints them."""
        values = published()["digitip"]
        return cls(values["volume_mm3"], dict(values["natural_frequency_hz"]))

    def without(self, *names: str) -> Facts:
        """The same, some left out; ValueError for a name that is none."""
        known = {"volume", "order_fixed", *self.frequency}
        unknown = sorted(set(names) - known)
        if unknown:
            raise ValueError(f"{', '.join(unknown)} is no fact: choose among {', '.join(sorted(known))}")
        return replace(self, left_out=(*self.left_out, *names))


MODE_LABELS = {"mode_1": ("A1",), "mode_2": ("S1",), "mode_4_about": ("S2",), "mode_7": ("A4",), "mode_8": ("A5", "S4")}
"""Which mode a published frequency belongs to; of two the lower one."""


@dataclass(frozen=True, eq=False)
class Characteristics:
    """What facts are compared with.

    Parameters
    ----------
    frequency : (2, 9) ndarray [Hz]
        Rear free and fixed, modes in the order of `LABELS`.
    volume : float [mm3]
    slope : (2, 9, p) ndarray
        Derivative of log frequency by each assumption; empty where not asked for.
    volume_slope : (p,) ndarray
    """

    frequency: Floats
    volume: float
    slope: Floats
    volume_slope: Floats


def characteristics(anatomy: Anatomy, density: MeshDensity, names: Iterable[str] = ()) -> Characteristics:
    """Frequencies with both rears, full integration as published, and their derivatives by some assumptions.

    Parameters
    ----------
    anatomy : Anatomy
    density : MeshDensity
    names : iterable of str
        Fields of `SurfaceShape`.

    Raises
    ------
    AnatomyError
        For a shape that cannot be meshed, or whose twelve lowest modes lack one of `LABELS`.
    """
    names = tuple(names)
    frequency, slope = np.empty((2, len(LABELS))), np.empty((2, len(LABELS), len(names)))
    for r, rear in enumerate(REARS):
        tip = Fingertip(anatomy, density, "full", rear)  # type: ignore[arg-type]  # REARS holds nothing else
        found = analyse_modes(tip, _MODES)
        odd = np.flatnonzero(found.parity == ANTISYMMETRIC)[:ANTISYMMETRIC_MODES]
        even = np.flatnonzero(found.parity != ANTISYMMETRIC)[:SYMMETRIC_MODES]
        rows = np.concatenate([odd, even])
        if len(rows) < len(LABELS):
            raise AnatomyError(f"{len(rows)} of the {len(LABELS)} wanted modes are among the lowest {_MODES}: "
                               "choose a shape nearer to the defaults")
        frequency[r] = found.modes.frequency_hz[rows]
        if names:
            change = frequency_sensitivity(tip, found.modes, [f"{SHAPE}.{name}" for name in names])["derivative"].values
            slope[r] = (change[:, rows] / frequency[r]).T
    volume = tip.mesh.volume * 1e9
    return Characteristics(frequency, volume, slope, np.array([_volume_slope(anatomy, density, n) for n in names]))


def _volume_slope(anatomy: Anatomy, density: MeshDensity, name: str) -> float:
    value, step = getattr(anatomy.shape, name), 1e-4
    low, high = (np.log(Fingertip(anatomy.replace_shape(**{name: value + s}), density).mesh.volume)
                 for s in (-step, step))
    return float(high - low) / (2 * step)


@dataclass(frozen=True, eq=False)
class SurfaceFit:
    """A fitted shape.

    Parameters
    ----------
    shape : dict of float
        Fields of `SurfaceShape`.
    cost : float
        Sum of squared residuals.
    evaluations : int
        Shapes whose modes were computed.
    at : Characteristics
        On the cheap mesh, without correction.
    """

    shape: dict[str, float]
    cost: float
    evaluations: int
    at: Characteristics


def fit_surface(
    facts: Facts,
    density: MeshDensity,
    correction: tuple[Floats, float],
    *,
    start: Mapping[str, float] | None = None,
    evaluations: int = 25,
    anatomy: Anatomy | None = None,
) -> SurfaceFit:
    """Least squares over the family, by trust-region steps with exact derivatives.

    Parameters
    ----------
    facts : Facts
    density : MeshDensity
        Of the cheap mesh.
    correction : ((2, 9) ndarray, float)
        Factors from cheap to real frequencies and volume.
    start : mapping of float, optional
        Plain shape by default; its names are the ones that are fitted.
    evaluations : int
        At most so many shapes.
    anatomy : Anatomy, optional
        Whose tables stay as they are.

    Raises
    ------
    AnatomyError
        If the start itself cannot be meshed.
    """
    anatomy = Anatomy() if anatomy is None else anatomy
    start = {name: one.plain for name, one in FAMILY.items()} if start is None else start
    names = tuple(start)
    known: dict[bytes, Characteristics | None] = {}

    def look(x: Floats) -> Characteristics | None:
        if x.tobytes() not in known:
            try:
                shape = dict(zip(names, map(float, x), strict=True))
                known[x.tobytes()] = characteristics(anatomy.replace_shape(**shape), density, names)
            except (AnatomyError, SolverError, ValueError) as error:
                if not known:
                    raise
                log.info("a step that cannot be: %s", error)
                known[x.tobytes()] = None
        return known[x.tobytes()]

    def residual(x: Floats) -> Floats:
        at = look(x)
        return np.full(n_rows, _FAR) if at is None else residuals(at, facts, correction, names, x)[0]

    def slope(x: Floats) -> Floats:
        at = look(x)
        if at is None:  # unreachable: a step is accepted only where its residual is small
            raise AnatomyError("The fit stands on a shape that cannot be meshed: start nearer to the defaults")
        return residuals(at, facts, correction, names, x)[1]

    x0 = np.array([start[name] for name in names], dtype=np.float64)
    first = look(x0)
    n_rows = 0 if first is None else len(residuals(first, facts, correction, names, x0)[0])
    low, high = (np.array([getattr(FAMILY[name], end) for name in names]) for end in ("low", "high"))
    inside = np.clip(x0, low + 1e-6 * (high - low), high - 1e-6 * (high - low))
    found = least_squares(residual, inside, slope, bounds=(low, high), max_nfev=evaluations, ftol=2e-3,
                          x_scale=0.3 * np.array([FAMILY[name].spread for name in names]))
    at = look(found.x)
    if at is None:
        raise AnatomyError("The fit ended on a shape that cannot be meshed: start nearer to the defaults")
    return SurfaceFit(dict(zip(names, map(float, found.x), strict=True)), float(2 * found.cost), len(known), at)


def residuals(
    at: Characteristics, facts: Facts, correction: tuple[Floats, float], names: tuple[str, ...], x: Floats
) -> tuple[Floats, Floats]:
    """Residuals of all facts that are not left out, and their derivatives: (r,) and (r, p) ndarray."""
    frequency, volume = np.log(at.frequency * correction[0]), np.log(at.volume * correction[1])
    row = {label: i for i, label in enumerate(LABELS)}
    values, slopes = [], []

    def add(value: float, slope: Floats, tolerance: float) -> None:
        values.append(value / tolerance)
        slopes.append(slope / tolerance)

    if "volume" not in facts.left_out:
        add(volume - np.log(facts.volume), at.volume_slope, facts.tolerance["volume"])
    for name, labels in MODE_LABELS.items():
        if name in facts.frequency and name not in facts.left_out:
            i = min((row[label] for label in labels), key=lambda i: frequency[0, i])
            add(frequency[0, i] - np.log(facts.frequency[name]), at.slope[0, i], facts.tolerance[name])
    for r, rear in enumerate(REARS):
        if f"order_{rear}" in facts.left_out:
            continue
        for below, above in ORDER:
            i, j = row[below], row[above]
            missing = MARGIN - (frequency[r, j] - frequency[r, i])
            slope = at.slope[r, i] - at.slope[r, j]
            add(max(missing, 0.0), slope if missing > 0 else np.zeros_like(slope), facts.tolerance["order"])
    for k, name in enumerate(names):
        scale = FAMILY[name].spread
        add((x[k] - FAMILY[name].plain) / scale, np.eye(len(names))[k] / scale, facts.tolerance["plain"])
    return np.array(values), np.array(slopes)
