"""How many modes and load-dependent vectors does a vibrating point load need?

Direct solves at loss factors and frequencies spread over the scene's ranges are the truth; the largest relative error
of the field is tabulated over the number of modes and of load-dependent vectors.
"""

from __future__ import annotations

import numpy as np
import script
import xarray as xr
from matplotlib.colors import LogNorm

from rom.metamodels import create
from rom.relative import relative_errors
from rom.reporting.figure import Figure, sheet
from rom.scenes import CaseArrays, get_scene


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """Largest relative error over modes and load-dependent vectors."""
    scene = get_scene("harmonic-point-force", script.fingertip(quick))
    modes = [10, 20, 40] if quick else [11, 20, 40, 60]
    vectors = [1, 2, 4] if quick else [1, 2, 4, 6]
    points = np.array([(f, eta) for f in ((30.0, 300.0) if quick else (30.0, 118.0, 163.0, 215.0, 260.0, 300.0))
                       for eta in ((0.1,) if quick else (0.1, 0.5))])
    loads = np.linspace(0, scene.n_loads - 1, 4 if quick else 8).astype(int)
    node = np.tile(loads, len(points))[:, None]
    frequency, loss_factor = np.repeat(points, len(loads), axis=0).T
    cases = CaseArrays(node, np.ones(node.shape), frequency.copy(), loss_factor.copy())
    truth = scene.solve(cases)[0]["displacement"]
    error = np.empty((len(modes), len(vectors) + 1))
    for i, m in enumerate(progress(modes, "modes")):
        error[i, 0] = relative_errors(create("modal", scene, modes=m).fit().evaluate(cases), truth).max()
        for j, p in enumerate(vectors):
            model = create("modal-krylov", scene, modes=m, vectors=p).fit()
            error[i, j + 1] = relative_errors(model.evaluate(cases), truth).max()
    return xr.Dataset({"error_max": (("modes", "vectors"), error, {
        "long_name": "largest relative error over loads, frequencies and loss factors", "units": "1"})},
        coords={"modes": modes, "vectors": [0, *vectors]})


def findings(results: xr.Dataset) -> list[str]:
    """What modes alone leave, and what load-dependent vectors do about it."""
    error = results["error_max"].values
    modes, vectors = results["modes"].values, results["vectors"].values
    return [f"{modes[-1]} modes alone leave {error[-1, 0]:.0%}; {modes[1]} modes with {vectors[-1]} vectors of "
            f"each load leave {error[1, -1]:.0e}."]



def draw(results: xr.Dataset) -> list[Figure]:
    """Heat map of the error, the numbers written in."""
    figure = sheet(4.4, findings(results)[0], width=7.5)
    axes = figure.subplots()
    error = results["error_max"].values
    image = axes.imshow(error, norm=LogNorm(max(error.min(), 1e-12), 1.0), cmap="cividis", aspect="auto")
    for (i, j), value in np.ndenumerate(error):
        axes.text(j, i, f"{value:.0e}", ha="center", va="center", color="white" if value < 1e-3 else "black")
    axes.set_xticks(range(error.shape[1]), results["vectors"].values)
    axes.set_yticks(range(error.shape[0]), results["modes"].values)
    axes.set_xlabel("load-dependent vectors of each load")
    axes.set_ylabel("modes kept")
    figure.colorbar(image, label="largest relative error [-]")
    return [Figure("figure.png", figure, "Largest relative error of the field over loads, frequencies and loss "
                   "factors.", "Heat map of error over modes and load-dependent vectors")]


if __name__ == "__main__":
    script.run(main, draw, findings, "krylov-convergence")
