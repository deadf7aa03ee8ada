"""Figures of the tissue loss factor experiment, from its results alone."""

from __future__ import annotations

import numpy as np
import xarray as xr

from rom.fingertip import DIRECTIONS
from rom.reporting import words
from rom.reporting.figure import Figure, drawable, error_axis, legend_below, number_axis, sheet, tidy, time_axis
from rom.vibration.resonance import highest_peak

METHODS = {"galerkin": "Galerkin", "uncoupled": "real modes, uncoupled"}
LOOK = {"galerkin": ("#332288", "o", "-"), "uncoupled": ("#D55E00", "s", (0, (4, 2)))}
TISSUE_COLOURS = {"stratum_corneum": "#E69F00", "epidermis": "#CC79A7", "dermis": "#D55E00", "hypodermis": "#0072B2",
                  "nail_bed": "#009E73", "nail_plate": "#777777"}


def highest(results: xr.Dataset, contrast: float, direction: str) -> tuple[float, float]:
    """Frequency [Hz] and height [m/N] of Galerkin's highest peak; NaN where there is none."""
    curve = results["receptance"].sel(model="galerkin", contrast=contrast, direction=direction)
    found = highest_peak(results["sweep"].values, curve.values)
    return (np.nan, np.nan) if found is None else (found.frequency, found.height)


def draw(results: xr.Dataset) -> list[Figure]:
    """Errors against contrast, modal loss factors, responses, run times."""
    return [_errors(results), _modal(results), _responses(results), _cost(results)]


def _ratio(results: xr.Dataset) -> np.ndarray:
    return (results["loss_factor"].max("tissue") / results["loss_factor"].min("tissue")).values


def _errors(results: xr.Dataset) -> Figure:
    worst = results["error"].max("frequency")
    galerkin, real = (float(worst.sel(model=name).max()) for name in METHODS)
    grows = (worst.sel(model="uncoupled").max("direction").diff("contrast") > 0).all()
    figure = sheet(4.8, ("The more the tissues' loss factors differ, the more uncoupled real modes miss: " if grows else
                         "Where the tissues' loss factors differ, uncoupled real modes miss ")
                   + f"up to {words.error(real)} of the field; Galerkin stays within {words.error(galerkin)}")
    axes = figure.subplots(1, 3, sharey=True)
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        for name, label in METHODS.items():
            colour, marker, line = LOOK[name]
            panel.semilogy(results["contrast"], drawable(worst.sel(model=name, direction=direction).values),
                           marker=marker, linestyle=line, color=colour, label=label)
        ready = results["prepared"].values == 1
        exact = drawable(worst.sel(model="galerkin", direction=direction).values[ready])
        panel.semilogy(results["contrast"].values[ready], exact, "o", ms=11, markerfacecolor="none",
                       markeredgecolor="black", linestyle="none", label="basis prepared for these loss factors")
        panel.set_xticks(results["contrast"].values, [f"{c:g}\n{r:.2g}:1" for c, r in zip(
            results["contrast"].values, _ratio(results), strict=True)])
        panel.set_title(f"{direction} force", fontsize=10)
        panel.set_xlabel("contrast\nlargest : smallest loss factor")
        tidy(panel)
    axes[0].set_ylabel("largest relative error of the field [-]")
    error_axis(axes[0].yaxis)
    legend_below(figure, list(axes), columns=3)
    return Figure("errors.png", figure, "Against direct solutions, the largest over the frequencies solved. Contrast 1 "
                  "is the assumed set of loss factors, 0 one loss factor for all.",
                  "Error of reduced models against the contrast of loss factors")


def _modal(results: xr.Dataset) -> Figure:
    share = results["modal_loss_factor"]
    total = share.sum("tissue")
    figure = sheet(4.8, f"Modes mix the tissues' loss factors by strain energy: {float(total.min()):.3f} to "
                        f"{float(total.max()):.3f} for the first {total.size}")
    axes = figure.subplots(1, 2, gridspec_kw={"width_ratios": (3, 2)})
    bottom, mode = np.zeros(total.size), results["mode"].values
    for name in results["tissue"].values:
        loss = float(results["loss_factor"].sel(tissue=name, contrast=1.0))
        axes[0].bar(mode, share.sel(tissue=name), bottom=bottom, color=TISSUE_COLOURS[name], width=0.75,
                    label=f"{name.replace('_', ' ')}, loss factor {loss:.2g}")
        bottom = bottom + share.sel(tissue=name).values
    axes[0].set_xticks(mode, [f"{m}\n{f:.0f} Hz" for m, f in zip(
        mode, results["natural_frequency"].values, strict=True)])
    axes[0].set_xlabel("mode and its natural frequency")
    axes[0].set_ylabel("modal loss factor, by tissue [-]")
    by_contrast = results["modal_loss_factor_by_contrast"]
    for i, m in enumerate(mode):
        axes[1].plot(results["contrast"], by_contrast.sel(mode=m), marker=".", color=str(0.75 * i / len(mode)),
                     linewidth=1.2)
    last = by_contrast.isel(contrast=-1).values
    for i in {int(last.argmin()), int(last.argmax())}:
        axes[1].annotate(f"mode {mode[i]}", (float(results["contrast"][-1]), last[i]), xytext=(4, 0),
                         textcoords="offset points", va="center", fontsize=9, annotation_clip=False)
    axes[1].set_xlabel("contrast (0: equal, 1: as assumed) [-]")
    axes[1].set_ylabel("modal loss factor [-]")
    for panel in axes:
        panel.set_ylim(0)
        tidy(panel, "y")
    legend_below(figure, [axes[0]], columns=3)
    return Figure("modal-loss-factors.png", figure, "Left: the assumed loss factors. Right: every mode as the tissues' "
                  "loss factors are spread; their mean over the modes is held.",
                  "Modal loss factors by tissue and over contrast")


