"""Figures of the sensitivity experiment, from its results alone."""

from __future__ import annotations

import numpy as np
import xarray as xr

from rom.fingertip import DIRECTIONS
from rom.reporting import words
from rom.reporting.figure import Figure, legend_below, sheet, tidy

KINDS = {"dimension": "dimensions (table 1)", "property": "tissue properties (table 2)",
         "assumption": "assumed surface shape"}
COLOURS = {"dimension": "#0072B2", "property": "#D55E00", "assumption": "#999999"}
CURVES = 6
CURVE_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
LIMIT = 1.0
"""Colours end at one per cent per cent; the numbers go on."""
RESPONSE_LIMIT = 4.0
ROWS_OF_RESPONSE = 14
LOSS = "loss factor, all tissues"


def spoken(one: xr.DataArray) -> str:
    """Name of a parameter within a sentence."""
    return one["parameter_label"].item().replace(":", "")


def ranking(values: xr.DataArray) -> list[xr.DataArray]:
    """One entry a parameter, the largest magnitude first."""
    return [values.isel(parameter=int(i)) for i in np.argsort(-np.abs(values.values), kind="stable")]


def off_similarity(results: xr.Dataset) -> dict[str, float]:
    """How far sums of logarithmic derivatives are from 1/2 (moduli), -1/2 (densities) and -1 (lengths), worst mode."""
    own = results["parameter_value"] * results["derivative"] / results["frequency"]  # a length of zero adds nothing
    name = results["parameter"].str
    groups = {"moduli": (name.endswith("elastic_modulus"), 0.5), "densities": (name.endswith("density"), -0.5),
              "lengths": (results["parameter_unit"] == "mm", -1.0)}
    return {key: float(np.abs(own.where(some, 0.0).sum("parameter") - total).max())
            for key, (some, total) in groups.items()}


def draw(results: xr.Dataset) -> list[Figure]:
    """First frequency ranked, all frequencies, responses at points, responses over frequency."""
    return [_first(results), _all(results), _points(results), _curves(results)]


def _first(results: xr.Dataset) -> Figure:
    ranked = ranking(results["logarithmic"].sel(mode=1))[:24]
    top = ranked[0]
    figure = sheet(7.2, f"1 % more {spoken(top)} {'raises' if top > 0 else 'lowers'} the first natural frequency by "
                        f"{abs(float(top)):.2f} %, more than any other parameter does")
    axes = figure.subplots()
    others = results["logarithmic"]
    drawn: set[str] = set()
    for row, one in enumerate(ranked):
        kind, value = one["parameter_kind"].item(), float(one)
        span = others.sel(parameter=one["parameter"].item())
        axes.barh(row, value, color=COLOURS[kind], height=0.7, label=None if kind in drawn else KINDS[kind])
        axes.plot([float(span.min()), float(span.max())], [row, row], color="black", linewidth=1.2,
                  label=None if row else f"range over modes 1 to {results.sizes['mode']}")
        drawn.add(kind)
    axes.set_yticks(range(len(ranked)), [_label(one) for one in ranked])
    axes.set_ylim(len(ranked) - 0.4, -0.6)
    axes.axvline(0, color="black", linewidth=0.8)
    axes.set_xlabel("change of natural frequency per change of the parameter [% per %]")
    tidy(axes, "x")
    axes.legend(loc="lower right", frameon=False)
    return Figure("first-frequency.png", figure,
                  "Bars: first natural frequency; lines: lowest to highest of all modes shown. The 24 largest.",
                  "Ranked sensitivities of the first natural frequency")


def _all(results: xr.Dataset) -> Figure:
    logarithmic = results["logarithmic"]
    largest = np.abs(logarithmic).max("mode")
    groups = {kind: ranking(largest.where(results["parameter_kind"] == kind, drop=True)) for kind in KINDS}
    top = {kind: groups[kind][0] for kind in ("dimension", "property")}
    figure = sheet(9.0, f"1 % more {spoken(top['dimension'])} moves a natural frequency by up to "
                        f"{float(top['dimension']):.2f} %; of the tissues' properties {spoken(top['property'])} does "
                        f"most, {float(top['property']):.2f} %")
    axes = figure.subplot_mosaic([["dimension", "property"], ["assumption", "property"]],
                                 gridspec_kw={"height_ratios": [len(groups["dimension"]), len(groups["assumption"])]})
    modes = [f"{m}\n{f:.0f}" for m, f in zip(results["mode"].values, results["frequency"].values, strict=True)]
    for kind, ranked in groups.items():
        names = [one["parameter"].item() for one in ranked]
        image = _heat(axes[kind], logarithmic.sel(parameter=names).values, [_label(one) for one in ranked], modes)
        axes[kind].set_title(KINDS[kind], fontsize=10)
    for kind in ("assumption", "property"):
        axes[kind].set_xlabel("mode, natural frequency [Hz]")
    figure.colorbar(image, ax=list(axes.values()), location="bottom", shrink=0.5, aspect=40, extend="both",
                    label="change of natural frequency per change of the parameter [% per %]")
    return Figure("all-frequencies.png", figure, "Each cell: per cent of a natural frequency per cent of a parameter; "
                  "rows sorted by their largest; a dot is less than 0.005.",
                  "Sensitivity of every natural frequency to every parameter")


