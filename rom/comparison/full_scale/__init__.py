"""What a few hundred held-out cases cannot show: errors over the whole published population, case by case."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from rom.comparison.entries import Entry, Truth
from rom.scenes import HarmonicPointForce, Scene, StaticPointForces


def full_scale(entries: list[Entry], scene: Scene, truth: Truth, progress: Callable) -> xr.Dataset:
    """Variables of the results that need the whole population; none where no entry has trained weights.

    Parameters
    ----------
    entries : list of Entry
    scene : Scene
    truth : Truth
        Of the comparison; its seed decides which cases are held out.
    progress : callable
        ``progress(items, title)`` shows a bar.
    """
    if not any(entry.trained for entry in entries):
        return xr.Dataset()
    from rom.comparison.full_scale import fewer_snapshots, harmonic, static

    study = {HarmonicPointForce.name: harmonic.study, StaticPointForces.name: static.study}[scene.name]
    learned = [entry.model.learned_from["cases"] if entry.trained else np.nan for entry in entries]
    return study(entries, scene, truth.seed, progress).merge(
        fewer_snapshots.study(entries, scene, truth, progress)).assign(learned_cases=("entry", learned, {
            "long_name": "training cases behind weights that come with the toolkit", "units": "1"}))
