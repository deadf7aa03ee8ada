"""Does the element lock as the soft tissues become incompressible? First frequency over Poisson's ratio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import script
import xarray as xr

from rom.fullorder import SecondOrderModel
from rom.reporting.figure import Figure, sheet

RATIOS = (0.48, 0.495, 0.499, 0.4999)
FORMULATIONS = ("full", "b-bar")


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """First natural frequency over Poisson's ratio of dermis and hypodermis, both formulations."""
    tip = script.fingertip(quick)
    frequency = np.empty((len(FORMULATIONS), len(RATIOS)))
    for j, ratio in enumerate(progress(list(RATIOS), "Poisson's ratios")):
        anatomy = tip.anatomy
        for tissue in ("dermis", "hypodermis"):
            anatomy = anatomy.replace_tissue(tissue, poisson_ratio=ratio)
        for i, formulation in enumerate(FORMULATIONS):
            one = replace(tip, anatomy=anatomy, formulation=formulation)
            frequency[i, j] = SecondOrderModel(one.stiffness, one.mass).natural_modes(count=1).frequency_hz[0]
    return xr.Dataset({"first_frequency": (("formulation", "poisson_ratio"), frequency, {
        "long_name": "first natural frequency", "units": "Hz"})},
        coords={"formulation": list(FORMULATIONS), "poisson_ratio": list(RATIOS)})


def findings(results: xr.Dataset) -> list[str]:
    """How far the first frequency moves."""
    frequency = results["first_frequency"]
    rise = frequency.isel(poisson_ratio=-1) / frequency.isel(poisson_ratio=0) - 1
    full, b_bar = (float(rise.sel(formulation=name)) for name in FORMULATIONS)
    return [f"Towards incompressibility f1 moves by {full:.1%} with full integration, {b_bar:.1%} with B-bar."]



def draw(results: xr.Dataset) -> list[Figure]:
    """Both formulations over the distance from incompressibility."""
    figure = sheet(4.2, findings(results)[0], width=7.5)
    axes = figure.subplots()
    distance = 0.5 - results["poisson_ratio"]
    for name, colour, marker in zip(results["formulation"].values, ("#d55e00", "#0072b2"), "so", strict=True):
        frequency = results["first_frequency"].sel(formulation=name)
        axes.semilogx(distance, frequency, marker + "-", color=colour, label=name)
    axes.invert_xaxis()
    axes.set_xlabel("0.5 - Poisson's ratio of dermis and hypodermis [-]")
    axes.set_ylabel("first natural frequency [Hz]")
    axes.legend()
    return [Figure("figure.png", figure, "First natural frequency as dermis and hypodermis become incompressible.",
                   "First frequency over the distance from incompressibility")]


if __name__ == "__main__":
    script.run(main, draw, findings, "locking")
