"""Figures of the frequency response experiment, from its results alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from rom.fingertip import DIRECTIONS
from rom.reporting import palette, words
from rom.reporting.figure import Figure, drawable, error_axis, legend_below, number_axis, sheet, tidy, time_axis
from rom.vibration.frequency_response import MEASURES

DIRECT = "direct-reused"
ERROR_BAR = 1e-4
LOOK = {"excitation": (0, (4, 2)), "whole": "-"}


def hertz(value: float) -> str:
    """A frequency to a tenth; ``nowhere`` where there is none."""
    return "nowhere" if np.isnan(value) else f"{value:.1f} Hz"


def draw(results: xr.Dataset) -> list[Figure]:
    """Receptances, driving-point phase, errors, times."""
    return [_curves(results), _driving(results), _errors(results), _cost(results)]


def _panels(results: xr.Dataset, height: float, title: str):
    figure = sheet(height, title)
    axes = figure.subplots(1, 3, sharey=True, sharex=True)
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        tidy(panel)
        for k, f in enumerate(results["natural_frequency"].values):
            panel.axvline(f, color="#BBBBBB", linewidth=0.8, zorder=0.5, label="natural frequency" if not k else None)
        panel.set_title(direction, fontsize=10)
        panel.set_xlabel("frequency [Hz]")
    return figure, axes


def _look(name: str) -> dict[str, Any]:
    broad = name == DIRECT
    return {"color": palette.style(name).colour, "linewidth": 4.5 if broad else 1.3, "alpha": 0.45 if broad else 1.0}


def _curves(results: xr.Dataset) -> Figure:
    peaks = results["peak_frequency"].sel({"method": DIRECT}).sel(measure="excitation")
    figure, axes = _panels(results, 5.0, "The pad resonates at " + words.listed([
        f"{hertz(float(peaks.sel(direction=name)))} ({name})" for name in DIRECTIONS]))
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        for name in results["method"].values:
            for measure in MEASURES:
                one = results["receptance"].sel({"method": name}).sel(direction=direction, measure=measure)
                curve = 1e6 * abs(one)
                if name == DIRECT:  # broad and unbroken, so that thin and dashed lines show on it
                    panel.semilogy(results["frequency"], curve, **_look(name), label=name)
                else:
                    panel.semilogy(results["frequency"], curve, **_look(name), linestyle=LOOK[measure],
                                   label=f"{name}, {'loaded' if measure == 'excitation' else 'all moving'} nodes")
    number_axis(axes[0].yaxis)
    axes[0].set_ylabel("mean displacement over force [µm/N]")
    legend_below(figure, list(axes), columns=4)
    return Figure("receptance.png", figure, "Mean displacement magnitude over force amplitude: nodes under the force "
                  "(dashed) and all moving nodes (solid); direct solves as the broad grey line below the others.",
                  "Receptance over frequency, three directions")


def _driving(results: xr.Dataset) -> Figure:
    phase = np.degrees(np.unwrap(np.angle(results["driving_point_receptance"].sel({"method": DIRECT})), axis=1))
    lag = {name: -phase[i].min() for i, name in enumerate(DIRECTIONS)}
    figure, axes = _panels(results, 4.6, "The loaded patch lags its force by up to " + words.listed([
        f"{value:.0f}° ({name})" for name, value in lag.items()]))
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        for name in results["method"].values:
            curve = results["driving_point_receptance"].sel({"method": name}).sel(direction=direction).values
            panel.plot(results["frequency"], np.degrees(np.unwrap(np.angle(curve))), **_look(name), label=name)
    axes[0].set_ylabel("phase of the driving point [degree]")
    legend_below(figure, list(axes), columns=5)
    return Figure("phase.png", figure, "Phase of the mean displacement of the loaded nodes along the force, relative "
                  "to the force; a single resonance would pass through -90°.", "Driving-point phase over frequency")


def _errors(results: xr.Dataset) -> Figure:
    worst, alone = (float(results["error_max"].sel({"method": name})) for name in ("modal-krylov", "modal"))
    figure, axes = _panels(results, 4.8, f"modal-krylov: {words.error(worst)} at most; modes alone: "
                                         f"{words.error(alone)}")
    for panel, direction in zip(axes, DIRECTIONS, strict=True):
        for name in (method for method in results["method"].values if method != DIRECT):
            for variable, line, text in (("error_over_frequency", "-", "field"),
                                         ("node_error_over_frequency", (0, (1, 1.2)), "worst node")):
                error = results[variable].sel({"method": name, "direction": direction})
                panel.semilogy(results["frequency"], drawable(error), linestyle=line,
                               color=palette.style(name).colour, label=f"{name}, {text}")
        panel.axhline(ERROR_BAR, color=palette.GATE, linestyle=(0, (6, 3)), label=f"bar, {words.error(ERROR_BAR)}")
    error_axis(axes[0].yaxis)
    axes[0].set_ylabel("relative error against direct solves")
    legend_below(figure, list(axes), columns=4)
    return Figure("error.png", figure, "Relative error of the full field, and the largest error of any node over the "
                  "largest displacement of the case.", "Error over frequency")


def _cost(results: xr.Dataset) -> Figure:
    best = results.sel({"method": "modal-krylov"})
    figure = sheet(3.6, f"One sweep of {3 * results.sizes['frequency']} answers: modal-krylov is "
                   f"{words.ratio(float(best['speedup']))} faster online, "
                   f"{words.ratio(float(best['speedup_offline']))} with everything counted")
    axes = figure.subplots()
    tidy(axes, "x")
    names = list(results["method"].values)
    online = results["sweep_seconds"].median("repeat").values
    offline = results["offline_seconds"].values
    for i, name in enumerate(names):
        for k, (value, text) in enumerate(((online[i], "online"), (online[i] + offline[i], "online + offline"))):
            axes.barh(i + 0.2 - 0.4 * k, value, 0.36, color=palette.style(name).colour, alpha=1.0 if k == 0 else 0.45)
            axes.text(value * 1.08, i + 0.2 - 0.4 * k, f"{words.seconds(value)} {text}", va="center", fontsize=9)
    axes.set_xscale("log")
    axes.set_xlim(online.min() / 3, (online + offline).max() * 12)
    time_axis(axes.xaxis)
    axes.set_yticks(range(len(names)), names)
    axes.set_xlabel("wall time of the sweep [s]")
    return Figure("cost.png", figure, f"Wall time of the whole sweep on {results.attrs['machine']}; the direct sweep "
                  "is the median of some frequencies times their number.", "Time of a sweep by method")
