"""How fitted entries answer the held-out cases: errors, bounds over errors, the worst case."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rom.comparison.entries import Entry
from rom.comparison.errors import energy_errors, largest, of_cases, statistics
from rom.comparison.truth import Tests, take
from rom.comparison.worst import worst_case
from rom.datasets import SPLITS
from rom.metamodels import Metamodel
from rom.scenes import Scene

BOUNDED_CASES = 64
"""Held-out cases, about, on which the bound of a method without a certificate of its own is measured."""
VISIBLE = 1e-9
"""Relative energy error above which an error is not the truth's own rounding."""

STATISTICS = {"max": "largest", "p95": "95 % quantile of the", "median": "median"}


@dataclass
class Judged:
    """Errors of one entry; NaN where it was not judged. Shapes begin with (split, case)."""

    case_error: np.ndarray
    position_error: np.ndarray | None = None
    further: np.ndarray | None = None
    """(split, case, quantity) ndarray: errors that are told beside."""
    projection: np.ndarray = field(default_factory=lambda: np.full(len(SPLITS), np.nan))
    validation: np.ndarray = field(default_factory=lambda: np.full(len(SPLITS), np.nan))
    evaluated: np.ndarray = field(default_factory=lambda: np.full(len(SPLITS), -1))
    effectivity: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    """Least, median and largest bound over true energy error."""
    worst: dict[str, Any] = field(default_factory=dict)


def judge(entry: Entry, model: Metamodel, split: str, scene: Scene, tests: Tests, validation: Tests | None) -> None:
    """Measure a fitted model on the cases that a split holds out; ``entry.facts["judged"]`` takes it in.

    Full-order methods and others that take long answer one case in ``kind.slow``, every other method all of them.
    """
    if "judged" not in entry.facts:
        entry.facts["judged"] = Judged(np.full((len(SPLITS), len(tests.number)), np.nan))
    found: Judged = entry.facts["judged"]
    j = SPLITS.index(split)
    rows = _rows(entry, scene, tests, split)
    arrays, values = tests.arrays.take(rows), take(tests.values, rows)
    answers = model.evaluate(arrays, "field")
    state, *further = scene.errors(arrays, answers, values).values()
    found.case_error[j, rows] = of_cases(state)
    if state.ndim > 1:
        found.position_error = _put(found.position_error, (*found.case_error.shape, *state.shape[1:]), j, rows, state)
    if further:
        found.further = _put(found.further, (*found.case_error.shape, len(further)), j, rows,
                             np.stack([of_cases(one) for one in further], axis=-1))
    found.evaluated[j] = int((~np.isnan(found.case_error[j, rows])).sum())
    found.projection[j] = _projection_error(model, scene, arrays, values)
    if validation is not None and not entry.kind.full_order:
        found.validation[j] = _validation_error(entry, model, split, scene, validation)
    if j == 0:
        if scene.has_residual and entry.kind.slow == 1:
            found.effectivity = _effectivity(model, scene, values, answers, arrays)
        found.worst = worst_case(model, scene, tests, rows, state)


def _rows(entry: Entry, scene: Scene, tests: Tests, split: str) -> np.ndarray:
    """Positions among the tests of the cases that an entry answers."""
    rows = np.flatnonzero(tests.tested[split])
    return rows[scene.thinned(tests.number[rows], entry.kind.slow)]


def _put(array: np.ndarray | None, shape: tuple[int, ...], split: int, rows: np.ndarray, values: np.ndarray
         ) -> np.ndarray:
    array = np.full(shape, np.nan) if array is None else array
    array[split, rows] = values
    return array


def _largest_error(scene: Scene, arrays: Any, answers: Any, truth: Any) -> float:
    return float(largest(next(iter(scene.errors(arrays, answers, truth).values()))))


def _projection_error(model: Metamodel, scene: Scene, arrays: Any, truth: Any) -> float:
    """Largest error of the best that the method's own basis could answer; NaN where it has none."""
    several = isinstance(truth, dict)
    judged = truth[scene.quantity] if several else truth
    best = model.best_approximation(arrays, judged)
    if best is None:
        return np.nan
    return _largest_error(scene, arrays, *(({scene.quantity: one} if several else one) for one in (best, judged)))


def _validation_error(entry: Entry, model: Metamodel, split: str, scene: Scene, tests: Tests) -> float:
    rows = _rows(entry, scene, tests, split)
    arrays = tests.arrays.take(rows)
    if not len(rows):
        return np.nan
    return _largest_error(scene, arrays, model.evaluate(arrays, "field"), take(tests.values, rows))