def _points(results: xr.Dataset) -> Figure:
    points = results["point_logarithmic"]
    largest = np.abs(points).max(("direction", "point"))
    ranked = ranking(largest)[:ROWS_OF_RESPONSE]
    peak = results["point_by_loss_factor"].sel(point="peak")
    figure = sheet(5.6, f"1 % more loss factor lowers the peaks by {_span(-peak.values)} %; 1 % more "
                        f"{spoken(ranked[0])} moves a receptance at a rate of up to {float(ranked[0]):.0f} %")
    axes = figure.subplots(1, 3, sharey=True)
    labels = [LOSS, *(_label(one) for one in ranked)]
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        some = points.sel(direction=direction, parameter=[one["parameter"].item() for one in ranked])
        values = np.vstack([results["point_by_loss_factor"].sel(direction=direction).values, some.values])
        top = float(results["peak_frequency"].sel(direction=direction))
        columns = [f"peak\n{top:.0f} Hz" if np.isfinite(top) else "no\npeak",
                   *(str(point).replace(" ", "\n") for point in points["point"].values[1:])]
        image = _heat(panel, values, labels, columns, limit=RESPONSE_LIMIT)
        panel.set_title(f"{direction} force", fontsize=10)
        panel.axhline(0.5, color="black", linewidth=1.0)
    figure.colorbar(image, ax=list(axes), location="bottom", shrink=0.5, aspect=40, extend="both",
                    label="change of |receptance| per change of the parameter [% per %]")
    return Figure("responses.png", figure, "Each cell: per cent of the receptance's magnitude at the loaded patch per "
                  "cent of a parameter, at the highest peak and at five frequencies; a dot is less than 0.005.",
                  "Sensitivity of the receptance at peaks and at five frequencies")


def _curves(results: xr.Dataset) -> Figure:
    curves = results["response_logarithmic"]
    size = np.sqrt((curves**2).mean(("direction", "sweep")))
    ranked = ranking(size)[:CURVES]
    figure = sheet(5.6, "Over the band the receptance changes most with "
                        f"{words.listed([spoken(one) for one in ranked[:3]])}")
    axes = figure.subplots(1, 3, sharey=True, sharex=True)
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        for colour, one in zip(CURVE_COLOURS, ranked, strict=True):
            curve = curves.sel(direction=direction, parameter=one["parameter"].item())
            panel.plot(results["sweep"], curve, color=colour, linewidth=1.5, label=_label(one))
        panel.plot(results["sweep"], results["response_by_loss_factor"].sel(direction=direction), color="black",
                   linewidth=1.3, linestyle=(0, (4, 2)), label=LOSS)
        top = float(results["peak_frequency"].sel(direction=direction))
        if np.isfinite(top):
            panel.axvline(top, color="#BBBBBB", linewidth=1.0, zorder=0.5, label="highest peak")
        panel.axhline(0, color="black", linewidth=0.6)
        panel.set_title(f"{direction} force", fontsize=10)
        panel.set_xlabel("frequency [Hz]")
        tidy(panel)
    axes[0].set_ylabel("change of |receptance| [% per %]")
    legend_below(figure, list(axes), columns=4)
    return Figure("response-curves.png", figure, "The six parameters with the largest mean square over band and "
                  "directions, and the loss factor. Where a resonance moves, its flanks rise and fall.",
                  "Sensitivity of the receptance over frequency")


def _heat(axes, values: np.ndarray, rows: list[str], columns: list[str], limit: float = LIMIT):
    """A table of coloured numbers."""
    image = axes.imshow(values, cmap="RdBu_r", vmin=-limit, vmax=limit, aspect="auto")
    axes.set_xticks(range(len(columns)), columns, fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            axes.text(column, row, _cell(value), ha="center", va="center", fontsize=7,
                      color="white" if abs(value) > 0.65 * limit else "black")
    return image


def _cell(value: float) -> str:
    """Two decimals, a dot for what rounds to nothing."""
    return "·" if abs(value) < 0.005 else f"{value:.2f}".replace("-", "\u2212")


def _label(one: xr.DataArray) -> str:
    label = one["parameter_label"].item()
    return f"{label} (of 1 {one['parameter_unit'].item()})" if float(one["parameter_value"]) == 0 else label


def _span(values: np.ndarray) -> str:
    found = values[np.isfinite(values)]
    return "nothing" if not found.size else f"{found.min():.2f} to {found.max():.2f}"
