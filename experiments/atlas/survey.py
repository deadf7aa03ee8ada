"""Running the atlas: every method on every level, one small result a level, kept so that a killed run goes on."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from atlas.extremes import AXES, levels
from atlas.judge import (
    CRASHED,
    REFUSED,
    Record,
    Unanswered,
    judge_answer,
    listen,
    tolerance_of,
    worst_of,
)
from atlas.level import SCENES, Level, default_settings
from atlas.reference import energy_norm, true_answer
from atlas.workshop import Workshop
from rom.cache import cached_path
from rom.files import whole_file
from rom.fingertip import Fingertip, MeshDensity
from rom.fullorder import blas_threads
from rom.fullorder import threads as solver_threads
from rom.metamodels.registry import metamodel_classes
from rom.provenance import source_digest, versions

DENSITY = MeshDensity((6, 6), 3, 2, (1, 1, 1, 2))
QUICK_DENSITY = MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))
Progress = Callable[[Iterable, str], Iterable]
NOT_ASKED = ""
"""Outcome where a method does not answer the level's scene, or the level does not concern it."""


def no_progress(items: Iterable, _: str) -> Iterable:
    """Show nothing."""
    return items


def atlas(*, quick: bool = False, axes: Sequence[str] | None = None, methods: Sequence[str] | None = None,
          fingertip: Fingertip | None = None, keep: bool = True, progress: Progress = no_progress) -> xr.Dataset:
    """Ask every method at every extreme and judge what it says.

    Parameters
    ----------
    quick : bool
        A tiny mesh and the ends of each axis: a check, not a result.
    axes, methods : sequence of str, optional
        Default: all.
    fingertip : Fingertip, optional
        From which the levels depart; default: the published anatomy on a small mesh.
    keep : bool
        Whether finished levels are looked up in the cache and left there.

    Returns
    -------
    xr.Dataset
        ``outcome``, ``error``, ``bound``, ``kind``, ``residual``, ``seconds``, ``message``, ``bound_holds``,
        ``tolerance`` (case, method), ``condition_estimate`` (case); a case is a level, with ``axis`` and ``level``.

    Raises
    ------
    ValueError
        For an unknown axis or method.
    """
    known = dict.fromkeys(name for scene in SCENES for name in default_settings(scene))
    chosen, names = _chosen(axes, AXES, "axis"), _chosen(methods, known, "method")
    tip = fingertip or replace(Fingertip.preset("metamodel"), density=QUICK_DENSITY if quick else DENSITY)
    workshop = Workshop(tip)
    asked = [level for level in levels(quick) if level.axis in chosen and any(name in names for name in level.asked)]
    found, previous = [], ""
    for level in progress(asked, "extremes"):
        if level.axis != previous:
            workshop.forget()
            previous = level.axis
        found.append(_kept(workshop, level, names) if keep else judge_level(workshop, level, names))
    return _dataset(asked, found, names, tip)


def judge_level(workshop: Workshop, level: Level, names: Sequence[str]) -> dict[str, Any]:
    """Condition estimate and each asked method's `Record` on one level, as plain dicts."""
    records: dict[str, Record] = {}
    condition = math.nan
    asked = {name: settings for name, settings in level.asked.items() if name in names}
    with ExitStack() as stack:
        stack.enter_context(blas_threads(level.threads))
        stack.enter_context(solver_threads(level.threads))
        try:
            (scene, truth, cases, truths), _, _ = listen(lambda: _prepare(workshop, level))
            condition = max(one.condition for one in truths)
        except Unanswered as failure:  # the fingertip or the cases cannot exist, whatever the method
            record = Record(failure.outcome, message=str(failure))
            return {"condition": condition, "records": {name: asdict(record) for name in asked}}
        for name, settings in asked.items():
            records[name] = _judge_method(workshop, level, name, settings, scene, truth, cases, truths)
    return {"condition": condition, "records": {name: asdict(record) for name, record in records.items()}}


def _prepare(workshop: Workshop, level: Level):
    scene = workshop.scene(level)
    truth = workshop.truth(level, scene)
    block = level.cases(scene)
    cases = [block.take(slice(i, i + 1)) for i in range(len(block))]
    return scene, truth, cases, [true_answer(truth, scene, case, level.cancels) for case in cases]


