"""How much data and time does a network need?

Every network that comes with trained weights is trained here where its file is missing: the whole published grid of
harmonic cases, made by a verified ROM, for `mlp`, `mlp-residual` and `pole-network`; random combinations of static
forces for `transformer`. Then learning curves: the same networks from fewer cases, judged on every held-out case.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import script
import xarray as xr
from full_scale.network_errors import network_errors
from full_scale.static import additive_errors
from train_networks_figures import draw, findings, tables

from rom.cache import cached_path
from rom.datasets import make_dataset, unit_responses
from rom.datasets.combinations import held_out_combinations
from rom.datasets.reduced import ReducedField, open_dataset
from rom.datasets.schema import SPLIT_FLAGS
from rom.datasets.whole import find_whole
from rom.metamodels import load
from rom.metamodels.networks.sizes import weights_path
from rom.metamodels.networks.weights import train_network
from rom.provenance import source_digest
from rom.scenes import Scene, get_scene
from rom.scenes.extent import Extent

SEED = Extent().seed
"""Of the comparison's splits: what is learned from is the same as there."""
HARMONIC = ("mlp", "mlp-residual", "pole-network")
WEIGHTS = [*((m, size, "published") for m in HARMONIC for size in ("small", "medium", "large")),
           *((m, "large", "hard") for m in HARMONIC),
           ("transformer", "large", "published"), ("transformer", "large", "hard")]
SIZE = {"mlp": "small", "mlp-residual": "large", "pole-network": "large", "transformer": "large"}
CURVES: dict[str, dict[str, Any]] = {"mlp": {"steps": 60}, "mlp-residual": {}, "pole-network": {}, "transformer": {}}
"""Of the learning curves: sizes, and steps where all of them would take too long."""
COUNTS = (1_000, 16_000, 516_240)
STATIC_COUNTS = (60, 360, 1_911)
STATIC_CASES = 2_390
"""Ten a node, training and held-out together."""
QUICK: dict[str, dict[str, Any]] = {
    "mlp": {"rank": 20, "terms": 6, "width": 8, "steps": 2}, "mlp-residual": {"modes": 8, "rank": 12, "steps": 2},
    "pole-network": {"rank": 20, "poles": 6, "steps": 2}, "transformer": {"width": 16, "heads": 2, "steps": 20}}
QUICK_COUNTS, QUICK_STATIC = (300, 1_500), (30, 90)
MOST_LOOKS = 700
READS = 200


