"""What a comparison judges by: solved cases on disk, of which only what is asked for is read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.datasets import SPLITS, make_dataset, read_dataset, select, solve_dataset
from rom.datasets.schema import SPLIT_FLAGS
from rom.datasets.snapshots import recipe_for
from rom.datasets.splits import split_variables
from rom.datasets.storage import open_netcdf
from rom.scenes import Scene

VALIDATION = 1_000_003
"""Added to the seed from which validation cases are drawn."""
DRAWN = 8
"""Cases drawn for each validation case, where most of a counted population may have been learned from."""


class Truth:
    """A dataset on disk of which only what is asked for is read.

    Parameters
    ----------
    path : Path
    seed : int
        What it was drawn from; what learns with a seed starts from the same.
    """

    def __init__(self, path: Path, seed: int) -> None:
        self.path, self.key, self.seed = path, path.stem, seed
        self._training: dict[str, xr.Dataset] = {}

    @cached_property
    def index(self) -> xr.Dataset:
        """The dataset without its fields: inputs, splits, what is recorded of the answers."""
        with open_netcdf(self.path) as data:
            small = {"case", "force", "position"}
            return data.drop_vars([name for name, one in data.data_vars.items() if not set(one.dims) <= small]).load()

    def training(self, split: str) -> xr.Dataset:
        """Training cases of a split, kept until another split or :meth:`forget`, so that methods share one POD."""
        if split not in self._training:
            self.forget()
            self._training[split] = read_dataset(self.path, select(self.index, split, "train"))
        return self._training[split]

    def forget(self) -> None:
        """Let the training cases go."""
        self._training.clear()

    def snapshot_seconds(self, split: str) -> float:
        """What the training cases of a split cost to solve [s]."""
        return float(self.index["solve_seconds"].values[select(self.index, split, "train")].sum())

    @cached_property
    def held_out(self) -> np.ndarray:
        """Positions of the cases that any split holds out."""
        return np.unique(np.concatenate([select(self.index, split, "test") for split in SPLITS]))

    def counts(self, part: str) -> dict[str, int]:
        """Number of cases that are ``part`` (train or test) of each split."""
        return {split: len(select(self.index, split, part)) for split in SPLITS}


def find_truth(scene: Scene, cases: int, beyond: int, seed: int, progress: Callable, workers: int | None = 1) -> Truth:
    """The truth of a scene from the cache, made if it is not there.

    Parameters
    ----------
    scene : Scene
    cases, beyond : int
        Within and beyond the ranges.
    seed : int
    progress : callable
        ``progress(items, title)`` shows a bar.
    workers : int, optional
        See :func:`rom.datasets.make_dataset`.
    """
    path = make_dataset(scene, cases, truth_path(scene, cases, beyond, seed), beyond=beyond, seed=seed, compress=True,
                        workers=workers, progress=lambda items: progress(items, "solving"))
    return Truth(path, seed)


def truth_path(scene: Scene, cases: int, beyond: int, seed: int) -> Path:
    """Where in the cache a scene's truth lies, or would lie."""
    return cached_path("datasets", recipe_for(scene, cases, beyond, seed))


@dataclass(frozen=True)
class Tests:
    """Solved cases by which fitted methods are judged.

    Parameters
    ----------
    arrays : Cases
    values : ndarray or dict of ndarray
        True answers.
    inputs : xr.Dataset
        What varies, labelled, and why a case is held out.
    number : (n_case,) ndarray of int
        Their positions in the dataset that they come from.
    tested : dict of (n_case,) ndarray of bool
        By split: the cases that it holds out.
    """

    arrays: Any
    values: Any
    inputs: xr.Dataset
    number: np.ndarray
    tested: dict[str, np.ndarray]


def held_out_tests(scene: Scene, truth: Truth) -> Tests:
    """The cases that any split holds out."""
    data = read_dataset(truth.path, truth.held_out)
    return Tests(scene.read(data), scene.values(data), truth.index.isel(case=truth.held_out), truth.held_out,
                 {split: np.isin(truth.held_out, select(truth.index, split, "test")) for split in SPLITS})


def validation_tests(scene: Scene, truth: Truth, count: int, progress: Callable, workers: int | None = 1
                     ) -> Tests | None:
    """Cases of another draw by which settings are picked: neither learned from nor judged; None without any.

    Of a population that is counted, weights that come with the toolkit may have learned every case that the published
    split trains on, so that only what it holds out will do.

    Parameters
    ----------
    count : int
        Cases of each split.
    """
    if count < 1:
        return None
    seed = truth.seed + VALIDATION
    counted = scene.n_published is not None
    n_within = count * DRAWN if counted else count
    arrays = scene.sample(min(n_within, scene.n_published // 2) if counted else n_within, seed)  # type: ignore[operator]
    n_within = len(arrays)
    arrays = arrays.joined(scene.sample_beyond(max(1, count // 4), seed))
    flags = {name: values for name, (_, values, _) in split_variables(scene, arrays, n_within, truth.seed).items()}
    within = np.arange(len(arrays)) < n_within
    tested = {SPLITS[0]: within, SPLITS[1]: flags["hard_region"] > 0}
    if counted:
        drawn = scene.published_number(arrays.take(within))
        known = scene.published_number(scene.read(truth.index.isel(case=np.flatnonzero(
            truth.index["split_published"].values != SPLIT_FLAGS["unused"]))))
        tested[SPLITS[0]] = within & (flags["split_published"] == SPLIT_FLAGS["test"])
        for mask in tested.values():
            mask[:n_within] &= ~np.isin(drawn, known)
    tested = {split: mask & (np.cumsum(mask) <= count) for split, mask in tested.items()}  # the first are enough
    rows = np.flatnonzero(np.any(list(tested.values()), axis=0))
    if not len(rows):
        return None
    path = solve_dataset(scene, arrays.take(rows), compress=True, workers=workers,
                         progress=lambda items: progress(items, "solving validation cases"))
    data = read_dataset(path)
    return Tests(scene.read(data), scene.values(data), scene.cases_from(arrays.take(rows)), rows,
                 {split: mask[rows] for split, mask in tested.items()})


def take(values: Any, rows: Any) -> Any:
    """Rows of plain answers, an array or a dict of arrays."""
    return {name: array[rows] for name, array in values.items()} if isinstance(values, dict) else values[rows]