def _judge_method(workshop, level: Level, name: str, settings, scene, truth, cases, truths) -> Record:
    tolerance = tolerance_of(name, scene) if level.tolerance is None else level.tolerance
    fitted = workshop.fitted(level, scene, name, settings)
    if fitted.failure is not None:
        return Record(fitted.failure.outcome, message=str(fitted.failure), tolerance=tolerance)
    records = []
    for case, true in zip(cases, truths, strict=True):
        try:
            answer, heard, seconds = listen(partial(fitted.model.predict, scene.cases_from(case)))
            assessment = listen(partial(fitted.model.assess, case, scene.values(answer)))[0]
        except Unanswered as failure:
            records.append(Record(failure.outcome, message=str(failure), tolerance=tolerance))
            continue
        heard.said = [*fitted.heard.said, *heard.said]
        values = scene.values(answer)[0]
        residual = _residual(truth, scene, case, values)
        error = relative = math.nan
        if true.displacement is not None:
            miss = energy_norm(truth, values - true.displacement)
            error = _ratio(miss, true.size)
            # of a true answer that is exactly zero no error is relative, and no bound of it can be broken
            relative = _ratio(miss, true.own_size) if true.own_size > 0 else math.nan
        records.append(judge_answer(answer, assessment, heard, seconds, error=error, relative=relative,
                                    residual=residual, tolerance=tolerance))
    return worst_of(records)


def _ratio(miss: float, size: float) -> float:
    if miss == 0:
        return 0.0
    return miss / size if size > 0 else math.inf


def _residual(truth, scene, case, values: np.ndarray) -> float:
    if not np.isfinite(values).all():
        return math.nan
    point = (float(case.frequency[0]), float(case.loss_factor[0])) if scene.harmonic else ()
    with np.errstate(all="ignore"):
        return float(truth.residual(values[:, None], scene.force_vectors(case), *point)[0])


def _kept(workshop: Workshop, level: Level, names: Sequence[str]) -> dict[str, Any]:
    asked = {name: settings for name, settings in level.asked.items() if name in names}
    recipe = {"axis": level.axis, "level": level.name, "methods": asked, "fingertip": workshop.fingertip.to_dict(),
              "source": _sources(tuple(asked)), "versions": versions()}
    path = cached_path("stability", recipe, ".json")
    if path.exists():
        return json.loads(path.read_text(encoding="utf-8"))
    found = judge_level(workshop, level, names)
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(found), encoding="utf-8")
    return found


@cache
def _sources(names: tuple[str, ...]) -> str:
    """Digest of the atlas and of the methods' classes, which are found by name and no import statement tells of."""
    modules = {kind.__module__ for name in names for kind in metamodel_classes(name)}
    return source_digest(*(str(path) for path in Path(__file__).parent.glob("*.py")), *sorted(modules))


def _chosen(wanted: Sequence[str] | None, known: Iterable[str], what: str) -> tuple[str, ...]:
    known = tuple(known)
    for name in wanted or ():
        if name not in known:
            raise ValueError(f"{name!r} is no {what} of the atlas: choose from {', '.join(known)}")
    return known if wanted is None else tuple(name for name in known if name in wanted)


WORDS = {
    "error": ("true relative error in the energy norm", np.nan), "bound": (
        "relative error that the answer itself names", np.nan),
    "assessed": ("relative error that Metamodel.assess names, which may cost more than the answer", np.nan),
    "assessed_kind": ("bound, estimate or none: what stands in assessed", "none"),
    "residual": ("relative residual of the answer", np.nan), "seconds": ("time of the answer", np.nan),
    "tolerance": ("relative error up to which the answer is right", np.nan),
    "outcome": ("right, warned, refused, silent or crashed; empty where not asked", NOT_ASKED),
    "kind": ("bound, estimate or none: what stands in bound", "none"),
    "message": ("what the method said", ""), "bound_holds": ("whether a claimed bound held", True)}


def _dataset(asked: list[Level], found: list[dict[str, Any]], names: Sequence[str], tip: Fingertip) -> xr.Dataset:
    data: dict[str, Any] = {}
    for key, (words, empty) in WORDS.items():
        rows = [[one["records"].get(name, {}).get(key, empty) for name in names] for one in found]
        text = isinstance(empty, str)
        values = np.array(rows, dtype=object if text else None).reshape(len(asked), len(names))
        unit = {} if text else {"units": "s" if key == "seconds" else "1"}
        data[key] = (("case", "method"), values.astype(np.int8) if key == "bound_holds" else values,
                     {"long_name": words, **unit})
    data["condition_estimate"] = ("case", [one["condition"] for one in found], {
        "long_name": "condition number of the matrix in the 1-norm, estimated", "units": "1"})
    columns = {"axis": [level.axis for level in asked], "level": [level.name for level in asked],
               "words": [level.words for level in asked], "scene": [level.scene for level in asked]}
    return xr.Dataset(data, coords={
        "case": np.arange(len(asked)), "method": list(names),
        **{key: ("case", np.array(values, dtype=object)) for key, values in columns.items()},
        "cancels": ("case", np.array([level.cancels for level in asked], dtype=np.int8))},
        attrs={"n_free": len(tip.free_dofs), "n_nodes": tip.mesh.n_nodes, "formulation": tip.formulation,
               "crashed": CRASHED, "refused": REFUSED})
