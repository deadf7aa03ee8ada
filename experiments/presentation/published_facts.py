"""What the modal study printed about free vibration, looked up in the results of the modes, with a verdict each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rom.reporting import words
from rom.vibration.mode_shapes import DESCRIPTIONS

VOLUME_TOLERANCE = 1e-3
FREQUENCY_TOLERANCE = {1: 0.02, 2: 0.02, 4: 0.03, 7: 0.02, 8: 0.04}
"""By published mode number; mode 4 is read from a peak "around" its frequency, mode 8 lies outside the study's band."""
DESCRIBED = len(DESCRIPTIONS)


@dataclass(frozen=True)
class Fact:
    """A published statement and what was found.

    Parameters
    ----------
    name : str
    published, found, deviation, tolerance : float
        NaN where the statement is one of words; deviation is found over published, less one.
    met : bool
    units : str
        Of the two values.
    text : str
        What was found, in words.
    """

    name: str
    published: float
    found: float
    deviation: float
    tolerance: float
    met: bool
    units: str
    text: str


def facts(results: xr.Dataset) -> list[Fact]:
    """Every published statement with its verdict.

    Parameters
    ----------
    results : xr.Dataset
        Of the experiment on the modes: `natural_frequency`, `parity`, `description_met` over `rear` and `mode`,
        `published_frequency`, `paired_mode`, `modes_found`; attributes `volume_mm3` and `published_volume_mm3`.
    """
    volume = _number("volume of deformable tissue", results.attrs["published_volume_mm3"], results.attrs["volume_mm3"],
                     VOLUME_TOLERANCE, "mm3")
    frequency, printed = results["natural_frequency"].sel(rear="free"), results["published_frequency"]
    frequencies = [_number(f"frequency of mode {k}", float(printed.sel(mode=k)), float(frequency.sel(mode=k)),
                           tolerance, "Hz") for k, tolerance in FREQUENCY_TOLERANCE.items()]
    kind = results["parity"].sel(rear="free", mode=4).item()
    return [volume, *frequencies, _statement("mode 4 is symmetric", kind == "symmetric", f"mode 4 is {kind}"),
            *(_shape(results, one.mode, one.words) for one in DESCRIPTIONS), *_rear(results)]


def _number(name: str, published: float, found: float, tolerance: float, units: str) -> Fact:
    deviation = found / published - 1
    return Fact(name, published, found, deviation, tolerance, abs(deviation) <= tolerance, units,
                f"{100 * deviation:+.2f} %, allowed {words.significant(100 * tolerance)} %")


def _statement(name: str, met: bool, text: str) -> Fact:
    return Fact(name, np.nan, np.nan, np.nan, np.nan, bool(met), "1", text)


def _shape(results: xr.Dataset, mode: int, description: str) -> Fact:
    who = looks_like(results, mode)
    by = f"met by mode{'s' if len(who) > 1 else ''} {words.listed([str(k) for k in who])}" if who else "met by no mode"
    return _statement(f"mode {mode}: {description}", mode in who, by)


def _rear(results: xr.Dataset) -> list[Fact]:
    rise = rises(results)
    partner = results["paired_mode"].values[:DESCRIBED]
    moved = [f"{k + 1} → {p}" for k, p in enumerate(partner) if p != k + 1]
    return [_statement("a fixed rear raises every frequency", bool((rise > 0).all()),
                       f"by {100 * rise.min():.1f} to {100 * rise.max():.1f} %"),
            _statement("a fixed rear keeps the modes' order", not moved,
                       f"modes move: {', '.join(moved)}" if moved else "every mode keeps its number")]


def looks_like(results: xr.Dataset, description: int) -> list[int]:
    """Rear-free modes that meet a description, among those inside the band and at least the published eight."""
    met = results["description_met"].sel(rear="free", description=description).values
    within = np.arange(len(met)) < max(DESCRIBED + 1, int(results["modes_found"].sel(rear="free")))
    return [int(k) for k in results["mode"].values[(met != 0) & within]]


def rises(results: xr.Dataset) -> np.ndarray:
    """Relative rise of the described modes' frequencies from rear free to rear fixed, by pairs: (7,) ndarray."""
    frequency = results["natural_frequency"]
    partner = results["paired_mode"].values[:DESCRIBED] - 1
    return frequency.sel(rear="fixed").values[partner] / frequency.sel(rear="free").values[:DESCRIBED] - 1


def elsewhere(results: xr.Dataset) -> list[str]:
    """Sentences on descriptions that fit a mode of another number, with what the frequencies say to that."""
    frequency, printed = results["natural_frequency"].sel(rear="free"), results["published_frequency"]
    sentences = []
    for one in DESCRIPTIONS:
        who = looks_like(results, one.mode)
        if who and one.mode not in who:
            f, target = float(frequency.sel(mode=who[0])), float(printed.sel(mode=one.mode))
            line = f"What is published as mode {one.mode} ({one.words}) is mode {who[0]} here, at {f:.1f} Hz"
            sentences.append(line + (f" ({100 * (f / target - 1):+.1f} % from {target:g} Hz)." if target > 0 else "."))
    return sentences


def with_facts(results: xr.Dataset) -> xr.Dataset:
    """Results with every fact along ``fact``: published, found, deviation, tolerance, met."""
    listed, one = facts(results), {"units": "1"}
    names = np.array([fact.name for fact in listed], dtype=object)
    added = {f"fact_{name}": ("fact", np.array([getattr(fact, name) for fact in listed]), {"long_name": text, **one})
             for name, text in (("published", "published value, in fact_units"),
                                     ("found", "computed value, in fact_units"),
                                     ("deviation", "computed over published value, less one"),
                                     ("tolerance", "largest allowed deviation"))}
    added["fact_met"] = ("fact", np.array([int(fact.met) for fact in listed]), {"long_name": "whether it holds", **one})
    units = np.array([fact.units for fact in listed], dtype=object)
    added["fact_units"] = ("fact", units, {"long_name": "units of both values", **one})
    return results.assign(added).assign_coords(fact=("fact", names, {"long_name": "published statement", **one}))