def _effectivity(model: Any, scene: Any, values: np.ndarray, answers: np.ndarray, arrays: Any
                 ) -> tuple[float, float, float]:
    """Bound over true energy error of the cases whose error stands out from rounding; NaN where none is bounded."""
    certified = hasattr(model, "error_bound")
    # the bound of all others takes a static solve a case
    rows = slice(None) if certified else slice(None, None, max(1, len(arrays) // BOUNDED_CASES))
    stiffness, true = scene.model.stiffness, values[rows]
    made, size = (energy_errors(other, true, stiffness) for other in (answers[rows], np.zeros_like(true)))
    visible = made > VISIBLE * size
    if not visible.any():
        return np.nan, np.nan, np.nan
    block = arrays.take(rows)
    bound = model.error_bound(block) if certified else size * model.assess(block, answers[rows]).error
    ratio = bound[visible] / made[visible]
    return float(ratio.min()), float(np.median(ratio)), float(ratio.max())


def error_variables(entries: list[Entry], scene: Scene, tests: Tests) -> dict[str, tuple]:
    """Variables of the results."""
    found: list[Judged] = [entry.facts["judged"] for entry in entries]
    noun, one = scene.case_noun, {"units": "1"}
    of_case = f"of a held-out {noun}" if found[0].position_error is None else f"along a held-out {noun}"
    case = np.stack([one.case_error for one in found])
    stats = np.array([[statistics(errors) for errors in entry] for entry in case])
    region = tests.inputs["hard_region"].values
    by_region = np.stack([largest(case[:, -1, region == k + 1], axis=-1) for k in range(len(scene.regions))], axis=-1)
    filled = np.where(np.isnan(case), -1.0, case)
    worst = np.where(filled.max(axis=-1) < 0, -1, tests.number[filled.argmax(axis=-1)])
    variables = {
        **{f"error_{name}": (("entry", "split"), stats[..., k], {
            "long_name": f"{text} relative error over held-out {noun}s", **one})
            for k, (name, text) in enumerate(STATISTICS.items())},
        "error_by_region": (("entry", "region"), by_region, {
            "long_name": "largest relative error in a part of the hard split", **one}),
        "case_error": (("entry", "split", "case"), case, {"long_name": f"relative error {of_case}", **one}),
        "worst_case": (("entry", "split"), worst, {"long_name": f"{noun} of the largest error", **one}),
        "n_evaluated": (("entry", "split"), np.stack([one.evaluated for one in found]), {
            "long_name": f"held-out {noun}s that were evaluated", **one}),
        "projection_error_max": (("entry", "split"), np.stack([one.projection for one in found]), {
            "long_name": "largest relative error of the best approximation in the method's own basis", **one}),
        **_validation_variables(found, noun)}
    if scene.has_residual:
        effectivity = np.array([one.effectivity for one in found])
        variables |= {f"effectivity_{name}": ("entry", effectivity[:, k], {
            "long_name": f"{name} of bound over true energy error", **one})
            for k, name in enumerate(("min", "median", "max"))}
    if found[0].position_error is not None:
        variables["position_error"] = (("entry", "split", "case", "position"), np.stack(
            [one.position_error for one in found]), {"long_name": "relative error at a position", **one})  # type: ignore[misc]
    if found[0].further is not None:
        variables |= _further_variables(np.stack([one.further for one in found]), noun)  # type: ignore[misc]
    return variables


def _validation_variables(found: list[Judged], noun: str) -> dict[str, tuple]:
    errors = np.stack([one.validation for one in found])
    return {} if np.isnan(errors).all() else {"validation_error_max": (("entry", "split"), errors, {
        "long_name": f"largest relative error over {noun}s neither learned from nor judged", "units": "1"})}


def _further_variables(errors: np.ndarray, noun: str) -> dict[str, tuple]:
    middle = np.full(errors.shape[:2] + errors.shape[3:], np.nan)
    for i, j in np.ndindex(*errors.shape[:2]):
        known = errors[i, j][~np.isnan(errors[i, j]).all(axis=1)]
        if len(known):
            middle[i, j] = np.median(known, axis=0)
    one = {"units": "1"}
    return {
        "contact_case_error": (("entry", "split", "case", "quantity"), errors, {
            "long_name": f"largest error of a further quantity in a {noun}", **one}),
        "contact_error_max": (("entry", "split", "quantity"), largest(errors, axis=2), {
            "long_name": f"largest error of a further quantity over held-out {noun}s", **one}),
        "contact_error_median": (("entry", "split", "quantity"), middle, {
            "long_name": f"median over {noun}s of the largest error", **one})}