def main(quick: bool = False, progress: script.Progress = script.silent) -> xr.Dataset:
    """How much data and time does a network need to answer for the finite elements?"""
    tip = script.fingertip(quick)
    harmonic, static = get_scene("harmonic-point-force", tip), get_scene("static-point-forces", tip)
    grid = find_whole(harmonic, beyond=True, seed=SEED, progress=lambda items: progress(items, "whole grid"))
    cases = find_static(static, 120 if quick else STATIC_CASES, progress)
    if not quick:
        train_missing_weights(grid, cases, progress)
    field = ReducedField(grid)
    held_out = np.flatnonzero(field.data["split_published"].values == SPLIT_FLAGS["test"])
    counts, static_counts = (QUICK_COUNTS, QUICK_STATIC) if quick else (COUNTS, STATIC_COUNTS)
    names = [*HARMONIC, "transformer"]
    found = np.full((3, len(names), len(counts)), np.nan)
    look = np.full((3, len(names), MOST_LOOKS), np.nan)
    learned = np.zeros((len(names), len(counts)), dtype=int)
    responses = unit_responses(static)
    combinations = held_out_combinations(static, SEED)
    rows = [(i, k) for i in range(len(names)) for k in range(len(counts))]
    for i, k in progress(rows, "learning curves"):
        method = names[i]
        alone = method == "transformer"
        count = (static_counts if alone else counts)[k]
        scene, data = (static, cases) if alone else (harmonic, grid)
        model = find_network(method, scene, data, count, QUICK[method] if quick else CURVES[method])
        error = (additive_errors(model, combinations, responses) if alone
                 else network_errors(model, field, held_out))
        found[:, i, k] = error.max(), np.median(error), model.offline_seconds
        learned[i, k] = count
        history = model.history
        n = min(MOST_LOOKS, len(history.step))
        look[:, i, :n] = [history.seconds[:n], history.train[:n], history.validation[:n]]
    one = {"units": "1"}
    return xr.Dataset({
        "cases": (("method", "count"), learned, {"long_name": "training cases", **one}),
        "error_max": (("method", "count"), found[0], {"long_name": "largest relative error, held-out cases", **one}),
        "error_median": (("method", "count"), found[1], {"long_name": "median relative error, held-out cases", **one}),
        "seconds": (("method", "count"), found[2], {"long_name": "training, one thread", "units": "s"}),
        "look_seconds": (("method", "look"), look[0], {"long_name": "since training began, all cases", "units": "s"}),
        "look_train": (("method", "look"), look[1], {"long_name": "training error, root mean square", **one}),
        "look_validation": (("method", "look"), look[2], {"long_name": "validation error, root mean square", **one}),
        "held_out": ("method", [len(combinations) if m == "transformer" else len(held_out) for m in names],
                     {"long_name": "held-out cases", **one}),
        "grid_seconds": ((), float(field.data.attrs["offline_seconds"]), {
            "long_name": "making and checking the whole harmonic grid", "units": "s"}),
        "grid_residual": ((), float(field.data.attrs["residual_max"]), {
            "long_name": "largest residual of any case of the grid", **one}),
        "grid_confirmed": ((), float(field.data.attrs["confirmed_error_max"]), {
            "long_name": "largest error against direct solves", **one}),
        "grid_read_seconds": ("read", read_seconds(grid), {"long_name": "reading one case back", "units": "s"}),
        "grid_bytes": ((), Path(grid).stat().st_size, {"long_name": "size of the grid's file", "units": "byte"}),
    }, coords={"method": names}, attrs={
        "mesh": script.spoken(tip), "sizes": json.dumps(SIZE), "settings": json.dumps(CURVES), "n_cases": len(field),
        "n_confirmed": field.data.sizes["confirmed"], "seed": SEED})


def read_seconds(grid: Path) -> np.ndarray:
    """(n,) ndarray [s]: one random case after another, read as a whole field on all nodes."""
    with open_dataset(grid, chunks=None) as data:
        cases = np.random.default_rng(0).integers(data.sizes["case"], size=READS)
        seconds = np.empty(READS)
        for k, case in enumerate(cases.tolist()):
            start = time.perf_counter()
            _ = data["displacement"][case].values
            seconds[k] = time.perf_counter() - start
    return seconds


def find_static(scene: Scene, count: int, progress: script.Progress) -> Path:
    """Labelled static cases, made if they are not in the cache."""
    return make_dataset(scene, count, seed=SEED, progress=lambda items: progress(items, "static cases"))


def train_missing_weights(grid: Path, static: Path, progress: script.Progress) -> None:
    """Train what lies not in ``data/weights``; a killed training goes on."""
    for method, size, split in WEIGHTS:
        path = weights_path(method, size, split)
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            title = f"{method} {size} {split}"
            train_network(method, static if method == "transformer" else grid, path, size=size, split=split,
                          progress=lambda steps, title=title: progress(steps, title))


def find_network(method: str, scene: Scene, data: Path, count: int, settings: dict[str, Any]) -> Any:
    """A network trained from so many cases, found again in the cache."""
    path = cached_path("models", {
        "curve": method, "size": SIZE[method], "settings": settings, "cases": count, "content": scene.content_hash,
        "seed": SEED, "source": source_digest("rom.metamodels.networks.weights")}, ".safetensors")
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        train_network(method, data, path, size=SIZE[method], cases=count, settings=settings)
    return load(path, scene)


if __name__ == "__main__":
    script.run(main, draw, findings, "networks", tables=tables)
