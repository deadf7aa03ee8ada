"""Figures of the tissue strain experiment, from its results alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from rom.fingertip import DIRECTIONS
from rom.reporting import palette, words
from rom.reporting.figure import Figure, drawable, error_axis, legend_below, sheet, tidy
from rom.reporting.skin import draw_skin

VIEW = (-58.0, -80.0)
"""From below, so that the whole pad is seen, the tip to the right."""
BARE = (0.93, 0.93, 0.93, 1.0)
TISSUE_COLOURS = {"stratum corneum": "#EFE3D0", "epidermis": "#E9C9B0", "dermis": "#F3DADA", "hypodermis": "#FBF3D5"}
FREQUENCY_COLOURS = ("#777777", "#56B4E9", "#0072B2", "#332288")
DEPTH_MARKERS = ("o", "s", "^", "v")


def percent(value: float) -> str:
    """A strain, ``12 %``."""
    return f"{words.significant(100 * value, 2)} %"


def at(frequency: float) -> str:
    """``static`` or ``50 Hz``."""
    return f"{frequency:g} Hz" if frequency else "static"


def errors_in_vibration(results: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Relative L2 errors of strain and displacement, largest over vibrating cases: two (method, depth) ndarrays."""
    moving = results.sel(frequency=results["frequency"] > 0)
    strain, displacement = (moving[name].max(("frequency", "direction")).transpose("method", "depth").values
                            for name in ("strain_error", "displacement_error"))
    return strain, displacement


def draw(results: xr.Dataset) -> list[Figure]:
    """Maps at the papillae, maps over depth, profiles, errors."""
    return [_maps(results, "principal_strain", 0, "principal-strain.png"),
            _maps(results, "energy_density", -1, "energy-density.png"),
            _over_depth(results), _profiles(results), _errors(results)]


def _values(results: xr.Dataset, name: str) -> np.ndarray:
    """(frequency, direction, depth, pad_quad) ndarray: strains in percent, energy densities in J/m3."""
    values = results[name].transpose("frequency", "direction", "depth", "pad_quad").values
    return values * 100 if "strain" in name else values


def _label(name: str) -> str:
    return "largest principal strain [%]" if "strain" in name else "strain energy density [J/m³]"


class _Skin:
    """The skin with numbers on the pad's quadrilaterals and grey elsewhere."""

    def __init__(self, results: xr.Dataset) -> None:
        self.position = np.column_stack([results[f"skin_{name}"].values for name in "xyz"]) * 1e3
        self.quads = results["skin_quads"].transpose("skin_quad", "corner").values.astype(int)
        self.pad = results["pad_skin_quad"].values.astype(int)

    def draw(self, axes: Any, values: np.ndarray, norm: Any, colours: Any) -> None:
        faces = np.tile(BARE, (len(self.quads), 1))
        faces[self.pad] = colours(norm(values))
        draw_skin(axes, self.position, self.quads, faces, view=VIEW, edge="#00000018")


