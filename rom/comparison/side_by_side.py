"""Every metamodel of a scene on the same held-out cases: error, time, offline cost, in one dataset of results."""

from __future__ import annotations

import datetime
import json
import logging
from collections.abc import Callable, Iterable
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rom.cache import cached_path
from rom.checks import shown
from rom.comparison.entries import (
    Entry,
    chosen_curves,
    entries_of,
    every_method_has_a_headline,
    fitted,
    offline,
    settings_digest,
)
from rom.comparison.floor import mesh_floor
from rom.comparison.held_out import error_variables, judge
from rom.comparison.times import measure_times, time_variables
from rom.comparison.timing import threads_in_use
from rom.comparison.truth import Tests, Truth, find_truth, held_out_tests, validation_tests
from rom.comparison.worst import worst_variables
from rom.datasets import SPLITS
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.errors import SchemaError
from rom.fingertip import Fingertip
from rom.metamodels import applicable, method_names
from rom.metamodels.registry import metamodel_classes
from rom.provenance import machine, source_digest, stamp, versions
from rom.scenes import Scene, get_scene, quick_scene

log = logging.getLogger(__name__)

COMPARED = ("static-point-forces", "harmonic-point-force", "finger-on-glass")
"""The scenes that `rom report` goes through; others have experiments of their own."""
ROUNDS, QUICK_ROUNDS = 15, 5
"""Timed rounds."""
REMADE_SECONDS = 30.0
"""A truth that takes less to solve is not kept in the cache."""
Progress = Callable[[Iterable, str], Iterable]


def no_progress(items: Iterable, _: str) -> Iterable:
    """Show nothing."""
    return items