def _responses(results: xr.Dataset) -> Figure:
    from matplotlib.ticker import LogLocator

    strong = float(results["contrast"].max())
    pairs = [(highest(results, 0.0, name), highest(results, strong, name)) for name in DIRECTIONS]
    moved = [(abs(b[0] - a[0]), abs(b[1] / a[1] - 1)) for a, b in pairs if np.isfinite([a, b]).all()]
    place, height = np.max(moved, axis=0) if moved else (np.nan, np.nan)
    figure = sheet(5.4, f"Unequal loss factors of the same mean modal loss factor move the highest peaks by at most "
                        f"{place:.1f} Hz and change their heights by up to {words.error(float(height))}")
    axes = figure.subplots(1, 3, sharey=True, sharex=True)
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        for contrast, colour in ((0.0, "#999999"), (strong, "#0072B2")):
            some = {"contrast": contrast, "direction": direction}
            ratio = float(_ratio(results)[results["contrast"].values == contrast][0])
            name = "equal loss factors" if contrast == 0 else f"loss factors {ratio:.0f} to 1"
            for method in METHODS:
                if contrast or method == "galerkin":
                    real = method == "uncoupled"
                    panel.semilogy(results["sweep"], 1e6 * np.abs(results["receptance"].sel(model=method, **some)),
                                   color="#D55E00" if real else colour, linewidth=1.3 if real else 2.2,
                                   linestyle=LOOK[method][2], label=f"{name}, {METHODS[method]}")
            panel.semilogy(results["frequency"], 1e6 * np.abs(results["direct_receptance"].sel(some)), "o", ms=5,
                           markerfacecolor="white", markeredgecolor="black", linestyle="none", label="direct")
        panel.set_title(f"{direction} force", fontsize=10)
        panel.set_xlabel("frequency [Hz]")
        tidy(panel)
    axes[0].set_ylabel("receptance of the patch [µm/N]")
    axes[0].yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    number_axis(axes[0].yaxis)
    legend_below(figure, list(axes), columns=4)
    return Figure("responses.png", figure, "Mean displacement of the nine loaded nodes along the force, over the "
                  "force.", "Receptance over frequency for equal and for unequal loss factors")


def _cost(results: xr.Dataset) -> Figure:
    seconds = results["seconds"]
    median = seconds.median("repeat")
    direct = float(median.sel(timed="direct"))
    gain = [f"{words.ratio(direct / float(median.sel(timed=name)))} ({METHODS[name]})" for name in METHODS]
    figure = sheet(2.9, f"One frequency takes {words.seconds(direct)} directly; the reduced models are faster by "
                        f"{words.listed(gain)}")
    axes = figure.subplots()
    names = ["direct", *METHODS]
    for row, name in enumerate(names):
        colour = "#000000" if name == "direct" else LOOK[name][0]
        axes.plot(seconds.sel(timed=name), np.full(seconds.sizes["repeat"], row), "|", ms=12, color=colour)
        axes.plot(float(median.sel(timed=name)), row, "o", color=colour)
        axes.annotate(words.seconds(float(median.sel(timed=name))), (float(median.sel(timed=name)), row), xytext=(0, 9),
                      textcoords="offset points", ha="center", fontsize=9)
    axes.set_xscale("log")
    axes.set_yticks(range(len(names)), ["direct", *METHODS.values()])
    axes.set_ylim(len(names) - 0.5, -0.8)
    time_axis(axes.xaxis)
    axes.set_xlabel("wall time of three loads at one frequency, full fields; dot: median, bars: repeats")
    tidy(axes, "x")
    return Figure("times.png", figure, "Three loads at one frequency with the assumed loss factors.",
                  "Run times of direct solution and reduced models")
