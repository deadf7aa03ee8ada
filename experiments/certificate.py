"""Do the bounds hold, how tight are they, what do they cost, and does `rom.solve` choose well?

Random loads, frequencies and loss factors, some beyond the scenes' ranges; the truth is a direct solve of each. Cases
share operating points, so that one factorization makes many truths. Networks are left out: they are bounded by the
residual like `pod-galerkin` and `pod-regression`, whatever made the answer.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import script
import xarray as xr
from solve_choice import measure_choice

from rom.comparison.errors import energy_errors
from rom.datasets.schema import dataset_attributes
from rom.metamodels import Metamodel, ValidityWarning, create
from rom.reporting.figure import Figure, sheet
from rom.scenes import CaseArrays, Scene, get_scene

MODELS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "modal, the band": ("harmonic-point-force", "modal", {}),
    "modal-static, 40 modes": ("harmonic-point-force", "modal-static", {"modes": 40}),
    "modal-krylov, 20 modes, 3 vectors": ("harmonic-point-force", "modal-krylov", {"modes": 20, "vectors": 3}),
    "modal-krylov, 40 modes, 4 vectors": ("harmonic-point-force", "modal-krylov", {"modes": 40, "vectors": 4}),
    "pod-galerkin, harmonic": ("harmonic-point-force", "pod-galerkin", {}),
    "pod-regression, harmonic": ("harmonic-point-force", "pod-regression", {"rank": 40}),
    "coarse-fem, harmonic": ("harmonic-point-force", "coarse-fem", {"scale": 0.7}),
    "pod-galerkin, static": ("static-point-forces", "pod-galerkin", {}),
    "superposition in float32": ("static-point-forces", "superposition", {"precision": "float32"})}
FAMILY = ("modal", "modal-static", "modal-krylov")
BY_RESIDUAL = ("pod-galerkin", "pod-regression", "coarse-fem")
SHARE = {"modal": 1.0, "modal-static": 1.0, "modal-krylov": 1.0, "superposition": 1.0, "coarse-fem": 0.05}
"""Share of the cases that a method is measured on; bounds by the residual take a solve each, and get the rest's."""
RESIDUAL_SHARE = 0.3
ROUNDING = 1e-10
"""Relative energy error that the direct truth carries itself."""


