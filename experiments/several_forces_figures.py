"""Figures of the experiment with two forces, from its results alone."""

from __future__ import annotations

import numpy as np
import xarray as xr
from analysis.motion import at_largest_motion, ellipse_axes
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from rom.reporting import words
from rom.reporting.figure import Figure, legend_below, sheet, tidy
from rom.reporting.skin import draw_skin

DRAWN_AS = 2.0
"""Length [mm] to which the largest displacement of a row is drawn."""
ROWS = (("displacement", "centroid's largest\ndisplacement over\nthe two alone added [-]"),
        ("power", "power lost over\nthe two alone added [-]"),
        ("travelling", "travelling index\nof the pad [-]"),
        ("roundness", "minor over major axis of\nthe centroid's path [-]"))


def draw(results: xr.Dataset) -> list[Figure]:
    """Displacement, power and travelling over the phase; the skin at four phases."""
    return [_over_phase(results), _powers(results), _skins(results)]


def _over_phase(results: xr.Dataset) -> Figure:
    displacement = results["peak_displacement"] / results["alone_displacement"].sum("force")
    power = results["dissipated_power"] / results["alone_power"].sum("force")
    values = {"displacement": displacement, "power": power, "travelling": results["travelling_index"],
              "roundness": results["minor_axis"] / results["peak_displacement"]}
    figure = sheet(9.2, f"The phase takes the power lost from {float(power.min()):.2f} to {float(power.max()):.2f} "
                   f"times, the centroid's displacement from {float(displacement.min()):.2f} to "
                   f"{float(displacement.max()):.2f} times what the two forces alone add up to")
    axes = figure.subplots(len(ROWS), results.sizes["layout"], sharex=True, sharey="row")
    colours = colormaps["plasma"](np.linspace(0.0, 0.85, results.sizes["frequency"]))
    for (i, j), panel in np.ndenumerate(axes):
        tidy(panel)
        if i < 2:
            panel.axhline(1.0, color="#999999", linewidth=0.8)
        for k, f in enumerate(results["frequency"].values):
            panel.plot(results["phase"], values[ROWS[i][0]].isel(layout=j, frequency=k), color=colours[k],
                       label=f"{f:g} Hz")
        panel.set_xticks(range(0, 361, 90))
        panel.set_ylim(0, 1.05 * float(values[ROWS[i][0]].max()))
        if i == 0:
            panel.set_title(str(results["layout"].values[j]), fontsize=10)
        if i == len(ROWS) - 1:
            panel.set_xlabel("phase of the second force [degree]")
        if j == 0:
            panel.set_ylabel(ROWS[i][1])
    legend_below(figure, list(axes.flat))
    return Figure("phase.png", figure, "Two equal forces. Above: the largest displacement of the fingerprint centroid "
                  "within a cycle; 1 is full constructive, 0 full destructive interference. Middle: power lost to "
                  "damping; above 1 the forces help, below they hinder each other. Below: 0 is a standing, 1 a "
                  "travelling motion; the centroid's path is a line at 0, a circle at 1.",
                  "Displacement, power and travelling index over the phase difference")


def _powers(results: xr.Dataset) -> Figure:
    share = results["input_power"] / results["alone_power"]
    taken = int((share.min("force") < 0).isel(phase=slice(None, -1)).sum())
    total = share.isel(phase=slice(None, -1), force=0).size
    figure = sheet(4.6, f"In {taken} of {total} cases one actuator is driven by the other: its own power is negative"
                   if taken else "Both actuators put power in at every phase")
    axes = figure.subplots(1, results.sizes["layout"], sharey=True)
    colours = colormaps["plasma"](np.linspace(0.0, 0.85, results.sizes["frequency"]))
    for j, panel in enumerate(axes):
        tidy(panel)
        panel.axhline(0.0, color="#999999", linewidth=0.8)
        for k, f in enumerate(results["frequency"].values):
            for force, line, text in ((0, "-", "first force"), (1, (0, (4, 2)), "second force")):
                panel.plot(results["phase"], share.isel(layout=j, frequency=k, force=force), color=colours[k],
                           linestyle=line, label=f"{f:g} Hz, {text}")
        panel.set_xticks(range(0, 361, 90))
        panel.set_xlabel("phase of the second force [degree]")
        panel.set_title(str(results["layout"].values[j]), fontsize=10)
    axes[0].set_ylabel("power put in over the same force's alone [-]")
    legend_below(figure, list(axes))
    return Figure("power.png", figure, "Mean power that each force puts in, over what it puts in alone at the same "
                  "frequency.", "Power of each force over the phase difference")


def _skins(results: xr.Dataset) -> Figure:
    rest = 1e3 * np.stack([results[f"skin_{axis}"].values for axis in "xyz"], axis=1)
    quads, loads = results["skin_quads"].values, results["load_node"].values
    span = results["pad_displacement"].max("phase") / results["pad_displacement"].min("phase")
    phases = results["checked_phase"].values
    chosen = span.argmax("frequency").values
    figure = sheet(6.6, "By phase alone the pad moves up to " + words.listed([
        f"{float(one.max()):.1f} times ({one['layout'].item()})" for one in span]) + " as far")
    grid = figure.subplots(len(chosen), len(phases), subplot_kw={"projection": "3d"})
    norm = Normalize(0.0, 1.0)
    for i, k in enumerate(chosen):
        field = 1e6 * results["skin_displacement"].isel(layout=i, frequency=int(k)).values
        size = ellipse_axes(field)[0]
        most = size.max()
        moved = at_largest_motion(field) * DRAWN_AS / most
        for j, panel in enumerate(grid[i]):
            colours = colormaps["viridis"](norm(size[j][quads].mean(axis=1) / most))
            draw_skin(panel, rest + moved[j], quads, colours, marks=loads[i])
            panel.set_box_aspect(np.ptp(rest, axis=0), zoom=1.3)
            panel.text2D(0.5, 0.0, f"{phases[j]:g}°: largest {size[j].max():.0f} µm", transform=panel.transAxes,
                         ha="center", fontsize=8.5)
            if j == 0:
                panel.text2D(0.0, 1.0, f"{results['layout'].values[i]}, {results['frequency'].values[k]:g} Hz",
                             transform=panel.transAxes, va="top", fontsize=9.5, fontweight="bold")
    bar = figure.colorbar(ScalarMappable(norm, "viridis"), ax=grid, location="bottom", shrink=0.5, aspect=45, pad=0.03)
    bar.set_label("largest displacement within a cycle, over the row's largest [-]", fontsize=9)
    return Figure("skin.png", figure, "The skin at four phase differences, each layout at the frequency where the "
                  "phase changes the pad's mean motion most; drawn at the instant of largest motion, exaggerated, one "
                  "scale a row. Black dots: centres of the loaded patches.",
                  "Skin coloured by displacement over layout and phase difference")
