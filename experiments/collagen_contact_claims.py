"""What the publication says about a finger on glass, as measures of followed paths and verdicts on them."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from analysis.contact_outputs import smoothed

from rom.finger_on_glass.observation import along_plate

PROFILE = np.arange(-6.5, 6.5 + 1e-9, 0.1)
"""Positions along the plate at which tractions are given [mm]."""
WINDOW = 1.0
"""Of the moving average over the tractions [mm]; the published one has 20 points of unknown distance."""
FULL_SLIP = 0.99
"""Share of friction times normal force at which the plate is said to slip."""
MEETING, SLIP_TOLERANCE, ROLLING, TRAILING = 0.1, 0.1, 1.5, 0.3
"""Largest spread of approaches; largest deviation from published slip; least ratio of skin motions; least motion
of the peak [mm]."""
HERTZ = 4 / np.pi
"""Largest over mean pressure of a cylinder on a plane."""
LOOKED_AT, END = 4.0, 8.0
"""Travel [mm] at which the peak is judged, where the publication's profiles end; and rolling, where its maps are."""


def published_slip() -> dict[str, float]:
    """Travel of the plate at full slip [mm], by variant."""
    tables = tomllib.loads((Path(__file__).parents[1] / "data" / "published.toml").read_text(encoding="utf-8"))
    return next(table["full_slip_mm_about"] for table in tables.values() if "full_slip_mm_about" in table)


