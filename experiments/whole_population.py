"""Where do networks and their opponents err over the whole published population, not over a few hundred cases of it?

Two pages: every combination of one to three static forces, and every case of the harmonic grid. Each holds the
comparison's own results and, beside them, errors over all held-out cases of the population, by what cases have in
common, at resonance peaks, and of learners with fewer snapshots.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import script
import xarray as xr
from full_scale import Contenders, full_scale

from rom.comparison import compared, scene_of
from rom.comparison.side_by_side import asked
from rom.comparison.truth import find_truth
from rom.reporting.figure import Figure
from rom.reporting.full_scale import error_over_population, fewer_snapshots, pad_map
from rom.reporting.network_verdict import network_tables, network_verdict
from rom.reporting.results import Results

PAGES = {"static-point-forces": "all-combinations", "harmonic-point-force": "whole-grid"}
"""Folders, by scene."""


def study(name: str) -> Callable[..., xr.Dataset]:
    """What runs for a scene's page."""
    def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
        """Where do networks and their opponents err over the whole published population?"""
        scene: Any = scene_of(name, quick=quick)
        results = compared(scene, quick=quick, progress=progress)
        _, cases, seed = asked(scene, None, None, quick, None)
        truth = find_truth(scene, cases, scene.extent.beyond(cases), seed, progress)
        return results.merge(full_scale(Contenders.of(results, scene, truth, quick), progress),
                             combine_attrs="override")

    return main


def draw(results: xr.Dataset) -> list[Figure]:
    """Figures, as far as there are networks."""
    found = Results(results)
    return [figure for make in (error_over_population, pad_map, fewer_snapshots) if (figure := make(found)) is not None]


def findings(results: xr.Dataset) -> list[str]:
    """Who wins against whom, and at what price."""
    return list(network_verdict(Results(results))) or [
        "No weights that were trained on the whole population come with the toolkit for this mesh."]


def tables(results: xr.Dataset) -> list[str]:
    """Errors over the population and its parts."""
    return list(network_tables(Results(results)))


if __name__ == "__main__":
    for scene_name, folder in PAGES.items():
        script.run(study(scene_name), draw, findings, folder, tables=tables)
