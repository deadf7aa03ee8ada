"""A method under examination, and the assertions that its promises share."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rom.datasets import make_dataset, read_dataset
from rom.metamodels import Metamodel
from rom.relative import relative_errors
from rom.scenes import Cases, LinearScene, Scene

TRAINING = 80
"""Cases that a method learns from where none are given."""
SINGLE, DOUBLE = 1e-4, 1e-9
"""What another order of the same operations may change of an answer's norm: a thousand units of single precision; in
double the unit roundoff times the condition of a stiffness, about 1e6. Iterations along load paths reach the first."""


class Subject:
    """A method under examination, and what several promises ask of it."""

    def __init__(self, model: Metamodel, train: xr.Dataset | None, cases: Cases | None, rounding: float | None,
                 folder: Path) -> None:
        self.kind, self.scene, self.settings = type(model), model.scene, copy.deepcopy(model.settings)
        self.linear = isinstance(self.scene, LinearScene)
        self.folder, self._train, self._cases, self._rounding = folder, train, cases, rounding

    def fresh(self, **changed: Any) -> Metamodel:
        return self.kind(self.scene, **{**copy.deepcopy(self.settings), **changed})

    def fit(self, model: Metamodel, data: xr.Dataset | None = None) -> Metamodel:
        return model.fit((self.train if data is None else data) if self.kind.learns else None)

    @cached_property
    def train(self) -> xr.Dataset:
        if self._train is not None:
            return self._train
        return read_dataset(make_dataset(self.scene, TRAINING, self.folder / "training.nc"))

    @cached_property
    def fitted(self) -> Metamodel:
        return self.fit(self.fresh())

    @cached_property
    def cases(self) -> Any:
        if self._cases is not None:
            return self._cases
        if not self.linear:
            return self.scene.sample(3, 9)
        return self.scene.sample(4, 9).joined(self.scene.sample_beyond(2, 9))

    @cached_property
    def labelled(self) -> xr.Dataset:
        cases = self.scene.cases_from(self.cases)
        return cases.assign_coords(case=("case", 7 + np.arange(cases.sizes["case"])[::-1], cases["case"].attrs))

    @cached_property
    def answer(self) -> Any:
        return self.fitted.evaluate(self.cases)

    @cached_property
    def saved(self) -> Path:
        path = self.folder / f"saved{self.kind.suffix}"
        self.fitted.save(path)
        return path

    def close(self, found: Any, expected: Any, what: str, rounding: float | None = None) -> None:
        """Assert that answers agree to rounding: an array case by case, several quantities each by its largest."""
        if not isinstance(expected, dict):
            found, expected = {"answer": found}, {"answer": expected}
        require(list(found) == list(expected), f"{what}: quantities {list(found)} instead of {list(expected)}")
        for name, true in expected.items():
            mine = found[name]
            require(mine.shape == true.shape, f"{what}: {name} has shape {mine.shape} instead of {true.shape}")
            single = not self.linear or true.dtype.itemsize < np.result_type(true.dtype, np.float64).itemsize
            limit = (self._rounding or (SINGLE if single else DOUBLE)) if rounding is None else rounding
            if self.linear:
                error = relative_errors(mine, true).max()
            else:
                require(np.array_equal(np.isnan(mine), np.isnan(true)), f"{what}: {name} is NaN elsewhere")
                error = np.nanmax(np.abs(mine - true), initial=0.0) / np.nanmax(np.abs(true), initial=1e-300)
            require(error <= limit, f"{what}: {name} differs by {error:.1e}, above {limit:g}")


def require(condition: Any, message: str) -> None:
    if not condition:
        raise AssertionError(message)


def refused(ask: Callable[[], Any], errors: Any, what: str) -> None:
    """Assert that ``ask()`` raises one of ``errors`` with one sentence."""
    try:
        ask()
    except errors as error:
        text = str(error)
        require(text.strip() and "\n" not in text, f"{what} is refused with {text!r}, not with one sentence")
        return
    raise AssertionError(f"{what} is not refused")


def another(scene: Scene, **facts: Any) -> Scene:
    """The same scene but for some facts of it, such as its digest."""
    other = copy.copy(scene)
    kind = type("Another", (type(scene),), {
        name: property(lambda _, value=value: value) for name, value in facts.items()})
    object.__setattr__(other, "__class__", kind)
    return other
