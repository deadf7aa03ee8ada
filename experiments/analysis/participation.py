"""Which modes carry a load: participation, and each mode's share of energy in a static or vibrating answer.

With mass-orthonormal modes phi_k of K phi = lambda M phi, any field splits as u = sum q_k phi_k + r, q_k = phi_k^T M u,
where the residual r is orthogonal to the kept modes both in K and in M. Energies therefore add without cross terms,

    u^H K u = sum lambda_k |q_k|^2 + r^H K r,        u^H M u = sum |q_k|^2 + r^H M r,

and shares of strain and of kinetic energy sum to one. Under K u = f the coordinate is q_k = phi_k^T f / lambda_k, so
that the static share (phi_k^T f)^2 / (lambda_k f^T K^-1 f) needs no field; under hysteretic vibration it is
phi_k^T f / (lambda_k (1 + i eta) - omega^2). phi_k^T f is the load's participation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rom.fullorder import Modes, SecondOrderModel
from rom.fullorder.poles import Poles, operating_points

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Shares:
    """Energy shares of modes in answers; with the residual's they sum to one.

    Parameters
    ----------
    strain, kinetic : (n_case, m) ndarray [1]
        Of each kept mode.
    strain_residual, kinetic_residual : (n_case,) ndarray [1]
        Of all that the kept modes leave.
    """

    strain: Floats
    kinetic: Floats
    strain_residual: Floats
    kinetic_residual: Floats


def participation(modes: Modes, loads: NDArray) -> Floats:
    """phi_k^T f of each load and mode.

    Parameters
    ----------
    modes : Modes
    loads : (n, n_load) ndarray [N]

    Returns
    -------
    (n_load, m) ndarray [N kg^-1/2]
        The sign of a mode is arbitrary, hence that of its participation.
    """
    return np.asarray(loads).T @ modes.shape


def static_shares(model: SecondOrderModel, modes: Modes, loads: NDArray) -> tuple[Floats, Floats]:
    """Shares of the static strain energy ``f^T K^-1 f / 2``.

    Parameters
    ----------
    model : SecondOrderModel
    modes : Modes
    loads : (n, n_load) ndarray [N]

    Returns
    -------
    share : (n_load, m) ndarray [1]
    residual : (n_load,) ndarray [1]
    """
    compliance = np.einsum("nl,nl->l", loads, model.solve_static(loads))
    share = participation(modes, loads) ** 2 / modes.eigenvalue / compliance[:, None]
    return share, 1.0 - share.sum(axis=1)


def coordinates(modes: Modes, loads: NDArray, frequency: NDArray, loss_factor: float) -> NDArray[np.complex128]:
    """Modal coordinates under unit amplitude of each load at each frequency.

    Returns
    -------
    (n_load, n_frequency, m) ndarray, complex [m kg^1/2]
    """
    stiffness, inertia = operating_points(np.asarray(frequency, dtype=float), loss_factor)
    return Poles.of_modes(modes.eigenvalue).at(participation(modes, loads)[:, None, :], stiffness, inertia)


def energy_shares(model: SecondOrderModel, modes: Modes, displacement: NDArray) -> Shares:
    """Shares of strain and kinetic energy in any answers, whatever method gave them.

    Parameters
    ----------
    model : SecondOrderModel
    modes : Modes
    displacement : (n_case, n) ndarray [m]
        Real or complex.

    Returns
    -------
    Shares

    Raises
    ------
    ValueError
        For a field of another size, or one that does not move.
    """
    fields = np.asarray(displacement)
    if fields.ndim != 2 or fields.shape[1] != model.n:
        raise ValueError(f"the displacement has shape {fields.shape}: give (n_case, {model.n}), free dofs alone")
    columns = fields.T
    weighted = model.mass @ columns
    kinetic = np.sum(columns.conj() * weighted, axis=0).real
    strain = np.sum(columns.conj() * (model.stiffness @ columns), axis=0).real
    if not (kinetic > 0).all():
        raise ValueError(f"case {int(np.argmin(kinetic))} does not move: it has no energy to share")
    square = np.abs(modes.shape.T @ weighted).T ** 2
    of_strain = square * modes.eigenvalue / strain[:, None]
    of_kinetic = square / kinetic[:, None]
    return Shares(of_strain, of_kinetic, 1.0 - of_strain.sum(axis=1), 1.0 - of_kinetic.sum(axis=1))
