"""Where methods err: over frequency in harmonic scenes, over the number of forces in static ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rom.reporting import palette, words
from rom.reporting.figure import Figure, drawable, error_axis, gate_line, legend_below, sheet, tidy
from rom.reporting.results import SOLVERS, Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_BINS = 24
CASES_A_BIN = 8
GAP_HZ = 5.0
"""Held-out frequencies farther apart belong to different bands."""


def error_over_frequency(found: Results) -> Figure | None:
    """Error over frequency with the natural frequencies marked; None for a static scene or without case errors."""
    return _over_frequency(found) if "case_error" in found.data and found.harmonic else None


def error_over_forces(found: Results) -> Figure | None:
    """Error by the number of forces; None for scenes that do not vary it or without case errors."""
    known = {"case_error", "load_node"} <= set(found.data.variables)
    return _over_forces(found) if known and not found.harmonic else None


# ---- harmonic -----------------------------------------------------------------------------------------------


def _over_frequency(found: Results) -> Figure:
    figure = sheet(8.6, _frequency_title(found))
    panels = list(figure.subplots(len(found.splits), 1, sharex=True, squeeze=False)[:, 0])
    frequency = found.data["frequency"].values.astype(float)
    for axes, split in zip(panels, found.splits, strict=True):
        axes.set_yscale("log")
        bands = held_out_bands(found) if split != found.splits[0] else []
        edges = [found.band_hz + 0.5, *(edge for low, high in bands for edge in (low - 0.5, high + 0.5))]
        for method in shown_methods(found):
            errors = drawable(found.case_errors(found.headline(method), split))
            middle, worst, typical = binned(frequency, errors, edges)
            colour, marker = palette.style(method)
            axes.plot(middle, worst, color=colour, marker=marker, markersize=4.5, linewidth=1.2, label=method)
            axes.plot(middle, typical, color=colour, linewidth=0.8, linestyle=":", alpha=0.8)
        _shade(axes, found, frequency, split)
        gate_line(axes, found.gate)
        axes.set_title(f"{split} split: largest error in a bin (line with markers) and median (dotted)", fontsize=10)
        axes.set_ylabel("relative error [1]")
        error_axis(axes.yaxis)
        tidy(axes)
    panels[-1].set_xlabel("frequency [Hz]")
    legend_below(figure, panels)
    return Figure("error-over-frequency.png", figure,
                 "Error over frequency at each method's headline setting. Ticks along the top: natural frequencies. "
                 "Blue: bands that the hard split keeps from training; sand: beyond the published range. The "
                 "solvers of the full model are left out.",
                 "Largest and median held-out error in frequency bins for each method, with natural frequencies "
                 "marked.")


def shown_methods(found: Results) -> list[str]:
    """All but the solvers of the full model, whose rounding errors would take most of the axis."""
    return [m for m in found.methods if m not in SOLVERS] or found.methods


def binned(x: np.ndarray, errors: np.ndarray, edges: Sequence[float] = ()) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles, largest and median error of equally filled bins that no edge parts; cases with NaN are left out."""
    known = np.isfinite(errors)
    x, errors = x[known], errors[known]
    if not len(x):
        return np.zeros(0), np.zeros(0), np.zeros(0)
    order = np.argsort(x, kind="stable")
    wide = max(CASES_A_BIN, len(x) / MOST_BINS)
    bins = [b for part in np.split(order, np.searchsorted(x[order], sorted(edges))) if len(part)
            for b in np.array_split(part, max(1, int(len(part) // wide)))]
    return (np.array([np.median(x[b]) for b in bins]), np.array([errors[b].max() for b in bins]),
            np.array([np.median(errors[b]) for b in bins]))


def _shade(axes: Axes, found: Results, frequency: np.ndarray, split: str) -> None:
    if frequency.max() > found.band_hz and split != found.splits[0]:
        axes.axvspan(found.band_hz, frequency.max(), color=palette.BEYOND, linewidth=0, zorder=0,
                     label="beyond the published range")
    if split != found.splits[0]:
        for low, high in held_out_bands(found):
            axes.axvspan(low - 0.5, high + 0.5, color=palette.HELD_OUT, linewidth=0, zorder=0,
                         label="band kept from training")
    shown = found.natural_hz[found.natural_hz <= max(frequency.max(), found.band_hz)]
    if len(shown):
        from matplotlib.transforms import blended_transform_factory

        transform = blended_transform_factory(axes.transData, axes.transAxes)
        axes.set_ylim(top=8 * axes.get_ylim()[1])
        axes.plot(shown, np.full_like(shown, 0.97), "|", color="black", markersize=10, markeredgewidth=1.1,
                  transform=transform, label="natural frequency")


def held_out_bands(found: Results) -> list[tuple[float, float]]:
    """Frequency bands [Hz] kept from hard training, as the cases themselves show them."""
    codes = [k + 1 for k, name in enumerate(found.regions) if "frequency band" in name]
    if not codes or "hard_region" not in found.data.variables:
        return []
    inside = np.isin(found.data["hard_region"].values, codes)
    held = np.unique(found.data["frequency"].values[inside])
    groups = np.split(held, np.flatnonzero(np.diff(held) > GAP_HZ) + 1)
    return [(float(g[0]), float(g[-1])) for g in groups if len(g)]


def _frequency_title(found: Results) -> str:
    split = found.splits[0]
    frequency = found.data["frequency"].values.astype(float)
    peaks = []
    for method in found.reduced:
        errors = found.case_errors(found.headline(method), split)
        if np.isfinite(errors).any() and np.nanmax(errors) > found.gate:
            at = words.frequency(frequency[np.nanargmax(errors)])
            peaks.append(f"{method} ({words.error(np.nanmax(errors))} at {at})")
    gate = words.error(found.gate)
    if not peaks:
        return f"At their headline settings all methods stay within {gate} at every frequency of the {split} split"
    return f"Above {gate} somewhere in the band, {split} split: {words.listed(peaks)}"


# ---- static -------------------------------------------------------------------------------------------------


def _over_forces(found: Results) -> Figure:
    load = found.data["load_node"].transpose("case", ...).values.reshape(found.data.sizes["case"], -1)
    numbers = (load >= 0).sum(axis=1)
    figure = sheet(5.6, _forces_title(found, numbers))
    panels = list(figure.subplots(1, len(found.splits), sharey=True, squeeze=False)[0])
    for axes, split in zip(panels, found.splits, strict=True):
        axes.set_yscale("log")
        present: set[int] = set()
        methods = shown_methods(found)
        for k, method in enumerate(methods):
            errors = drawable(found.case_errors(found.headline(method), split))
            groups = {int(n): errors[(numbers == n) & np.isfinite(errors)] for n in np.unique(numbers)}
            groups = {n: group for n, group in groups.items() if len(group)}
            present |= set(groups)
            colour, marker = palette.style(method)
            at = np.array(list(groups)) + 0.6 * ((k + 0.5) / len(methods) - 0.5)
            worst, typical = ([f(group) for group in groups.values()] for f in (np.max, np.median))
            axes.vlines(at, typical, worst, color=colour, linewidth=1.4)
            axes.plot(at, worst, linestyle="none", marker=marker, color=colour, markersize=7, label=method)
            axes.plot(at, typical, linestyle="none", marker="_", color=colour, markersize=7)
        gate_line(axes, found.gate)
        axes.set_xticks(sorted(present) or [1])
        axes.set_title(f"{split} split", fontsize=11)
        axes.set_xlabel("number of forces")
        error_axis(axes.yaxis)
        tidy(axes, "y")
    panels[0].set_ylabel("relative error [1]: marker largest, dash median")
    legend_below(figure, panels)
    return Figure("error-over-forces.png", figure,
                 "Error by the number of simultaneous forces at each method's headline setting; the marker is the "
                 "largest held-out error, the dash the median. The solvers of the full model are left out.",
                 "Largest and median held-out error for each number of forces and each method.")


def _forces_title(found: Results, numbers: np.ndarray) -> str:
    outside = [m for m in found.reduced if found.errors(found.splits[0])[found.headline(m)] > found.gate]
    gate = words.error(found.gate)
    if outside:
        return f"Above {gate} for some number of forces within the published range: {words.listed(outside)}"
    return f"At their headline settings all methods stay within {gate} for every published number of forces"