def main(quick: bool = False, progress: script.Progress = script.silent, seed: int = 0) -> xr.Dataset:
    """Do the bounds hold, how tight are they, what do they cost, and does the choice of `rom.solve` pay?"""
    tip = script.fingertip(quick)
    count, points = (240, 8) if quick else (2_600, 52)
    found: list[dict[str, np.ndarray]] = []
    for name in ("harmonic-point-force", "static-point-forces"):
        scene = get_scene(name, tip)
        entries = {label: create(method, scene, **settings) for label, (of, method, settings) in MODELS.items()
                   if of == name}
        learn = scene.sample(60 if quick else 400, seed + 1)
        train = scene.label(scene.cases_from(learn), scene.solve(learn)[0]["displacement"])
        train.attrs.update(dataset_attributes(scene))
        for model in progress(list(entries.values()), f"{name}: fits"):
            model.fit(train if model.learns else None)
        total = count if scene.harmonic else count // 4
        blocks = random_blocks(scene, total, points if scene.harmonic else points // 4, seed)
        for block in progress(blocks, f"{name}: cases"):
            truth = scene.solve(block)[0]["displacement"]
            for label, model in entries.items():
                share = SHARE.get(model.name, RESIDUAL_SHARE)
                part = slice(0, max(2, round(share * len(block))))
                found.append({"model": label, **judge(scene, model, block.take(part), truth[part])})
    models = list(MODELS)
    index = np.concatenate([np.full(len(one["bound"]), models.index(str(one["model"]))) for one in found])

    def column(name: str) -> np.ndarray:
        return np.concatenate([one[name] for one in found])

    unit = {"units": "1"}
    results = xr.Dataset({
        "model_index": ("case", index, {"long_name": "which model", **unit}),
        "bound": ("case", column("bound"), {"long_name": "relative bound of the energy error", **unit}),
        "error": ("case", column("error"), {"long_name": "true relative energy error", **unit}),
        "frequency": ("case", column("frequency"), {"long_name": "frequency, 0 in statics", "units": "Hz"}),
        "loss_factor": ("case", column("loss_factor"), {"long_name": "loss factor, 0 in statics", **unit}),
        **_seconds(tip, quick)}, coords={"model": models})
    return results.merge(measure_choice(tip, quick, progress, seed))


def random_blocks(scene: Scene, count: int, points: int, seed: int) -> list[CaseArrays]:
    """Blocks of cases that share an operating point; two in ten points lie beyond the published ranges."""
    rng = np.random.default_rng([seed, 77])
    blocks = []
    for i in range(points):
        n = count // points
        forces = 1 + i % 3
        node = np.stack([rng.choice(scene.n_loads, forces, replace=False) for _ in range(n)])
        force = rng.uniform(0.05, 1.0, node.shape) * rng.choice([-1.0, 1.0], node.shape)
        if not scene.harmonic:
            blocks.append(CaseArrays(node, force))
            continue
        if i % 10 < 8:
            frequency, eta = rng.uniform(1.0, 300.0), rng.uniform(0.1, 0.5)
        else:
            frequency, eta = rng.uniform(1.0, 400.0), rng.choice([0.02, 0.05, 0.6, 1.0])
        blocks.append(CaseArrays(node, force, np.full(n, frequency), np.full(n, float(eta))))
    return blocks


def judge(scene: Scene, model: Metamodel, cases: CaseArrays, truth: np.ndarray) -> dict[str, np.ndarray]:
    """Bound and true relative energy error of a block, one method."""
    values, stiffness = model.evaluate(cases, "field"), scene.model.stiffness
    made = energy_errors(values, truth, stiffness) / energy_errors(truth, 0.0, stiffness)
    nothing = np.zeros(len(cases))
    return {"bound": model.assess(cases, None if model.name == "superposition" else values).error, "error": made,
            "frequency": cases.frequency if scene.harmonic else nothing,
            "loss_factor": cases.loss_factor if scene.harmonic else nothing}


def _seconds(tip, quick: bool) -> dict[str, tuple]:
    """Time of one bound and of one answer, each alone and in a block of 64, interleaved."""
    scene = get_scene("harmonic-point-force", tip)
    model = create("modal-krylov", scene, modes=40, vectors=8).fit()
    out = np.empty((2, 2))
    for i, n in enumerate((1, 64)):
        cases = scene.sample(n, 3)
        taken = [(_time(lambda c=cases: model.evaluate(c)), _time(lambda c=cases: model.relative_bound(c)))
                 for _ in range(20 if quick else 60)]
        out[:, i] = np.median(taken, axis=0) / n
    return {"answer_seconds": ("batch", out[0], {"long_name": "one answer of modal-krylov", "units": "s"}),
            "bound_seconds": ("batch", out[1], {"long_name": "its bound", "units": "s"}),
            "batch": ("batch", [1, 64], {"long_name": "cases at once", "units": "1"})}


def _time(call: Callable[[], Any]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def effectivity(results: xr.Dataset, names: tuple[str, ...]) -> np.ndarray:
    """Bound over error of the cases of some methods whose error stands out from the truth's rounding."""
    rows = [i for i, label in enumerate(results["model"].values) if MODELS[str(label)][1] in names]
    mine = np.isin(results["model_index"], rows) & (results["error"].values > 100 * ROUNDING)
    mine &= np.isfinite(results["bound"].values)
    return (results["bound"].values / np.where(mine, results["error"].values, 1.0))[mine]


def findings(results: xr.Dataset) -> list[str]:
    """Whether the bounds held, how tight they are, what they cost, and what rom.solve did."""
    broken = int((results["error"] > results["bound"] + ROUNDING).sum())
    family, others = effectivity(results, FAMILY), effectivity(results, BY_RESIDUAL)
    share = (results["bound_seconds"] / results["answer_seconds"]).values
    told = [
        f"{'No error exceeds its bound' if not broken else f'{broken} errors exceed their bounds'} in "
        f"{results.sizes['case']:,} answers to random cases.",
        f"Bound over error: median {np.median(family):.2f} in the modal family ({len(family):,} cases, largest "
        f"{family.max():.0f}), median {np.median(others):.2f} where the residual is split by modes ({len(others):,} "
        f"cases, largest {others.max():.1f}).",
        f"The bound of modal-krylov takes {100 * share[0]:.0f} % of the time of a single answer, "
        f"{100 * share[1]:.1f} % in blocks of 64."]
    missed = int((results["solve_error"] > results["solve_tolerance"] + ROUNDING).sum())
    slower = (results["chosen_seconds"] / results["fastest_seconds"]).values
    told.append(
        f"rom.solve met its tolerance in {'all' if not missed else f'all but {missed}'} of "
        f"{results.sizes['solved_case']:,} random cases; its choice took {np.median(slower):.2f} times the fastest "
        f"method that met it in the median, {slower.max():.2f} times at most, over {len(slower)} batches.")
    return told


def draw(results: xr.Dataset) -> list[Figure]:
    """Bound over error: every point on or above the diagonal."""
    figure = sheet(5.6, findings(results)[0], width=8.5)
    axes = figure.subplots()
    colours = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#999999", "#f0e442")
    for i, (name, colour) in enumerate(zip(results["model"].values, colours, strict=True)):
        one = results.isel(case=np.flatnonzero(results["model_index"] == i))
        seen = one.isel(case=np.flatnonzero(one["error"] > 0)[::max(1, one.sizes["case"] // 400)])
        ratio = float((seen["bound"] / seen["error"]).median())
        axes.loglog(seen["error"], seen["bound"], "osd^v<>ph"[i], ms=3, alpha=0.5, color=colour,
                    label=f"{name}: median ratio {ratio:.3g}")
    ends = [float(results["error"].where(results["error"] > 0).min()), float(results["error"].max())]
    axes.loglog(ends, ends, "k-", lw=1, label="bound = error")
    axes.set_xlabel("true relative energy error [-]")
    axes.set_ylabel("bound [-]")
    axes.legend(fontsize=7)
    return [Figure("figure.png", figure, "Each point is a random case; on the line the bound would equal the error.",
                   "Bound over true energy error")]


if __name__ == "__main__":
    warnings.simplefilter("ignore", ValidityWarning)
    script.run(main, draw, findings, "certificate")
