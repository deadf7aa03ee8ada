"""Where methods err: over every input of the scene, and in its other quantities."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rom.reporting import palette, words
from rom.reporting.cases import Input, inputs_of
from rom.reporting.figure import COLUMN, Figure, dodged, drawable, error_panel, legend_below, sheet, spread
from rom.reporting.results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_BINS = 24
CASES_A_BIN = 8
MOST_BANDS = 4
"""More intervals of one input do not make a part of the hard split."""


def error_over_inputs(found: Results) -> Figure | None:
    """Largest and median error over each input, a row an input, a column a split."""
    inputs = inputs_of(found) if "case_error" in found.data else []
    if not inputs:
        return None
    rows, columns = len(inputs), len(found.splits)
    figure = sheet(1.6 + 2.2 * rows, _inputs_title(found), COLUMN)
    panels = figure.subplots(rows, columns, sharex="row", sharey=True, squeeze=False)
    for row, one in zip(panels, inputs, strict=True):
        for axes, split in zip(row, found.splits, strict=True):
            bands = kept_from_training(found, one) if split != found.splits[0] else []
            _categories(axes, found, one, split) if one.few else _bins(axes, found, one, split, bands)
            error_panel(axes, found.gate, "y" if one.few else "both")
            for low, high in bands:
                axes.axvspan(low, high, color=palette.HELD_OUT, linewidth=0, zorder=0, label="kept from training")
            _marks(axes, found, one)
            axes.set_xlabel(textwrap.fill(one.title, 34), fontsize=9)
        row[0].set_ylabel("relative error")
    for axes, split in zip(panels[0], found.splits, strict=True):
        axes.set_title(f"{split} split", fontsize=10)
    legend_below(figure, list(panels.ravel()), columns=4)
    return Figure("error-over-inputs.png", figure,
                  "Error over each input at the settings that stand for their methods. Markers: the largest error of a "
                  "bin or a value; dotted lines and dashes: the median. Blue: kept from training; ticks along the "
                  "top: natural frequencies. The solvers of the full model are left out.",
                  "Largest and median held-out error of each method over each input of the scene.")


def _bins(axes: Axes, found: Results, one: Input, split: str, bands: Sequence[tuple[float, float]]) -> None:
    for method in found.reduced:
        errors = drawable(found.case_errors(found.headline(method), split))
        middle, worst, typical = binned(one.values, errors, [edge for band in bands for edge in band])
        colour, marker = found.style(method)
        axes.plot(middle, worst, color=colour, marker=marker, markersize=4, linewidth=1.1, label=method)
        axes.plot(middle, typical, color=colour, linewidth=0.8, linestyle=":", alpha=0.8)


def _categories(axes: Axes, found: Results, one: Input, split: str) -> None:
    names = np.unique(one.values)
    for k, method in enumerate(found.reduced):
        errors = found.case_errors(found.headline(method), split)
        groups = [errors[(one.values == name) & np.isfinite(errors)] for name in names]
        typical, worst = (np.array([f(g) if len(g) else np.nan for g in groups]) for f in (np.median, np.max))
        spread(axes, dodged(len(names), k, len(found.reduced)), typical, worst, found.style(method), method)
    axes.set_xticks(range(len(names)), [f"{name:g}" if names.dtype.kind == "f" else str(name) for name in names])


def _marks(axes: Axes, found: Results, one: Input) -> None:
    """Ticks along the top where the results name natural values of this input."""
    known = found.data.get(f"natural_{one.name}")
    if known is None or one.few:
        return
    shown = known.values[(known.values >= one.values.min()) & (known.values <= one.values.max())]
    axes.plot(shown, np.full(len(shown), 0.97), "|", color="black", markersize=8, transform=axes.get_xaxis_transform())


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


def kept_from_training(found: Results, one: Input) -> list[tuple[float, float]]:
    """Intervals of an input that make a part of the hard split: none of its cases has a value met in training."""
    if "hard_region" not in found.data.variables or one.few:
        return []
    region = found.data["hard_region"].values
    trained, kept = np.unique(one.values[region == 0]), []
    half = 0.5 * float(np.diff(np.unique(one.values)).min())
    for code in range(1, len(found.regions) + 1):
        values = np.unique(one.values[region == code])
        if len(values) and not np.isin(values, trained).any():
            between = np.flatnonzero(np.diff(np.searchsorted(trained, values)))  # values met in training lie there
            parts = np.split(values, between + 1) if len(between) < MOST_BANDS else []  # or chance keeps values apart
            kept += [(float(part[0]) - half, float(part[-1]) + half) for part in parts]
    return kept


def error_by_quantity(found: Results) -> Figure | None:
    """Largest and median error of each further quantity, a panel a split."""
    if not found.quantities:
        return None
    worst, typical = found.quantity_errors("max"), found.quantity_errors("median")
    figure = sheet(1.6 + 2.6 * len(found.splits), _quantities_title(found, worst[:, 0]), COLUMN)
    panels = list(figure.subplots(len(found.splits), 1, sharex=True, sharey=True, squeeze=False)[:, 0])
    for s, (axes, split) in enumerate(zip(panels, found.splits, strict=True)):
        for k, method in enumerate(found.reduced):
            i = found.headline(method)
            spread(axes, dodged(len(found.quantities), k, len(found.reduced)), typical[i, s], worst[i, s],
                   found.style(method), method)
        error_panel(axes, found.gate, "y")
        axes.set_ylabel(f"relative error, {split} split")
        axes.set_xticks(range(len(found.quantities)), found.quantities)
    legend_below(figure, panels, columns=4)
    meaning = found.record("quantity_definitions") or {}
    return Figure("error-by-quantity.png", figure,
                  "Errors of the other quantities at the settings that stand for their methods: marker largest, dash "
                  "median. " + " ".join(f"{name.capitalize()}: {text}." for name, text in meaning.items()),
                  f"Largest and median error by method in {words.listed(found.quantities)}.")


def _inputs_title(found: Results) -> str:
    split, gate = found.splits[0], words.error(found.gate)
    outside = [m for m in found.reduced if found.errors(split)[found.headline(m)] > found.gate]
    if outside:
        return f"Above {gate} somewhere on the {split} split: {words.listed(outside)}"
    return f"All methods stay within {gate} everywhere on the {split} split"


def _quantities_title(found: Results, worst: np.ndarray) -> str:
    good = [name for q, name in enumerate(found.quantities)
            if any(worst[found.headline(m), q] <= found.gate for m in found.reduced)]
    where = f"within {words.error(found.gate)} on the {found.splits[0]} split"
    return f"Some method stays {where} in {words.listed(good)}" if good else f"No method stays {where} in any quantity"
