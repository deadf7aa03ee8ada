"""Does the certificate hold, and how tight is it? Bound against true energy error over random cases.

Random loads, frequencies and loss factors, some beyond the scene's ranges; the truth is a direct solve of each.
"""

from __future__ import annotations

import numpy as np
import script
import xarray as xr

from rom.comparison.errors import energy_errors
from rom.datasets import draw_cases, solve_cases
from rom.metamodels import create
from rom.reporting.plate import Plate, sheet
from rom.scenes import get_scene

MODELS = {"modal-static, 40 modes": ("modal-static", {"modes": 40}),
          "modal-krylov, 20 modes, 3 vectors": ("modal-krylov", {"modes": 20, "vectors": 3}),
          "modal-krylov, 40 modes, 4 vectors": ("modal-krylov", {"modes": 40, "vectors": 4})}


def main(quick: bool = False, progress: script.Progress = script.silent, seed: int = 0) -> xr.Dataset:
    """Bound and true energy error of each random case and model."""
    scene = get_scene("harmonic-point-force", script.fingertip(quick))
    arrays, _ = draw_cases(scene, 48 if quick else 240, 16 if quick else 80, seed)
    truth, _ = solve_cases(scene, arrays)
    stiffness = scene.full_order.stiffness
    bound, error = np.empty((2, len(MODELS), len(arrays)))
    for i, (method, settings) in enumerate(progress(list(MODELS.values()), "models")):
        model = create(method, scene, **settings).fit()
        bound[i] = model.error_bound(arrays)
        error[i] = energy_errors(model.evaluate(arrays), truth, stiffness)
    size = energy_errors(truth, 0 * truth, stiffness)
    unit = {"units": "1"}
    return xr.Dataset({
        "bound": (("model", "case"), bound / size, {"long_name": "relative bound of the energy error", **unit}),
        "error": (("model", "case"), error / size, {"long_name": "true relative energy error", **unit})},
        coords={"model": list(MODELS), "frequency": ("case", arrays.frequency, {"units": "Hz"}),
                "loss_factor": ("case", arrays.loss_factor, unit)})


def findings(results: xr.Dataset) -> list[str]:
    """Whether the bound held everywhere."""
    worst = float((results["bound"] / results["error"]).min())
    return [f"{'No error exceeds' if worst >= 1 else 'An error exceeds'} its bound: smallest ratio {worst:.3f}."]



def draw(results: xr.Dataset) -> list[Plate]:
    """Bound over error: every point on or above the diagonal."""
    figure = sheet(5.2, findings(results)[0], width=7.5)
    axes = figure.subplots()
    for name, colour, marker in zip(results["model"].values, ("#0072b2", "#d55e00", "#009e73"), "os^", strict=True):
        one = results.sel(model=name)
        ratio = float((one["bound"] / one["error"]).median())
        axes.loglog(one["error"], one["bound"], marker, ms=4, alpha=0.6, color=colour,
                    label=f"{name}: median ratio {ratio:.2f}")
    ends = [float(results["error"].min()), float(results["error"].max())]
    axes.loglog(ends, ends, "k-", lw=1, label="bound = error")
    axes.set_xlabel("true relative energy error [-]")
    axes.set_ylabel("certified bound [-]")
    axes.legend()
    return [Plate("figure.png", figure, "Each point is a random case; on the line the bound would equal the error.",
                  "Certified bound over true energy error")]


if __name__ == "__main__":
    script.run(main, draw, findings, "certificate")
