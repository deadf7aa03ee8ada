"""Batches of random cases for `rom.solve`: is the tolerance met, and how far is its choice from the fastest?

Part of the experiment `certificate`. Each batch starts from a scene that has nothing at hand, as a first call does;
what the alternatives take is measured in the same way, each on a scene of its own.
"""

from __future__ import annotations

import time

import numpy as np
import script
import xarray as xr

import rom
from rom.comparison.errors import energy_errors
from rom.fingertip import Fingertip
from rom.metamodels.validity import check_tolerance
from rom.scenes import CaseArrays, Scene, get_scene
from rom.solving import options

BATCHES = {False: (("static-point-forces", 2), ("static-point-forces", 400), ("harmonic-point-force", 1),
                   ("harmonic-point-force", 24), ("harmonic-point-force", 400)),
           True: (("static-point-forces", 2), ("static-point-forces", 40), ("harmonic-point-force", 2),
                  ("harmonic-point-force", 40))}
"""Scene and number of cases of the batches whose alternatives are timed; quick or not."""
LOADS = 16
"""Loads that a batch draws from."""
POINTS = 12
"""Operating points of a large batch, so that truths stay affordable."""


def measure_choice(tip: Fingertip, quick: bool, progress: script.Progress, seed: int) -> xr.Dataset:
    """Tolerances and errors of all cases; seconds of the choice and of the fastest way, by batch."""
    rng = np.random.default_rng([seed, 5])
    error, tolerance, chosen, fastest, ratio_name = [], [], [], [], []
    for name, count in progress(list(BATCHES[quick]), "rom.solve: choice"):
        cases = _cases(get_scene(name, tip), count, rng)
        wanted = 10.0 ** rng.uniform(-8, -1)
        scene = get_scene(name, tip)
        tip.stiffness, scene.harmonic and tip.mass, scene.unit_loads  # noqa: B018 - matrices are there for all alike
        seconds = {}
        start = time.perf_counter()
        answer = rom.solve(scene, scene.cases_from(cases), wanted)
        seconds[answer.attrs["method"]] = time.perf_counter() - start
        truth = scene.solve(cases)[0]["displacement"]
        error.append(_errors(scene, scene.values(answer), truth))
        tolerance.append(np.full(count, wanted))
        ranked = options(get_scene(name, tip), cases, wanted)
        for option in ranked:
            if option.method in seconds or option.cost > 12 * ranked[0].cost:
                continue
            other = get_scene(name, tip)
            start = time.perf_counter()
            made = next(o for o in options(other, cases, wanted) if o.method == option.method).make()
            if made is not None:
                made.predict(other.cases_from(cases), wanted)
                seconds[option.method] = time.perf_counter() - start
        chosen.append(seconds[answer.attrs["method"]])
        fastest.append(min(seconds.values()))
        ratio_name.append(f"{name}, {count} cases")
    more_error, more_tolerance = _many(tip, quick, progress, rng)
    unit = {"units": "1"}
    return xr.Dataset({
        "solve_error": ("solved_case", np.concatenate(error + more_error), {
            "long_name": "true relative energy error of rom.solve", **unit}),
        "solve_tolerance": ("solved_case", np.concatenate(tolerance + more_tolerance), {
            "long_name": "tolerance asked for", **unit}),
        "chosen_seconds": ("solved_batch", chosen, {"long_name": "the method that rom.solve chose", "units": "s"}),
        "fastest_seconds": ("solved_batch", fastest, {
            "long_name": "the fastest that met the tolerance", "units": "s"})},
        coords={"solved_batch": ratio_name})


def _many(tip: Fingertip, quick: bool, progress: script.Progress, rng: np.random.Generator
          ) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Errors and tolerances of many batches on scenes that keep their factor and modes."""
    error, tolerance = [], []
    scenes = [get_scene(name, tip) for name in ("static-point-forces", "harmonic-point-force")]
    batches = 8 if quick else 40
    for i in progress(list(range(batches)), "rom.solve: tolerances"):
        scene = scenes[i % 2]
        cases = _cases(scene, 20 if quick else 106, rng, points=2)
        truth = scene.solve(cases)[0]["displacement"]
        wanted = check_tolerance(10.0 ** rng.uniform(-8, -1))
        answer = rom.solve(scene, scene.cases_from(cases), wanted)
        error.append(_errors(scene, scene.values(answer), truth))
        tolerance.append(np.full(len(cases), wanted))
    return error, tolerance


def _cases(scene: Scene, count: int, rng: np.random.Generator, points: int = POINTS) -> CaseArrays:
    """Random loads; in harmonic scenes a few operating points that they share."""
    forces = int(rng.integers(1, 4))
    pool = rng.choice(scene.n_loads, min(LOADS, scene.n_loads), replace=False)
    node = np.stack([rng.choice(pool, forces, replace=False) for _ in range(count)])
    force = rng.uniform(0.05, 1.0, node.shape)
    if not scene.harmonic:
        return CaseArrays(node, force)
    point = rng.integers(min(points, count), size=count)
    return CaseArrays(node, force, rng.uniform(1, 300, points)[point], rng.uniform(0.1, 0.5, points)[point])


def _errors(scene: Scene, values: np.ndarray, truth: np.ndarray) -> np.ndarray:
    stiffness = scene.model.stiffness
    return energy_errors(values, truth, stiffness) / energy_errors(truth, 0.0, stiffness)