def profiles(path: xr.Dataset, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed pressure and shear [kPa] at the positions `PROFILE`, at position ``k`` of a recorded path."""
    pressure = path["pressure"].values[k]
    order = along_plate(pressure)
    x = 1e3 * (path["node_x"].values + path["displacement"].values[k, :, 0])[path["skin"].values[order]]
    return tuple(1e-3 * smoothed(x, path[name].values[k][order], PROFILE, WINDOW)  # type: ignore[return-value]
                 for name in ("pressure", "shear"))


def peak_position(path: xr.Dataset, k: int) -> tuple[float, float]:
    """Where the smoothed pressure is largest: from the bone's middle [mm], and from the contact's over half its width.

    Positive to the trailing side: the plate moves towards +x, so the finger goes towards -x on it.
    """
    left, right = (1e3 * float(path[f"{side}_edge"][k]) for side in ("left", "right"))
    pressure = profiles(path, k)[0]
    top = float(PROFILE[pressure >= 0.99 * pressure.max()].mean())  # a flat top has no one peak: its middle
    return top, 2 * (top - 0.5 * (left + right)) / (right - left)


def skin_motion(path: xr.Dataset, k: int) -> float:
    """Mean motion of the whole skin around the bone [mm], counter-clockwise, as the plate drags it."""
    skin = path["skin"].values
    nodes = 1e3 * np.column_stack([path["node_x"].values, path["node_y"].values])[skin]
    along = np.roll(nodes, -1, axis=0) - np.roll(nodes, 1, axis=0)
    length = np.linalg.norm(along, axis=1)
    moved = 1e3 * path["displacement"].values[k][skin]
    return float(np.einsum("ni,ni->", moved, along) / length.sum())


@dataclass(frozen=True)
class Measures:
    """Of one path that slides: NaN where it did not get so far."""

    approach: float
    """At the held force, before sliding [mm]."""
    area: float
    """[mm2]"""
    peak: float
    """Largest smoothed pressure before sliding [kPa]."""
    flatness: float
    """Largest smoothed over mean pressure."""
    slip: float
    """Travel at full slip [mm]."""
    shift: float
    """Position of the peak at `LOOKED_AT`, from the bone's middle to the trailing side [mm]."""
    within: float
    """The same from the contact's middle, over half its width."""
    suddenness: float
    """Largest motion of the peak over 1 mm of travel, up to `LOOKED_AT` [mm]."""
    rolling: float
    """Mean motion of the skin around the bone at `END` [mm]."""
    area_left: float
    """Area at `LOOKED_AT` over that before sliding."""
    traction: float
    """Tangential over friction times normal force at `END`."""


def measures(path: xr.Dataset) -> Measures:
    """Everything that the claims ask of one sliding path."""
    travel = 1e3 * path["tangential_displacement"].values
    start = int(np.flatnonzero(travel == 0)[-1])
    force, width = float(path["normal_force"][start]), 1e3 * float(path["width"][start])
    peak = float(profiles(path, start)[0].max())
    length = path.attrs["out_of_plane.effective_length"]
    ratio = (path["tangential_force"] / path["normal_force"]).values[start:]
    reached = [k for k in range(start, len(travel)) if travel[k] <= LOOKED_AT + 1e-6]
    peaks = np.array([peak_position(path, k) for k in reached])
    x = travel[reached]
    sudden = [abs(np.interp(a + 1, x, peaks[:, 0]) - np.interp(a, x, peaks[:, 0])) for a in x if a + 1 <= x[-1] + 1e-6]
    there, end = abs(x[-1] - LOOKED_AT) < 1e-6, abs(travel[-1] - END) < 1e-6
    friction, area = path.attrs["plate.friction"], path["area"].values
    return Measures(
        approach=1e3 * float(path["normal_displacement"][start]), area=1e6 * float(area[start]), peak=peak,
        flatness=1e-3 * peak * width * length / force, slip=crossing(travel[start:], ratio, FULL_SLIP * friction),
        shift=float(peaks[-1, 0]) if there else np.nan, within=float(peaks[-1, 1]) if there else np.nan,
        suddenness=float(max(sudden)) if sudden else np.nan,
        rolling=skin_motion(path, len(travel) - 1) if end else np.nan,
        area_left=float(area[reached[-1]] / area[start]) if there else np.nan,
        traction=float(ratio[-1]) / friction if end else np.nan)


def crossing(x: np.ndarray, y: np.ndarray, level: float) -> float:
    """Where a curve first reaches a level, NaN where it never does."""
    above = np.flatnonzero(y >= level)
    if not len(above):
        return float("nan")
    k = int(above[0])
    return float(x[0] if k == 0 else x[k - 1] + (level - y[k - 1]) / (y[k] - y[k - 1]) * (x[k] - x[k - 1]))


@dataclass(frozen=True)
class Claim:
    """A published statement, whether it holds, and the numbers it was judged by."""

    name: str
    met: bool
    text: str


def judge(found: Mapping[str, Measures]) -> list[Claim]:
    """Every claim, from the measures of the three variants."""
    radial, around, random = (found[name] for name in ("radial", "circumferential", "random"))
    three = (radial, around, random)

    def listed(field: str, digits: int = 2) -> str:
        return " / ".join(f"{getattr(one, field):.{digits}f}" for one in three)

    approaches = np.array([one.approach for one in three])
    spread = float(np.ptp(approaches) / approaches.mean())
    claims = [
        Claim("all variants meet at 0.5 N", spread <= MEETING,
              f"approach {listed('approach', 3)} mm, spread {100 * spread:.1f} % of the mean, allowed "
              f"{100 * MEETING:g} %"),
        Claim("radial has the largest contact area", radial.area > max(around.area, random.area),
              f"{listed('area', 1)} mm2"),
        Claim("radial has the lowest peak pressure", radial.peak < min(around.peak, random.peak),
              f"{listed('peak', 1)} kPa"),
        Claim("radial's profile is flattened, the others' are not",
              radial.flatness < HERTZ < min(around.flatness, random.flatness),
              f"peak over mean pressure {listed('flatness')}; {HERTZ:.2f} after Hertz"),
        Claim("the peak moves to the trailing side", all(one.shift > TRAILING for one in three),
              f"at {LOOKED_AT:g} mm it stands at {listed('shift')} mm from the bone's middle, at least {TRAILING:g}; "
              f"inside the contact at {listed('within')} of half its width"),
        Claim("most suddenly for radial", radial.suddenness > max(around.suddenness, random.suddenness),
              f"within 1 mm of travel the peak moves by {listed('suddenness')} mm at most"),
        Claim("only circumferential rolls", around.rolling > ROLLING * max(radial.rolling, random.rolling),
              f"mean motion of the skin around the bone at {END:g} mm {listed('rolling')} mm, at least {ROLLING:g} "
              "times the others'"),
    ]
    for name, slip in published_slip().items():
        one = found[name].slip
        text = (f"at {one:.2f} mm, {100 * (one / slip - 1):+.0f} %, allowed {100 * SLIP_TOLERANCE:g} %" if one == one
                else f"not within {END:g} mm")
        claims.append(Claim(f"{name} slips at about {slip:g} mm", abs(one / slip - 1) <= SLIP_TOLERANCE, text))
    return [Claim(one.name, bool(one.met), one.text) for one in claims]


def mean_of(several: list[Measures]) -> Measures:
    """Field by field, of several seeds."""
    return Measures(*np.mean([list(vars(one).values()) for one in several], axis=0).tolist())
