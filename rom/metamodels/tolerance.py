"""Answers within a tolerance: what a method cannot show to meet it is answered by the next better one.

The chain is the method itself; in harmonic scenes `modal-krylov` with as many vectors as the tolerance asks for, made
for the loads in question alone; at last `direct`. Modes and factors are the scene's, made once.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rom.errors import SolverError
from rom.metamodels.direct import DirectOnDemand
from rom.metamodels.metamodel import Metamodel
from rom.metamodels.modal import Modal, ModalKrylov
from rom.metamodels.some_loads import KrylovOfSomeLoads, vectors_for
from rom.metamodels.validity import Assessment, joined
from rom.scenes import CaseArrays


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
    values, found = model._answer(cases)
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
        kept = model.kept_modes() if isinstance(model, Modal) else None
        for modes in [None] if kept is None else [kept, None]:  # the method's own, else the scene's
            count = vectors_for(scene, missed, tolerance, modes)
            if count is not None:
                if isinstance(model, ModalKrylov) and modes is kept:  # what the forecast says was not enough
                    count = max(count, model.n_vectors + 3)
                yield KrylovOfSomeLoads.of(scene, missed, count, modes)
                break
    yield DirectOnDemand(scene).fit()


def _as_far_as_solvable(model: Metamodel, cases: CaseArrays) -> tuple[np.ndarray, Assessment]:
    """The model's answers; of infinite error where it has none, as at an undamped resonance."""
    try:
        return model._answer(cases)
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