def compare(scene: Scene | str, *, methods: list[str] | None = None, cases: int | None = None, quick: bool = False,
            seed: int | None = None, fingertip: Fingertip | None = None, workers: int | None = 1,
            progress: Progress = no_progress) -> xr.Dataset:
    """Fit, predict and time every method of a scene.

    Parameters
    ----------
    scene : Scene or str
        A scene, or the name of one that comes with the toolkit.
    methods : list of str, optional
        Default: all that apply; those that solve the full-order model always join, as the baseline.
    cases : int, optional
        Cases within the published ranges, training and held-out together; default: the scene's own number.
    quick : bool
        A coarse mesh, where the scene is given by its name, and few cases: a check that everything runs, not a result.
    seed : int, optional
        Decides cases, splits and what learns with a seed; default: the scene's own.
    fingertip : Fingertip, optional
        Of a scene given by its name; default: the `metamodel` preset.
    workers : int, optional
        Processes that solve the truth; None takes one a core, which asks a script for ``if __name__ == "__main__"``.
    progress : callable
        ``progress(items, title)`` shows a bar.

    Returns
    -------
    xr.Dataset
        See the README for its dimensions and variables.

    Raises
    ------
    ValueError
        For an unknown scene or method, one that does not apply to the scene, or too few cases.
    """
    scene = scene_of(scene, fingertip, quick)
    curves, cases, seed = asked(scene, methods, cases, quick, seed)
    truth = find_truth(scene, cases, scene.extent.beyond(cases), seed, progress, workers)
    tests = held_out_tests(scene, truth)
    validation = validation_tests(scene, truth, min(scene.extent.validation, cases // 4), progress, workers)
    timing = _Timing(scene, tests, quick, progress)
    entries, omitted = measured(scene, truth, curves, tests, validation, timing, progress)
    variables = {**error_variables(entries, scene, tests), **time_variables(entries, scene), **mesh_floor(scene, tests)}
    results = xr.Dataset(variables, coords={
        "entry": [entry.label for entry in entries], "method": ("entry", [entry.method for entry in entries]),
        "setting": ("entry", [entry.setting for entry in entries]),
        "headline": ("entry", [entry.headline for entry in entries]),
        "snapshot_source": ("entry", [entry.facts["snapshot_source"] for entry in entries]),
        "split": list(SPLITS), "region": list(scene.regions), **_case_coordinates(scene, tests)})
    if scene.harmonic:
        results["natural_frequency"] = ("natural_mode", natural_frequencies(scene), {
            "long_name": "natural frequency", "units": "Hz"})
    results = results.merge(worst_variables(entries, scene))
    results.attrs = {**_attributes(scene, curves, truth, omitted), "seed": seed, "quick": int(quick),
                     **stamp(created=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"))}
    if float(truth.index["solve_seconds"].sum()) < REMADE_SECONDS:
        truth.path.unlink(missing_ok=True)
    return results


def compared(scene: Scene | str, *, methods: list[str] | None = None, cases: int | None = None, quick: bool = False,
             seed: int | None = None, fingertip: Fingertip | None = None, workers: int | None = 1,
             progress: Progress = no_progress) -> xr.Dataset:
    """What :func:`compare` measured earlier on this machine with the same sources and inputs, or measures now."""
    scene = scene_of(scene, fingertip, quick)
    curves, cases, seed = asked(scene, methods, cases, quick, seed)
    kinds = [kind for name in curves for kind in metamodel_classes(name)]
    path = cached_path("results", {
        "scene": scene.to_json(), "content": scene.content_hash, "curves": settings_digest(curves), "cases": cases,
        "seed": seed, "quick": quick, "machine": machine(), "threads": threads_in_use(), "versions": versions(),
        "source": source_digest(__name__, *sorted({kind.__module__ for kind in kinds}), type(scene).__module__)})
    if path.exists():
        try:
            return read_netcdf(path)
        except SchemaError as error:
            log.warning("a cached comparison is made again: %s", error)
    results = compare(scene, methods=methods, cases=cases, quick=quick, seed=seed, workers=workers, progress=progress)
    write_netcdf(results, path, compress=True)
    return results


def scene_of(scene: Scene | str, fingertip: Fingertip | None = None, quick: bool = False) -> Scene:
    """The scene itself, or the one of that name; ValueError where it is neither."""
    if isinstance(scene, Scene):
        if fingertip is not None:
            raise ValueError(f"{scene.name} has a body of its own: leave the fingertip out")
        return scene
    return quick_scene(scene) if quick and fingertip is None else get_scene(scene, fingertip)


def asked(scene: Scene, methods: list[str] | None, cases: int | None, quick: bool, seed: int | None
           ) -> tuple[dict, int, int]:
    """Curves, number of cases and seed, checked."""
    extent = scene.extent
    curves = chosen_curves(scene, methods, quick)
    if cases is None:
        cases = extent.quick_cases if quick else extent.cases
    if cases < extent.least_cases:
        raise ValueError(f"{shown(cases)} {scene.case_noun}s are too few to learn from and to hold out: ask for "
                         f"{extent.least_cases} or more")
    return curves, cases, extent.seed if seed is None else seed


class _Timing:
    """Times entries on the held-out cases of the first split, the same for every method."""

    def __init__(self, scene: Scene, tests: Tests, quick: bool, progress: Progress) -> None:
        self.scene, self.progress = scene, progress
        self.arrays = tests.arrays.take(tests.tested[SPLITS[0]])
        self.rounds = QUICK_ROUNDS if quick else ROUNDS
        self.batch = scene.extent.quick_batch if quick else scene.extent.batch

    def __call__(self, entries: list[Entry], title: str) -> None:
        if entries:
            measure_times(entries, self.scene, self.arrays, self.rounds, self.batch,
                          lambda items: self.progress(items, title))


def measured(scene: Scene, truth: Truth, curves: dict, tests: Tests, validation: Tests | None, timing: Callable,
             progress: Progress) -> tuple[list[Entry], list[str]]:
    """Every entry fitted, judged and timed; models are let go as soon as they are not needed.

    The entries that speak for their methods are timed together at last, other settings of a method with one another.

    Returns
    -------
    entries : list of Entry
    omitted : list of str
        What cannot be fitted to these data, each with the reason.
    """
    entries: list[Entry] = []
    omitted: list[str] = []
    first, *later = SPLITS
    rows = progress(entries_of(scene, curves), "fitting and judging")

    def begin(entry: Entry) -> bool:
        """Fit an entry to the first split and judge it; whether it could be fitted."""
        entry.model = _fitted(entry, scene, truth, first, omitted)
        if entry.model is not None:
            entry.facts |= offline(entry, scene, truth)
            for split in SPLITS if not entry.kind.learns else (first,):
                judge(entry, entry.model, split, scene, tests, validation)
        return entry.model is not None

    for kind, group in groupby(rows, lambda entry: entry.kind):
        done = [entry for entry in group if begin(entry)]
        # where the data are too few for any of its settings, a method's defaults may do
        if not done and {} not in curves[kind.name].settings:
            done = [entry for entry in [Entry(kind, {}, True)] if begin(entry)]
        every_method_has_a_headline(done)
        timing([entry for entry in done if not entry.headline], f"timing {kind.name}")
        for entry in done:
            entry.model = entry.model if entry.headline else None
        entries += done
    for split in later:
        for entry in progress([entry for entry in entries if entry.kind.learns], f"{split} split"):
            model = _fitted(entry, scene, truth, split, omitted)
            if model is not None:
                judge(entry, model, split, scene, tests, validation)
    truth.forget()
    timing([entry for entry in entries if entry.headline], "timing")
    return entries, omitted


def _fitted(entry: Entry, scene: Scene, truth: Truth, split: str, omitted: list[str]) -> Any:
    try:
        return fitted(entry, scene, truth, split)
    except SchemaError:  # a damaged truth is no reason to leave a method out
        raise
    except ValueError as error:  # a rank that few quick cases do not span, say
        text = f"{entry.label}{'' if split == SPLITS[0] else f' ({split} split)'}: {error}"
        log.warning("left out: %s", text)
        omitted.append(text)
        return None


def natural_frequencies(scene: Any) -> np.ndarray:
    """Natural frequencies within a linear scene's band [Hz]."""
    return scene.model.natural_modes(below_hz=scene.band_hz).frequency_hz


def _case_coordinates(scene: Scene, tests: Tests) -> dict[str, Any]:
    found: dict[str, Any] = {"case": tests.number}
    for name in (*(one.name for one in scene.inputs), "hard_region", *(f"split_{split}" for split in SPLITS)):
        if name in tests.inputs:
            found[name] = tests.inputs[name].variable
            words = next((one.choices for one in scene.inputs if one.name == name), ())
            if words and found[name].dtype.kind in "iu":
                found[name] = (found[name].dims, np.array(words)[found[name].values], {
                    "long_name": found[name].attrs["long_name"]})
    found |= {str(name): one.variable for name, one in tests.inputs.coords.items() if one.dims == ("position",)}
    return found | ({"quantity": list(scene.error_definitions)} if scene.error_definitions else {})


def _attributes(scene: Scene, curves: dict, truth: Truth, omitted: list[str]) -> dict:
    reasons = applicable(scene)
    kinds = {name: metamodel_classes(name)[0] for name in method_names()}
    mine = {name: next(kind for kind in metamodel_classes(name) if kind.why_not(scene) is None) for name in curves}
    found = {
        "scene": scene.name, "title": scene.title, "question": scene.question, "gate": scene.gate,
        "case_noun": scene.case_noun, "partial_output": scene.part_words if scene.part else "",
        "error_definition": scene.error_definition, "quantity_definitions": json.dumps(scene.error_definitions),
        "scene_needs": json.dumps(scene.needs), "scene_leaves_out": json.dumps(scene.leaves_out),
        "method_summaries": json.dumps({name: kind.summary for name, kind in mine.items()}),
        "method_colours": json.dumps({name: kind.colour for name, kind in kinds.items()}),
        "full_order": json.dumps([name for name, kind in mine.items() if kind.full_order]),
        "learners": json.dumps([name for name, kind in mine.items() if kind.learns]),
        "not_applicable": json.dumps({name: reason for name, reason in reasons.items() if reason is not None}),
        "omitted": json.dumps(omitted), "machine": machine(), "threads": threads_in_use(), "backend": scene.solver,
        "n_free": scene.n_free, "n_train": json.dumps(truth.counts("train")),
        "n_test": json.dumps(truth.counts("test")),
        "scene_parameters": scene.to_json(), "scene_hash": scene.content_hash, "mesh_hash": scene.mesh_hash}
    if scene.grid is not None:
        found["n_nodes"] = scene.grid.n_node
    if "residual" in truth.index:
        found["residual_max"] = float(truth.index["residual"].max())
    if "reached" in truth.index:
        found["n_ended"] = int((~truth.index["reached"].values.astype(bool).all(axis=1)).sum())
    return found


def write_results(results: xr.Dataset, folder: str | Path) -> Path:
    """Write ``results.nc`` into a folder and return its path."""
    path = Path(folder) / "results.nc"
    write_netcdf(results, path, compress=True)
    return path