def _maps(results: xr.Dataset, name: str, depth: int, file: str) -> Figure:
    """Directions by frequencies at one depth."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import PowerNorm

    values = _values(results, name)[:, :, depth]
    f, d, _ = np.unravel_index(values.argmax(), values.shape)
    hertz, place = results["frequency"].values, str(results["depth"].values[depth])
    norm, colours = PowerNorm(0.5, vmin=0, vmax=values.max()), colormaps["inferno_r"]
    number = words.significant(values.max(), 2) + (" %" if "strain" in name else " J/m³")
    what = "principal strain" if "strain" in name else "strain energy density"
    figure = sheet(1.75 * len(DIRECTIONS) + 1.2, f"At {place} the {what} reaches {number}, with "
                   f"{results['direction'].values[d]} force, {at(hertz[f])}")
    panels = figure.subplots(len(DIRECTIONS), len(hertz), subplot_kw={"projection": "3d"}, squeeze=False)
    skin = _Skin(results)
    for row, direction in enumerate(results["direction"].values):
        for column, frequency in enumerate(hertz):
            skin.draw(panels[row, column], values[column, row], norm, colours)
            most = words.significant(values[column, row].max(), 2)
            panels[row, column].set_title(f"{direction}, {at(frequency)}: {most}", fontsize=9, y=0.93)
    _bar(figure, ScalarMappable(norm, colours), panels, _label(name))
    return Figure(file, figure,
                  f"{_label(name).split(' [')[0].capitalize()} over the pad at {place}, seen from below, at the "
                  f"instant of the cycle with the largest energy density. Numbers in the titles are maxima in the "
                  f"bar's unit. The force is {results.attrs['force_n']:g} N over nine nodes at the fingerprint "
                  f"centroid, loss factor {results.attrs['loss_factor']:g}. Colour steps are finer for small values.",
                  f"Maps of {what} over the finger pad for three directions and several frequencies")


def _over_depth(results: xr.Dataset) -> Figure:
    """Depths by directions at the highest frequency: strain and energy density."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, PowerNorm

    names = ("principal_strain", "energy_density")
    depths, directions = results["depth"].values, results["direction"].values
    hertz = float(results["frequency"].values[-1])
    fields = {name: _values(results, name)[-1] for name in names}
    peak = fields["principal_strain"].max(axis=(0, 2))
    figure = sheet(1.45 * len(depths) + 1.3, f"At {hertz:g} Hz the largest principal strain is "
                   f"{words.significant(peak.max(), 2)} % at {depths[peak.argmax()]} and "
                   f"{words.significant(peak.min(), 2)} % at {depths[peak.argmin()]}")
    skin = _Skin(results)
    halves = figure.subfigures(1, 2)
    for half, name in zip(halves, names, strict=True):
        values = fields[name]
        most = values.max()
        norm = PowerNorm(0.5, 0, most) if "strain" in name else LogNorm(most / 1e3, most, clip=True)
        colours = colormaps["inferno_r"]
        panels = half.subplots(len(depths), len(directions), subplot_kw={"projection": "3d"}, squeeze=False)
        for row, depth in enumerate(depths):
            for column, direction in enumerate(directions):
                axes = panels[row, column]
                skin.draw(axes, values[column, row], norm, colours)
                axes.set_box_aspect(np.ptp(skin.position, axis=0), zoom=1.25)
                axes.set_title(direction if not row else "", fontsize=9, y=0.95)
                if not column:
                    axes.text2D(-0.02, 0.02, depth, transform=axes.transAxes, fontsize=8)
        _bar(half, ScalarMappable(norm, colours), panels, _label(name))
    return Figure("over-depth.png", figure,
                  f"Largest principal strain (left) and peak strain energy density (right, three decades) over the pad "
                  f"at {hertz:g} Hz: places from shallow to deep by rows, directions of the force by columns.",
                  "Maps of strain and energy density at four depths and for three directions of the force")


def _bar(figure: Any, mappable: Any, panels: np.ndarray, label: str) -> None:
    bar = figure.colorbar(mappable, ax=list(panels.ravel()), location="bottom", aspect=60, fraction=0.03, pad=0.02,
                          shrink=0.7)
    bar.set_label(label, fontsize=9)
    bar.ax.tick_params(labelsize=8)


