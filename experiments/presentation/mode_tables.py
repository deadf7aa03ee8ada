"""Tables of the page on natural modes: facts, frequencies and pairs, shape measures, criteria."""

from __future__ import annotations

import numpy as np
import xarray as xr

from presentation.published_facts import facts
from rom.reporting import html, words
from rom.vibration.mode_shapes import DESCRIPTIONS, MEASURES


def fact_table(results: xr.Dataset) -> str:
    """Published value, found value, verdict."""
    rows = []
    for one in facts(results):
        numbers = [words.significant(value, 5) if np.isfinite(value) else words.NONE
                   for value in (one.published, one.found)]
        units = "" if one.units == "1" else f" [{one.units.replace('mm3', 'mm³')}]"
        rows.append(("", [html.named(one.name + units), *map(html.cell, numbers), html.cell(one.text),
                          html.cell("met" if one.met else "missed")]))
    return html.table("Published facts and what was found.",
                      ["fact", "published", "found", "in words", "verdict"], rows)


def mode_table(results: xr.Dataset) -> str:
    """Every mode with parity, likeness, the other formulation and the rear-fixed partner."""
    free, fixed = (results["natural_frequency"].sel(rear=rear).values for rear in ("free", "fixed"))
    other = results["other_formulation_frequency"].sel(rear="free").values
    partner, mac = results["paired_mode"].values, results["pair_mac"].values
    rows = []
    for k, mode in enumerate(results["mode"].values):
        printed = float(results["published_frequency"].values[k])
        rows.append(("", [html.named(str(mode)), html.cell(f"{free[k]:.1f}"),
                          html.cell(f"{printed:g}" if np.isfinite(printed) else words.NONE),
                          html.cell(results["parity"].sel(rear="free").values[k]),
                          html.cell(likeness(results, k) or words.NONE), html.cell(f"{other[k]:.1f}"),
                          html.cell(str(partner[k])), html.cell(f"{fixed[partner[k] - 1]:.1f}"),
                          html.cell(f"{mac[k]:.3f}")]))
    return html.table("Natural modes. The last ones may lack a true partner, as their MAC tells.",
                      ["mode", "rear free [Hz]", "published [Hz]", "parity", "looks as published mode",
                       f"{results.attrs['other_formulation']} [Hz]", "rear-fixed partner", "rear fixed [Hz]", "MAC"],
                      rows)


def likeness(results: xr.Dataset, k: int, rear: str = "free") -> str:
    """Published modes whose description the mode at position ``k`` meets."""
    met = results["description_met"].sel(rear=rear).values[k]
    return words.listed([str(d) for d, yes in zip(results["description"].values, met, strict=True) if yes])


def measure_table(results: xr.Dataset, shown: int) -> str:
    """Measures of the first modes, rear free."""
    values = results["shape_measure"].sel(rear="free").values[:shown]
    rows = [("", [html.named(name, MEASURES[name]), *(html.cell(f"{value:.2f}") for value in values[:, i])])
            for i, name in enumerate(results["measure"].values)]
    return html.table("Measures of the shapes, rear free: shares from 0 to 1, oppositions from -1 (in phase) to 1.",
                      ["measure", *(f"mode {k + 1}" for k in range(shown))], rows)


def criteria_table() -> str:
    """Rule of each description."""
    rows = [("", [html.named(str(one.mode)), html.cell(one.words), html.cell(one.parity), html.cell(one.rule)])
            for one in DESCRIPTIONS]
    return html.table("Criteria: a mode of the right parity meets a description where the rule is true.",
                      ["published mode", "described as", "parity", "rule"], rows)
