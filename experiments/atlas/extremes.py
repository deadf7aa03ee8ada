"""The grid of extremes: named axes, each a list of levels that go on until something breaks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from atlas import excitation_extremes, load_extremes, numerical_extremes, tissue_extremes
from atlas.level import Level

AXES: dict[str, Callable[[], list[Level]]] = {
    "incompressibility": tissue_extremes.incompressibility,
    "nail": tissue_extremes.nail,
    "soft hypodermis": tissue_extremes.soft_hypodermis,
    "slivers": tissue_extremes.slivers,
    "loss factor": excitation_extremes.loss_factor,
    "frequency": excitation_extremes.frequency,
    "resonance distance": excitation_extremes.resonance_distance,
    "mode clusters": excitation_extremes.mode_clusters,
    "load placement": load_extremes.load_placement,
    "opposed forces": load_extremes.opposed_forces,
    "force size": load_extremes.force_size,
    "mesh density": numerical_extremes.mesh_density,
    "single precision": numerical_extremes.single_precision,
    "POD snapshots": numerical_extremes.pod_snapshots,
    "rank": numerical_extremes.rank,
    "networks outside their range": numerical_extremes.unseen_inputs,
    "threads": numerical_extremes.thread_counts,
}


MOST_QUICK = 3
"""Levels of an axis that a quick atlas asks."""


def levels(quick: bool = False) -> list[Level]:
    """Every level, axis by axis; `MOST_QUICK` of each, first and last among them, where it must be quick."""
    found: list[Level] = []
    for make in AXES.values():
        axis = make()
        if quick:
            axis = [level for level in axis if not level.slow]
            kept = np.unique(np.linspace(0, len(axis) - 1, MOST_QUICK).round().astype(int))
            axis = [axis[k] for k in kept]
        found += axis
    return found
