"""Answer cases to a tolerance by the method that costs least.

What each method would cost is counted before anything is built, in units of one static solve on the scene's mesh:
factorizations, solves, modes, vectors. The units' worth was measured once (:data:`COST`) and varies little with the
mesh, since all of them grow with the factor. What the scene has at hand, a factor of K or modes, is free.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from rom.metamodels.direct import DirectOnDemand
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.residual_bound import MODES, residual_bound
from rom.metamodels.some_loads import KrylovOfSomeLoads, SuperpositionOfSomeLoads, vectors_for
from rom.metamodels.tolerance import answer_within
from rom.metamodels.validity import check_tolerance
from rom.scenes import CaseArrays, LinearScene

__all__ = ["answer_within", "options", "solve"]

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
               lambda: SuperpositionOfSomeLoads.of(scene, cases))]


def _harmonic_options(scene: LinearScene, cases: CaseArrays, tolerance: float) -> list[Option]:
    n_case, n_load, n_point = len(cases), len(np.unique(cases.node)), len(scene.groups(cases))
    bound = residual_bound(scene)
    at_hand = "modes" in bound.__dict__
    vectors = vectors_for(scene, cases, tolerance) if at_hand else TYPICAL_VECTORS
    direct = Option("direct-reused", n_point * COST["complex factor"] + n_case * COST["complex column"],
                    f"{n_point} factorizations, one for each frequency and loss factor",
                    lambda: DirectOnDemand(scene).fit())
    if vectors is None:  # beyond the modes
        return [direct]

    def krylov() -> Metamodel | None:
        count = vectors_for(scene, cases, tolerance)
        return None if count is None else KrylovOfSomeLoads.of(scene, cases, count)

    cost = n_load * (vectors + 1) * COST["vector"] + MODES + n_case * COST["answer"]
    cost += 0.0 if at_hand else COST["modes"]
    cost += 0.0 if scene.model.has_static_factorization else COST["static factor"]
    return [direct, Option(
        "modal-krylov", cost,
        f"{MODES} modes{' at hand' if at_hand else ''} and {vectors} vectors for each of {n_load} loads serve all "
        f"{n_point} frequencies and loss factors", krylov)]


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
