"""Is any bound broken? Small random models, every method that bounds its error, truth in ball arithmetic.

The truth of each case is the solution of its exact equation in python-flint's balls, which enclose every rounding of
their own; both for the load as the exact sum of its forces and as summed in double precision. A bound is broken where
the enclosure of the error lies above it. Models are drawn from seeds (:mod:`analysis.small_models`), so that any
violation is found again with ``--first SEED --models 1``.
"""

from __future__ import annotations

import argparse
import collections
import multiprocessing
import sys
import time
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as sla
from analysis.small_models import SmallModel, draw, draw_cases
from flint import acb, acb_mat, arb, arb_mat, ctx

from rom.errors import RomError
from rom.metamodels import create
from rom.metamodels.residual_bound import residual_bound
from rom.scenes import CaseArrays, LinearScene

BITS = 500
"""Of the balls: condition numbers up to 1e60, squares and cancellation leave more digits than any bound has."""
CASES = 5
"""Of each model at rest, and vibrating."""


class Verdict(NamedTuple):
    """One case, one method.

    Parameters
    ----------
    seed : int
    kind, method : str
    case : int
    error, bound : float
        Least relative error that the truth allows, and the claim.
    """

    seed: int
    kind: str
    method: str
    case: int
    error: float
    bound: float

    @property
    def broken(self) -> bool:
        """Whether the error exceeds the claim for certain."""
        return bool(self.error > self.bound)


class Truth:
    """Exact answers of one model, as balls."""

    def __init__(self, model: SmallModel) -> None:
        ctx.prec = BITS
        self.model = model
        self.stiffness, self.mass = (_balls(matrix) for matrix in (model.stiffness, model.mass))
        self.elastic = arb_mat(len(model.stiffness), len(model.stiffness), model.stiffness.ravel().tolist())

    def answers(self, cases: CaseArrays, i: int) -> list[acb_mat] | None:
        """Answers of case i to the exact load and to its rounded sum; None where the matrix may be singular."""
        loads = self.model.loads[:, cases.node[i]]
        exact = _balls(loads) * acb_mat([[_ball(force)] for force in cases.force[i]])
        rounded = _balls((loads @ cases.force[i])[:, None])
        matrix = self.stiffness
        if cases.frequency is not None:
            omega = 2.0 * np.pi * cases.frequency[i]
            matrix = matrix * acb(1.0, float(cases.loss_factor[i])) - self.mass * acb(float(omega * omega))
        try:
            return [matrix.solve(force) for force in (exact, rounded)]
        except ZeroDivisionError:
            return None

    def energy(self, field: acb_mat) -> arb:
        """e^H K e."""
        entries = field.entries()
        parts = (arb_mat(len(entries), 1, [one.real for one in entries]),
                 arb_mat(len(entries), 1, [one.imag for one in entries]))
        return sum((part.transpose() * (self.elastic * part))[0, 0] for part in parts)

    def least_errors(self, truths: list[acb_mat], value: np.ndarray) -> tuple[float, float]:
        """Smallest possible energy norm of an answer's error, absolute and relative: the larger of both loads."""
        absolute, share = [], []
        for truth in truths:
            miss, size = self.energy(_balls(value[:, None]) - truth), self.energy(truth)
            absolute.append(_least(miss))
            share.append(0.0 if miss == 0 else _least(miss / size) if size > 0 else np.nan)
        return float(np.sqrt(max(absolute))), float(np.sqrt(np.nanmax([*share, 0.0])))


def _ball(number: complex) -> acb:
    return acb(float(np.real(number)), float(np.imag(number)))


def _balls(matrix: np.ndarray) -> acb_mat:
    return acb_mat(matrix.shape[0], matrix.shape[1], [_ball(number) for number in matrix.ravel()])


def _least(ball: arb) -> float:
    found = float(ball.lower())
    return found if np.isfinite(found) and found > 0 else 0.0


