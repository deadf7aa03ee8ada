"""The hard split in its parts: where the models trained without them still hold."""

from __future__ import annotations

import textwrap

import numpy as np

from rom.reporting import words
from rom.reporting.figure import COLUMN, Figure, drawable, sheet
from rom.reporting.results import Results

DECADES = 3.0
"""Errors so many powers of ten from the gate have the full colour."""


def error_by_region(found: Results) -> Figure | None:
    """Largest error of each method's headline in each part of the hard split."""
    if not found.regions:
        return None
    from matplotlib.colors import Normalize

    rows = [found.headline(m) for m in found.methods]
    table = np.column_stack([found.errors(found.splits[0])[rows], found.region_errors[rows]])
    columns = [f"{found.splits[0]} split", *found.regions]
    colour = np.log10(drawable(table) / found.gate)
    figure = sheet(0.36 * len(rows) + 2.1, _title(found), COLUMN)
    axes = figure.subplots()
    image = axes.imshow(np.ma.masked_invalid(colour), cmap="PuOr_r", norm=Normalize(-DECADES, DECADES), aspect="auto")
    for (k, j), value in np.ndenumerate(table):
        strong = np.isfinite(colour[k, j]) and abs(colour[k, j]) > 0.6 * DECADES
        axes.text(j, k, words.error(value), ha="center", va="center", fontsize=9, color="white" if strong else "black")
    axes.set_xticks(range(len(columns)), [textwrap.fill(c, 14) for c in columns], fontsize=9)
    axes.set_yticks(range(len(rows)), [found.method[i] for i in rows], fontsize=9.5)
    axes.spines[:].set_visible(False)
    axes.axvline(0.5, color="white", linewidth=5)
    axes.set_xticks(np.arange(len(columns) - 1) + 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) - 1) + 0.5, minor=True)
    axes.grid(which="minor", color="white", linewidth=1.5)
    axes.tick_params(which="both", length=0)
    bar = figure.colorbar(image, ax=axes, pad=0.02, location="bottom", aspect=40)
    ticks = np.arange(-3, 4)
    bar.set_ticks(list(ticks), labels=[words.error(found.gate * 10.0 ** t) for t in ticks], fontsize=8)
    bar.set_label("largest relative error; white is the gate", fontsize=9)
    return Figure("error-by-region.png", figure,
                  f"Largest error at the settings that stand for their methods: on the {found.splits[0]} split, and, "
                  "trained without them, in the parts that the hard split keeps from training. Purple is within the "
                  "gate, orange outside; a dash where no case was judged.",
                  "Table of largest errors by method and part of the hard split, coloured by distance from the gate.")


def _title(found: Results) -> str:
    errors = found.region_errors
    errors = errors[:, np.isfinite(errors).any(axis=0)]
    hold = [m for m in found.reduced if errors.size and (errors[found.headline(m)] <= found.gate).all()]
    gate = words.error(found.gate)
    if not hold:
        return f"Outside its training no method stays within {gate} everywhere"
    if len(hold) == len(found.reduced):
        return f"Every method stays within {gate} in every part that it has not seen"
    return f"Within {gate} in every part of the hard split: {words.listed(hold)}"
