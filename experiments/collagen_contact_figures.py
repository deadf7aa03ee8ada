"""Figures of the experiment on a finger on glass, from its results alone."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import TwoSlopeNorm

from rom.reporting import words
from rom.reporting.figure import Figure, legend_below, sheet, tidy

COLOURS = {"radial": "#332288", "circumferential": "#D55E00", "random": "#117733"}
LINES = ("-", (0, (6, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))
"""Of the four travels, as published: full, dashed, dotted, dash-dotted."""
PRESSED = 5
"""Positions of a sliding path before the plate slides."""


def draw(results: xr.Dataset) -> list[Figure]:
    """The publication's figures 3, 4 and 5; strain where receptors lie; what full slip takes."""
    return [_curves(results), _profiles(results), _maps(results, 1), _maps(results, 0), _strain(results),
            _slip(results)]


def _reference(results: xr.Dataset) -> xr.Dataset:
    return results.sel(mesh=results.attrs["reference"])


def _curves(results: xr.Dataset) -> Figure:
    one = _reference(results)
    u = {v: 1e3 * float(one["sliding_normal_displacement"].sel(variant=v)[..., PRESSED - 1].mean()) for v in COLOURS}
    figure = sheet(7.4, "At 0.5 N the variants meet at " + words.listed([f"{x:.2f} mm ({v})" for v, x in u.items()])
                   + "; radial fibres give the largest contact")
    axes = figure.subplots(2, 2)
    for v, colour in COLOURS.items():
        press, slide = (one.sel(variant=v)[[f"{kind}_{name}" for name in names]] for kind, names in (
            ("pressing", ("normal_displacement", "normal_force", "area")),
            ("sliding", ("tangential_displacement", "tangential_force", "normal_force", "area"))))
        approach = 1e3 * press["pressing_normal_displacement"].mean("seed")
        axes[0, 0].plot(approach, press["pressing_normal_force"].mean("seed"), color=colour, label=v)
        _band(axes[0, 1], approach, 1e6 * press["pressing_area"], colour)
        travel = 1e3 * slide["sliding_tangential_displacement"].mean("seed")[PRESSED - 1:]
        ratio = (slide["sliding_tangential_force"] / slide["sliding_normal_force"])[:, PRESSED - 1:]
        area = (slide["sliding_area"] / slide["sliding_area"][:, PRESSED - 1])[:, PRESSED - 1:]
        _band(axes[1, 0], travel, ratio, colour)
        _band(axes[1, 1], travel, area, colour)
        if f"published_slip_{v}" in results.attrs:
            axes[1, 0].plot([results.attrs[f"published_slip_{v}"]], [1.03], "v", color=colour, markersize=8,
                            clip_on=False, label=f"full slip as published, {v}")
    axes[0, 0].axhline(0.5, color="#999999", linewidth=0.8)
    across = ["approach of the plate $u_N$ [mm]"] * 2 + ["travel of the plate $u_T$ [mm]"] * 2
    up = ("normal force $F_N$ [N]", "contact area $A$ [mm²]", "$F_T / F_N$ [-]", "$A / A_0$ [-]")
    for panel, x, y in zip(axes.flat, across, up, strict=True):
        tidy(panel)
        panel.set(xlabel=x, ylabel=y, ylim=(0, None), xlim=(0, None))
    legend_below(figure, list(axes.flat))
    return Figure("figure-3.png", figure, "The publication's figure 3. Above: pressing up to 2 N; below: sliding 8 mm "
                  "under 0.5 N. A is a circle as wide as the contact. The random variant is a mean over seeds, the "
                  "band spans them. Triangles: where the publication reads full slip.",
                  "Force and contact area over approach and travel of the plate, three variants")


def _band(panel, x: xr.DataArray, y: xr.DataArray, colour: str) -> None:
    """Mean over seeds, and their span."""
    panel.plot(x, y.mean("seed"), color=colour)
    panel.fill_between(x, y.min("seed"), y.max("seed"), color=colour, alpha=0.25, linewidth=0)