def methods(scene: LinearScene, rng: np.random.Generator, cases: CaseArrays) -> Iterator[tuple[str, dict[str, Any]]]:
    """Methods with settings, as small models allow."""
    n = scene.n_free
    some = {"loads": np.unique(cases.node).tolist()} if rng.random() < 0.3 else {}
    if not scene.harmonic:
        yield "superposition", {**some}
        yield "superposition", {"precision": "float32", **some}
        return
    modes = int(rng.integers(1, n + 1)) if rng.random() < 0.7 else max(1, n // 4)
    precision = {"precision": "float32"} if rng.random() < 0.3 else {}
    yield "modal", {"modes": modes, **precision, **some}
    yield "modal-static", {"modes": modes, **precision, **some}
    yield "modal-krylov", {"modes": modes, "vectors": int(rng.integers(1, 7)), **precision, **some}


def check(seed: int, largest: int = 40, count: int = CASES) -> tuple[list[Verdict], collections.Counter]:
    """All verdicts on one model and ``count`` cases of each kind, and what was refused."""
    model, rng = draw(seed, largest), np.random.default_rng([seed, 16])
    truth, found, refused = Truth(model), [], collections.Counter()
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        for harmonic in (False, True):
            eigenvalue = sla.eigh(*_scaled(model), eigvals_only=True) if harmonic else None
            cases = draw_cases(model, count, eigenvalue)
            exact = [truth.answers(cases, i) for i in range(count)]
            scene = model.scene(harmonic)
            claims = [*_of_methods(scene, cases, rng, refused), *_of_any_answer(scene, cases, exact, rng, refused)]
            for name, values, bound, relative in claims:
                for i in range(count):
                    if exact[i] is not None and np.isfinite(values[i]).all():
                        miss, share = truth.least_errors(exact[i], values[i])
                        found.append(Verdict(seed, model.kind, name, i, share, float(relative[i])))
                        if bound is not None:
                            found.append(Verdict(seed, model.kind, f"{name}, absolute", i, miss, float(bound[i])))
    return found, refused


def _scaled(model: SmallModel) -> tuple[np.ndarray, np.ndarray]:
    root = np.sqrt(model.mass.diagonal())
    return model.stiffness / np.outer(root, root), model.mass / np.outer(root, root)


def _of_methods(scene: LinearScene, cases: CaseArrays, rng: np.random.Generator, refused: collections.Counter
                ) -> Iterator[tuple[str, np.ndarray, np.ndarray | None, np.ndarray]]:
    for name, settings in methods(scene, rng, cases):
        try:
            method = create(name, scene, **settings).fit()
            values = method.evaluate(cases)
            yield (" ".join([name, settings.get("precision", "")]).strip(), values, method.error_bound(cases),
                   method.assess(cases).error)
        except RomError as error:
            refused[f"{name}: {str(error)[:60]}"] += 1


def _of_any_answer(scene: LinearScene, cases: CaseArrays, exact: list, rng: np.random.Generator,
                   refused: collections.Counter) -> Iterator[tuple[str, np.ndarray, None, np.ndarray]]:
    """The truth as rounded, spoilt a little, much, in single precision; another case's answer; nothing."""
    values = np.zeros((len(cases), scene.n_free), dtype=scene.dtype)
    for i, truths in enumerate(exact):
        if truths is not None:
            column = [complex(value) for value in truths[0].entries()]
            values[i] = column if scene.harmonic else np.real(column)
    noise = rng.standard_normal(values.shape) * np.abs(values).max(axis=1, keepdims=True)
    spoilt = {"rounded": values, "noisy": values + 10.0 ** rng.uniform(-16, 0) * noise, "scaled": values * (
        1.0 + 10.0 ** rng.uniform(-16, 0)), "other": values[::-1], "nothing": np.zeros_like(values)}
    if np.abs(values[values != 0]).min(initial=1.0) > 1e-30 and np.abs(values).max(initial=0.0) < 1e30:
        spoilt["single"] = values.astype(np.complex64 if scene.harmonic else np.float32).astype(values.dtype)
    for name, answer in spoilt.items():
        try:
            yield f"residual, {name}", answer, None, residual_bound(scene).bound(cases, answer)
        except RomError as error:
            refused[f"residual: {str(error)[:60]}"] += 1


def survey(first: int, count: int, workers: int) -> Iterator[tuple[list[Verdict], collections.Counter]]:
    """Verdicts of models ``first`` to ``first + count - 1``, in parallel."""
    if workers == 1:
        yield from map(check, range(first, first + count))
        return
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        yield from pool.imap_unordered(check, range(first, first + count), chunksize=8)


def main() -> int:
    """Check and print; 1 where a bound is broken."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first model")
    parser.add_argument("--workers", type=int, default=multiprocessing.cpu_count())
    arguments = parser.parse_args()
    start, checked, broken = time.perf_counter(), 0, []
    refused: collections.Counter = collections.Counter()
    tightness: dict[str, list[float]] = collections.defaultdict(list)
    for done, (verdicts, reasons) in enumerate(survey(arguments.first, arguments.models, arguments.workers), 1):
        refused.update(reasons)
        checked += len(verdicts)
        for one in verdicts:
            tightness[one.method].append(one.bound / one.error if one.error > 0 else np.nan)
            if one.broken:
                broken.append(one)
                print(f"BROKEN  seed {one.seed} ({one.kind}), {one.method}, case {one.case}: "
                      f"error {one.error:.3e} above {one.bound:.3e}", flush=True)
        if done % 500 == 0:
            print(f"{done:,} models, {checked:,} bounds, {len(broken)} broken, "
                  f"{time.perf_counter() - start:.0f} s", flush=True)
    print(f"{arguments.models:,} models, {checked:,} bounds, {len(broken)} broken")
    for method, ratios in sorted(tightness.items()):
        finite = np.array(ratios)[np.isfinite(ratios)]
        print(f"  {method}: {len(ratios):,} bounds, {np.mean(np.isinf(ratios)) * 100:.0f} % infinite, bound over error "
              f"median {np.median(finite) if len(finite) else np.nan:.3g}")
    for reason, count in refused.most_common(12):
        print(f"  refused {count:,}: {reason}")
    return int(bool(broken))


if __name__ == "__main__":
    sys.exit(main())
