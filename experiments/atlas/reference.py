"""Truth for the atlas: the same matrices solved to more digits than any method under judgement has."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rom.errors import RomError, SolverError
from rom.fullorder import SecondOrderModel, condition_estimate, factorize, refined_solution
from rom.scenes import CaseArrays, LinearScene

TRUSTED = 1e-10
"""Estimated relative error above which a refined solution tells nothing apart."""

HARDLY = 0.1
"""Relative residual of a trial solve up to which a factor is refined with: its corrections still shrink tenfold."""


@dataclass(frozen=True)
class Truth:
    """What one case's answers are held against.

    displacement : (n,) ndarray [m] or None
        None where no solution could be had to enough digits.
    size : float
        What errors are divided by [J^1/2]: the answer's energy norm, or the sum of the single answers' norms.
    condition : float
        Estimate of the matrix' condition number in the 1-norm.
    message : str
        Why there is no displacement, else "".
    """

    displacement: np.ndarray | None
    own_size: float
    size: float
    condition: float
    message: str = ""


def true_answer(model: SecondOrderModel, scene: LinearScene, case: CaseArrays, cancels: bool = False) -> Truth:
    """Truth of one case.

    Parameters
    ----------
    model : SecondOrderModel
        Whose matrices decide.
    scene : LinearScene
        Whose loads these are.
    case : CaseArrays
        One case.
    cancels : bool
        Whether the case's forces nearly cancel: then the single answers' energy norms are summed, as the relative
        error of a difference measures the cancellation and not the method.
    """
    point = (float(case.frequency[0]), float(case.loss_factor[0])) if scene.harmonic else None
    unit = np.stack([scene.unit_loads[:, node] for node in case.node[0]], axis=1)
    try:
        force = unit @ case.force[0]
        u, condition = refined(model, force, point)
        singles = [u]
        if cancels:
            singles = [refined(model, column * one, point)[0]
                       for column, one in zip(unit.T, case.force[0], strict=True) if one != 0]
    except RomError as error:
        return Truth(None, math.nan, math.nan, math.inf, str(error))
    return Truth(u, energy_norm(model, u), sum(energy_norm(model, one) for one in singles), condition)


def refined(model: SecondOrderModel, force: np.ndarray, point: tuple[float, float] | None) -> tuple[np.ndarray, float]:
    """Solution by iterative refinement in twice the working precision, and the condition number's estimate.

    Parameters
    ----------
    model : SecondOrderModel
    force : (n,) ndarray [N]
    point : (float, float), optional
        Frequency [Hz] and loss factor; None for statics.

    Raises
    ------
    SolverError
        Where the matrix is singular or refinement does not converge.
    """
    # a factor of its own, good enough to refine with: what a method's earlier case left behind must not decide
    if point is None:
        matrix = model.stiffness
        factor = factorize(matrix, backend=model.backend, singular=HARDLY)
        u, error = refined_solution(matrix, force, factor)
        condition = condition_estimate(matrix, factor)
    else:
        dynamic = model.dynamic_stiffness.harmonic(*point)
        factor = factorize(dynamic, backend=model.backend, singular=HARDLY)
        omega = 2 * math.pi * point[0]
        u, error = refined_solution([(1 + 1j * point[1], model.stiffness), (-(omega**2), model.mass)], force, factor)
        condition = condition_estimate(dynamic, factor)
    if not float(error) <= TRUSTED:
        raise SolverError(f"the reference is known to {float(error):.1e} only: the matrix is singular to working "
                          "precision")
    return u, condition


def energy_norm(model: SecondOrderModel, displacement: np.ndarray) -> float:
    """``sqrt(u^H K u)`` [J^1/2] of one field."""
    u = np.asarray(displacement, dtype=np.complex128)
    largest = float(np.max(np.abs(u), initial=0.0))
    if not 0 < largest < math.inf:
        return 0.0 if largest == 0 else math.nan
    u = u / largest  # squares of tiny or huge answers would leave the range of a double
    energy = sum(float(part @ (model.stiffness @ part)) for part in (u.real, u.imag))
    return largest * math.sqrt(max(energy, 0.0))