def _profiles(results: xr.Dataset) -> Figure:
    x = 1e3 * results["x"].values
    first = 1e-3 * results["profile_pressure"].isel(travel=0).mean("seed")
    peaks = {v: float(first.sel(variant=v).max()) for v in COLOURS}
    figure = sheet(6.6, "Before sliding the pressure peaks at "
                   + words.listed([f"{p:.1f} kPa ({v})" for v, p in peaks.items()])
                   + "; sliding moves it to the trailing side, most suddenly with radial fibres")
    axes = figure.subplots(2, 3, sharex=True, sharey="row")
    for j, (v, colour) in enumerate(COLOURS.items()):
        for i, name in enumerate(("pressure", "shear")):
            for k, travel in enumerate(results["travel"].values):
                profile = 1e-3 * results[f"profile_{name}"].sel(variant=v).isel(travel=k).mean("seed")
                axes[i, j].plot(x, profile, color=colormaps["viridis"](0.28 * k), linestyle=LINES[k],
                                label=f"$u_T$ = {1e3 * travel:g} mm")
            tidy(axes[i, j])
        axes[0, j].set_title(v, fontsize=11, color=colour)
        axes[1, j].set_xlabel("along the plate [mm]")
    axes[0, 0].set_ylabel("pressure [kPa]")
    axes[1, 0].set_ylabel("shear on the skin [kPa]")
    legend_below(figure, [axes[0, 0]])
    return Figure("figure-4.png", figure, "The publication's figure 4: tractions along the plate under 0.5 N, before "
                  "sliding and after 2, 3 and 4 mm; the bone's middle is at 0. The plate moves to the right, so the "
                  "finger trails with its right side. Moving average over "
                  f"{results.attrs['window_mm']:g} mm; mean over seeds for the random variant.",
                  "Pressure and shear along the plate at four travels, three variants")


def _maps(results: xr.Dataset, state: int) -> Figure:
    name = str(results["state"].values[state])
    nodes = 1e3 * np.column_stack([results["node_x"], results["node_y"]])
    quads = results["quads"].values
    figure = sheet(5.9, f"Fibres hinder stretch along them: {name}")
    axes = figure.subplots(2, 3, sharex=True, sharey=True)
    norm = TwoSlopeNorm(1.0, 0.7, 1.3)
    for j, v in enumerate(COLOURS):
        moved = nodes + 1e3 * results["map_displacement"].isel(state=state).sel(variant=v).values
        for i, (kind, symbol) in enumerate((("lambda_r", r"\lambda_r"), ("lambda_theta", r"\lambda_\theta"))):
            values = results[kind].isel(state=state).sel(variant=v).values
            panel = axes[i, j]
            panel.add_collection(PolyCollection(list(moved[quads]), array=values, cmap="RdBu_r", norm=norm,
                                                linewidths=0.1, edgecolors="face"))
            low = moved[:, 1].min()
            panel.plot([-12, 13], [low, low], color="#222222", linewidth=1.2)
            panel.set(aspect="equal", xlim=(-11, 13), ylim=(-9.4, 8.2))
            panel.spines[:].set_visible(False)
            panel.set(xticks=[], yticks=[])
            panel.text(0.02, 0.02, f"{values.min():.2f} to {values.max():.2f}", transform=panel.transAxes, fontsize=8.5)
            if j == 0:
                panel.text(0.0, 0.95, f"${symbol}$", transform=panel.transAxes, fontsize=14, va="top")
            if i == 0:
                panel.set_title(v, fontsize=11, color=COLOURS[v])
    bar = figure.colorbar(ScalarMappable(norm, "RdBu_r"), ax=axes, location="bottom", shrink=0.5, aspect=45, pad=0.02,
                          extend="both")
    bar.set_label("stretch [-]; the numbers in the panels are the smallest and the largest", fontsize=9)
    caption = ("The publication's figure 5: stretch of lines that ran away from the bone (above) and around it "
               f"(below), {name}"
               + (" (u_N is about 0.75 mm before sliding, not the 1 mm of the publication)" if state else "")
               + ". Colours end at 0.7 and 1.3. Seed 0 of the random variant.")
    return Figure(f"figure-5{'' if state else '-pressed'}.png", figure, caption, f"Maps of both stretches, {name}")


