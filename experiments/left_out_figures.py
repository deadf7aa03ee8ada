"""Figures of what is left out, from the results alone."""

from __future__ import annotations

import numpy as np
import xarray as xr

from rom.reporting.figure import Figure, legend_below, sheet, tidy

COLOURS = {"import_seconds": "#9ecae1", "answer_seconds": "#2171b5", "peak_bytes": "#777777"}


def draw(results: xr.Dataset) -> list[Figure]:
    """Time and memory of each way, scene by scene."""
    middle = results[["import_seconds", "answer_seconds", "peak_bytes"]].median("repeat")
    total = middle["import_seconds"] + middle["answer_seconds"]
    ratio = (total.sel(way="everything") / total.sel(way="lean")).values
    figure = sheet(6.4, f"Building everything takes {ratio.min():.1f} to {ratio.max():.1f} times as long as building "
                   "what the scene needs")
    axes = figure.subplots(2, results.sizes["scene"], sharey="row", squeeze=False)
    for j, scene in enumerate(results["scene"].values):
        one = middle.sel(scene=scene)
        ways = [str(way) for way in one["way"].values if np.isfinite(total.sel(scene=scene, way=way))]
        place = np.arange(len(ways))
        kept = one.sel(way=ways)
        axes[0, j].bar(place, kept["import_seconds"], color=COLOURS["import_seconds"], label="imports")
        axes[0, j].bar(place, kept["answer_seconds"], bottom=kept["import_seconds"], color=COLOURS["answer_seconds"],
                       label="from there to the first answer")
        axes[1, j].bar(place, kept["peak_bytes"] / 1e6, color=COLOURS["peak_bytes"], label="peak memory")
        axes[0, j].set_title(str(scene), fontsize=10)
        for panel in axes[:, j]:
            tidy(panel, "y")
            panel.set_xticks(place, [way if way in ("lean", "everything") else f"+ {way}" for way in ways], rotation=40,
                             ha="right", fontsize=8)
    axes[0, 0].set_ylabel("time [s]")
    axes[1, 0].set_ylabel("peak memory [MB]")
    legend_below(figure, list(axes.flat))
    return [Figure("left-out.png", figure, "Lean: only what the scene needs. The others build one thing more, or "
                   "everything. Medians of fresh processes.",
                   "Time and memory with and without what a scene leaves out")]