def _profiles(results: xr.Dataset) -> Figure:
    """Below the load, down to the bone."""
    depth, tissue = results["profile_depth"].values, results["profile_tissue"].values
    directions, hertz = results["direction"].values, results["frequency"].values
    strain = results["profile_principal_strain"].transpose("frequency", "direction", "face").values * 100
    energy = results["profile_energy_density"].transpose("frequency", "direction", "face").values
    f, d, i = np.unravel_index(strain.argmax(), strain.shape)
    figure = sheet(7.0, f"Below the load the principal strain is largest in the {tissue[i]}, {depth[i]:.1f}\u00a0mm "
                   f"deep: {words.significant(strain.max(), 2)} % with {directions[d]} force, {at(hertz[f])}")
    panels = figure.subplots(2, len(directions), sharey=True, sharex="row", squeeze=False)
    for row, (values, label) in enumerate(((strain, _label("principal_strain")), (energy, _label("energy_density")))):
        for column, direction in enumerate(directions):
            axes = panels[row, column]
            tidy(axes)
            for name in dict.fromkeys(tissue):
                inside = depth[tissue == name]
                axes.axhspan(inside.min(), inside.max(), color=TISSUE_COLOURS.get(name, "#EEEEEE"), linewidth=0,
                             zorder=0.3, label=name)
            for frequency, colour, line in zip(hertz, FREQUENCY_COLOURS, values[:, column], strict=False):
                axes.plot(line, depth, color=colour, linewidth=1.5, label=at(frequency))
            axes.set_xlabel(label)
            if row:
                axes.set_xscale("log")
            else:
                axes.set_title(f"{direction} force", fontsize=10)
        panels[row, 0].set_ylabel("depth below the skin [mm]")
    panels[0, 0].set_xlim(0, 1.05 * strain.max())
    panels[0, 0].set_ylim(depth.max(), 0)
    legend_below(figure, list(panels.ravel()), columns=8)
    return Figure("depth-profile.png", figure,
                  "Mean over the four quadrilaterals in the middle of the loaded patch. Strain is constant or linear "
                  "in an element layer and jumps where the tissue changes, and a little from layer to layer.",
                  "Strain and energy density over depth below the load for three directions and several frequencies")


def _errors(results: xr.Dataset) -> Figure:
    """Strain against displacement, method by method."""
    strain, displacement = errors_in_vibration(results)
    methods = [str(label) for label in results["method"].values]
    depths = [str(name) for name in results["depth"].values]
    ratio = strain / displacement
    figure = sheet(0.42 * len(methods) + 2.3, f"Strain errors are {words.ratio(float(ratio.min()))} to "
                   f"{words.ratio(float(ratio.max()))} the displacement errors at the same points, "
                   f"{words.ratio(float(np.median(ratio)))} in the median")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.6, 1))
    rows = np.arange(len(methods))
    for k, (name, marker) in enumerate(zip(depths, DEPTH_MARKERS, strict=False)):
        shift = rows + 0.12 * (k - (len(depths) - 1) / 2)
        colours = [palette.style(label.split(":")[0]).colour for label in methods]
        left.scatter(drawable(strain[:, k]), shift, c=colours, marker=marker, s=34)
        left.scatter(drawable(displacement[:, k]), shift, facecolors="none", edgecolors=colours,
                     marker=marker, s=34)
        right.scatter(ratio[:, k], shift, c=colours, marker=marker, s=34)
        left.scatter([], [], color=palette.QUIET, marker=marker, s=34, label=name)
    left.scatter([], [], facecolors="none", edgecolors=palette.QUIET, marker="o", s=34, label="displacement (hollow)")
    for axes in (left, right):
        tidy(axes)
        axes.set_xscale("log")
    error_axis(left.xaxis)
    left.set_xlabel("largest relative L2 error over the pad [-]")
    right.set_xlabel("strain error / displacement error [-]")
    right.axvline(1, color=palette.QUIET, linewidth=1)
    low, high = right.get_xlim()
    ticks = [tick for tick in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if low <= tick <= high]
    right.set_xticks(ticks, [f"{tick:g} ×" for tick in ticks])
    right.minorticks_off()
    left.set_yticks(rows, methods)
    left.invert_yaxis()
    legend_below(figure, [left], columns=5)
    return Figure("strain-error.png", figure,
                  "Error of reduced models against direct solves, the largest over directions and frequencies above "
                  "zero. Filled marks: strain; hollow ones: displacement at the same points; shapes tell depths apart.",
                  "Errors of strain and displacement by method, and their ratio")