def _strain(results: xr.Dataset) -> Figure:
    x = 1e3 * results["ray_position"].values
    pad = np.abs(x) < 10
    most = {v: 100 * float(np.abs(results["receptor_shear"].sel(variant=v)[:, pad]).max()) for v in COLOURS}
    figure = sheet(7.6, "Where receptors lie, shear reaches "
                   + words.listed([f"{s:.0f} % ({v})" for v, s in most.items()]) + " within 4 mm of travel")
    axes = figure.subplots(3, 3, sharex=True, sharey="row")
    for j, (v, colour) in enumerate(COLOURS.items()):
        for i, name in enumerate(("radial", "circumferential", "shear")):
            for k, travel in enumerate(results["travel"].values):
                axes[i, j].plot(x[pad], 100 * results[f"receptor_{name}"].sel(variant=v).isel(travel=k)[pad],
                                color=colormaps["viridis"](0.28 * k), linestyle=LINES[k],
                                label=f"$u_T$ = {1e3 * travel:g} mm")
            tidy(axes[i, j])
            if j == 0:
                axes[i, 0].set_ylabel(f"{name} strain [%]")
        axes[0, j].set_title(v, fontsize=11, color=colour)
        axes[-1, j].set_xlabel("along the undeformed skin [mm]")
    legend_below(figure, [axes[0, 0]])
    return Figure("receptor-strain.png", figure, "Green strain 0.5 mm below the skin, under 0.5 N, along the pad; seed "
                  "0 of the random variant.", "Strain at receptor depth along the pad")


def _slip(results: xr.Dataset) -> Figure:
    base = results["assumption_measure"].sel(assumption="as assumed")
    slips = {v: float(base.sel(variant=v, measure="slip")) for v in ("radial", "random")}
    figure = sheet(5.6, "Full slip comes at " + words.listed([
        f"{slips[v]:.1f} mm ({v}; published: about {results.attrs[f'published_slip_{v}']:g})" for v in slips])
        + ": what moves it also moves the approach at 0.5 N")
    axes = figure.subplots(1, 2, sharey=True)
    inputs = list(dict.fromkeys(results["sweep_input"].values.tolist()))
    for panel, v in zip(axes, slips, strict=True):
        at = {m: float(base.sel(variant=v, measure=m)) for m in ("slip", "approach")}
        for k, name in enumerate(inputs):
            some = results.sel(two=v).isel(sweep=results["sweep_input"].values == name)
            order = np.argsort(np.append(some["sweep_value"], _assumed(name)))
            x, y = (np.append(some[f"sweep_{m}"], at[m])[order] for m in ("approach", "slip"))
            colour = colormaps["tab10"](k)
            panel.plot(x, y, "o-", color=colour, markersize=4, label=name)
            for a, b, value in zip(x, y, np.append(some["sweep_value"], _assumed(name))[order], strict=True):
                if np.isfinite(b) and value != _assumed(name):
                    panel.annotate(f"{value:g}", (a, b), textcoords="offset points", xytext=(4, 3), fontsize=7,
                                   color=colour)
        panel.plot(at["approach"], at["slip"], "k*", markersize=13, label="as assumed", zorder=5)
        panel.axhline(results.attrs[f"published_slip_{v}"], color="#B2182B", linestyle=(0, (6, 3)),
                      label="as published")
        panel.set_title(v, fontsize=11, color=COLOURS[v])
        panel.set_xlabel("approach of the plate at 0.5 N [mm]")
        tidy(panel)
    axes[0].set_ylabel("travel of the plate at full slip [mm]")
    legend_below(figure, list(axes), columns=4)
    return Figure("full-slip.png", figure, "One input changed at a time, on a coarser mesh; numbers at the points are "
                  "its values. All variants met the measured approach at 0.5 N in the publication, so a point far from "
                  "the star to the side pays with the force-displacement curve.",
                  "Travel at full slip over approach at 0.5 N, swept inputs")


def _assumed(name: str) -> float:
    return {"c [kPa]": 3.0, "effective length [mm]": 10.0, "offset of the bone [mm]": 1.0,
            "out-of-plane stiffness [N]": 100.0}.get(name, 1.0)
