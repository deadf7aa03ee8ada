"""Choosing among the methods: answers to a tolerance by the one that costs least, and the next better one where it
misses.

What each method would cost is counted before anything is built, in units of one static solve on the scene's mesh:
factorizations, solves, modes, vectors. The units' worth was measured once (:data:`COST`) and varies little with the
mesh, since all of them grow with the factor. What the scene has at hand, a factor of K or modes, is free.

What a method cannot show to meet a tolerance is answered by the next better one: in harmonic scenes `modal-krylov`
with as many vectors as the tolerance asks for, made for the loads in question alone; at last `direct`. How many
vectors a tolerance takes is known beforehand. Galerkin on p Krylov vectors of K^-1 M, deflated of m modes, finds u as
well as any polynomial of degree p - 1 does on the spectrum [0, 1 / lambda_(m+1)], and Chebyshev's reach

    error <= C rho^-p,    rho = |z + sqrt(z^2 - 1)|,    z = 2 (1 + i eta) lambda_(m+1) / omega^2 - 1

(Saad, Iterative Methods for Sparse Linear Systems, section 6.11). That is a forecast; the certificate then decides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from rom.errors import SolverError
from rom.metamodels.direct import DirectOnDemand
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.modal import ModalKrylov
from rom.metamodels.modal_method import MeasuredModes, ModalMethod
from rom.metamodels.residual_bound import MODES, residual_bound
from rom.metamodels.superposition import Superposition
from rom.metamodels.validity import Assessment, check_tolerance, joined
from rom.scenes import CaseArrays, LinearScene

COST = {
    "static factor": 275.0,
    "static column": 6.0,
    "complex factor": 500.0,
    "complex column": 17.0,
    "modes": 1750.0,
    "vector": 3.0,
    "answer": 0.3,
}
"""In units of one static solve among many (4.6 ms), measured on the `metamodel` preset, 20,520 degrees of freedom, one
thread: factorizations; a column with its residual in extended precision and the solve that tells its error; 40 modes
with their Sturm count; one load-dependent vector of one load; an answer of `modal-krylov` or `superposition`."""
TYPICAL_VECTORS = 8
"""Vectors a load assumed where modes that would tell are not there yet."""
MOST_VECTORS = 24
"""More would cost more than direct solves, and a band that needs them asks for more modes."""


@dataclass(frozen=True)
class Option:
    """One way to answer.

    Parameters
    ----------
    method : str
    cost : float
        In static solves.
    why : str
        What the cost is made of.
    make : callable
        Builds it, fitted; None where it cannot meet the tolerance after all.
    """

    method: str
    cost: float
    why: str
    make: Callable[[], Metamodel | None]


def options(scene: LinearScene, cases: CaseArrays, tolerance: float) -> list[Option]:
    """The ways to answer, cheapest first.

    Parameters
    ----------
    scene : LinearScene
    cases : CaseArrays
    tolerance : float
    """
    found = _harmonic_options(scene, cases, tolerance) if scene.harmonic else _static_options(scene, cases)
    return sorted(found, key=lambda option: option.cost)


def _static_options(scene: LinearScene, cases: CaseArrays) -> list[Option]:
    n_case, n_load = len(cases), len(np.unique(cases.node))
    factor = 0.0 if scene.model.has_static_factorization else COST["static factor"]
    return [
        Option("direct-reused", factor + n_case * COST["static column"],
               f"one factor and a solve for each of {n_case} cases", lambda: DirectOnDemand(scene).fit()),
        Option("superposition", factor + n_load * COST["static column"] + n_case * COST["answer"],
               f"one factor and a solve for each of {n_load} loads, which {n_case} cases share",
               lambda: Superposition(scene, loads=np.unique(cases.node)).fit())]


def _harmonic_options(scene: LinearScene, cases: CaseArrays, tolerance: float) -> list[Option]:
    n_case, n_load, n_point = len(cases), len(np.unique(cases.node)), len(scene.groups(cases))
    at_hand = residual_bound(scene).has_modes
    vectors = vectors_for(scene, cases, tolerance) if at_hand else TYPICAL_VECTORS
    direct = Option("direct-reused", n_point * COST["complex factor"] + n_case * COST["complex column"],
                    f"{n_point} factorizations, one for each frequency and loss factor",
                    lambda: DirectOnDemand(scene).fit())
    if vectors is None:  # beyond the modes
        return [direct]

    def krylov() -> Metamodel | None:
        count = vectors_for(scene, cases, tolerance)
        return None if count is None else krylov_for(scene, cases, count)

    cost = n_load * (vectors + 1) * COST["vector"] + MODES + n_case * COST["answer"]
    cost += 0.0 if at_hand else COST["modes"]
    cost += 0.0 if scene.model.has_static_factorization else COST["static factor"]
    return [direct, Option(
        "modal-krylov", cost,
        f"{MODES} modes{' at hand' if at_hand else ''} and {vectors} vectors for each of {n_load} loads serve all "
        f"{n_point} frequencies and loss factors", krylov)]


def vectors_for(scene: LinearScene, cases: CaseArrays, tolerance: float, measured: MeasuredModes | None = None
                ) -> int | None:
    """Forecast of the number of vectors a load with which `modal-krylov` meets a tolerance.

    Parameters
    ----------
    scene : LinearScene
    cases : CaseArrays
    tolerance : float
    measured : MeasuredModes, optional
        Default: the scene's own, which are then computed.

    Returns
    -------
    int or None
        None where too many would be needed, as beyond the modes.
    """
    if not len(cases):
        return None
    bound = (measured.split if measured else residual_bound(scene).split).next_bound
    inertia = (2.0 * np.pi * cases.frequency) ** 2
    moving = inertia > 0
    if not moving.any() or math.isinf(bound):
        return 1
    z = 2.0 * (1.0 + 1j * cases.loss_factor[moving]) * bound / inertia[moving] - 1.0
    root = np.sqrt(z * z - 1.0)
    rate = np.maximum(np.abs(z + root), np.abs(z - root)).min()
    if rate < 1.5:
        return None
    count = math.ceil(math.log(2.0 / tolerance) / math.log(rate)) + 1
    return count if count <= MOST_VECTORS else None


def krylov_for(scene: LinearScene, cases: CaseArrays, vectors: int,
               measured: MeasuredModes | None = None) -> ModalKrylov:
    """`modal-krylov` for the loads that cases name, fitted on modes that are there (default: the scene's own)."""
    if measured is None:
        bound = residual_bound(scene)
        measured = MeasuredModes(bound.modes, bound.split)
    loads = np.unique(cases.node)
    return ModalKrylov(scene, measured.modes.count, vectors, loads=loads).fit_on(measured)


def solve(scene: LinearScene, cases: xr.Dataset, tolerance: float = 1e-6) -> xr.Dataset:
    """Answer labelled cases to a tolerance by the method that costs least.

    Parameters
    ----------
    scene : LinearScene
        Keeps the factor and the modes that are made, for the next call.
    cases : xr.Dataset
        See `Metamodel.predict`.
    tolerance : float
        Largest relative error in the energy norm.

    Returns
    -------
    xr.Dataset
        As `Metamodel.predict` returns it with a tolerance; its attributes ``method`` and ``why`` say what was chosen.

    Raises
    ------
    ValueError, SolverError
        As `Metamodel.predict`.

    Warns
    -----
    ValidityWarning
        Where no method met the tolerance.
    """
    tolerance = check_tolerance(tolerance)
    arrays = scene.read(cases)
    ranked = options(scene, arrays, tolerance)
    # direct solves are always possible
    model, chosen = next((model, option) for option in ranked if (model := option.make()) is not None)
    answer = model.predict(cases, tolerance)
    others = ", ".join(f"{other.method} {other.cost:.0f}" for other in ranked if other is not chosen)
    answer.attrs["why"] = (f"{chosen.method}: {chosen.why}; about {chosen.cost:.0f} static solves"
                           + (f" ({others})" if others else ""))
    return answer


def answer_within(model: Metamodel, cases: CaseArrays, tolerance: float
                  ) -> tuple[np.ndarray, Assessment, np.ndarray, np.ndarray]:
    """Answers of which each is shown to meet a tolerance, as far as any method can.

    Parameters
    ----------
    model : Metamodel
        Fitted; it answers first.
    cases : CaseArrays
    tolerance : float
        Of the relative error in the energy norm.

    Returns
    -------
    values : (n_case, n_output) ndarray [m]
    assessment : Assessment
        Its kind is that of the first case.
    kind : (n_case,) ndarray of str
    answered_by : (n_case,) ndarray of str
    """
    values, found = _first(model, cases, tolerance)
    # the precision that stored bases were cast to does not limit the better methods
    values = values.astype(model.scene.dtype, copy=False)
    error, reason = found.error.copy(), found.reason.astype(object)
    kind = np.full(len(cases), found.kind, dtype=object)
    answered_by = np.full(len(cases), model.name, dtype=object)
    # a bound that meets the tolerance is worth more than the range it was learned in
    reason[error <= tolerance] = ""
    for better in _chain(model, cases, tolerance, error):
        rows = np.flatnonzero(~(error <= tolerance))
        if not len(rows):
            break
        better_values, judged = _as_far_as_solvable(better, cases.take(rows))
        closer = judged.error < error[rows]
        taken = rows[closer]
        values[taken], error[taken], kind[taken] = better_values[closer], judged.error[closer], judged.kind
        reason[taken], answered_by[taken] = judged.reason[closer], better.name
        reason[error <= tolerance] = ""
    text = np.where(~(error <= tolerance), f"no method met the tolerance {tolerance:g}", "")
    return (values, Assessment(error, found.kind, joined(reason.astype(str), text)), kind.astype(str),
            answered_by.astype(str))


def _first(model: Metamodel, cases: CaseArrays, tolerance: float) -> tuple[np.ndarray, Assessment]:
    """The method's own answers, judged by their residuals where it knows nothing of its error without."""
    values, found = model.answer(cases)
    if found.kind != "none":
        return values, found
    if model.scene.outputs != "field":
        field = model.evaluate(cases, "field")
        return values, model.assess(cases, field)
    return values, model.assess(cases, values)


def _chain(model: Metamodel, cases: CaseArrays, tolerance: float, error: np.ndarray) -> Iterator[Metamodel]:
    """The better methods, one after another, each made when it is asked for."""
    scene = model.scene
    if model.name in ("direct", "direct-reused"):
        return
    if scene.harmonic:
        missed = cases.take(~(error <= tolerance))
        kept = model.measured_modes() if isinstance(model, ModalMethod) else None
        for measured in [None] if kept is None else [kept, None]:  # the method's own, else the scene's
            count = vectors_for(scene, missed, tolerance, measured)
            if count is not None:
                if isinstance(model, ModalKrylov) and measured is kept:  # what the forecast says was not enough
                    count = max(count, model.n_vectors + 3)
                yield krylov_for(scene, missed, count, measured)
                break
    yield DirectOnDemand(scene).fit()


def _as_far_as_solvable(model: Metamodel, cases: CaseArrays) -> tuple[np.ndarray, Assessment]:
    """The model's answers; of infinite error where it has none, as at an undamped resonance."""
    try:
        return model.answer(cases)
    except SolverError:
        if len(cases) == 1:
            width = model.scene.n_outputs(model.scene.outputs)
            return np.full((1, width), np.nan, dtype=model.scene.dtype), Assessment.unknown(np.array(["singular"]))
    parts = [_as_far_as_solvable(model, cases.take(slice(i, i + 1))) for i in range(len(cases))]
    found = [judged for _, judged in parts]
    kind = next((judged.kind for judged in found if judged.kind != "none"), "none")
    return (np.concatenate([values for values, _ in parts]),
            Assessment(np.concatenate([judged.error for judged in found]), kind,
                       np.concatenate([judged.reason for judged in found])))
