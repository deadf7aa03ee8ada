"""Derivatives of frequency responses by anything a fingertip is made from, without a further solve.

From Z u = f follows Z u_p = f_p - Z_p u. The receptance h = l^T u seen by an output l, with Z^T = Z and the adjoint
a = Z^-1 l, thus changes by h_p = -a^T Z_p u: one solve for any number of parameters, and none for the receptance at the
load itself, where a = u. (Haftka and Guerdal, Elements of Structural Optimization, 1992.)

Loads and outputs are forces on given nodes along directions fixed in space: they stay with the skin as it changes its
shape, their directions do not turn with its normal, so f_p = l_p = 0. A peak of |h| lies where |h| is stationary in
frequency, so there the derivative at the peak's own frequency is that of the peak's height.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from analysis.tissue_damping import loss_factors
from rom.fingertip import Fingertip
from rom.fingertip.anatomy import TISSUES
from rom.vibration.matrix_derivatives import ProjectedDerivatives, projected_derivatives
from rom.vibration.parameters import parameter_coordinates


def receptance_sensitivity(
    fingertip: Fingertip,
    force: ArrayLike,
    displacement: ArrayLike,
    frequency: ArrayLike,
    loss_factor: float | Mapping[str, float],
    *,
    adjoint: ArrayLike | None = None,
    names: Iterable[str] | None = None,
) -> xr.Dataset:
    """Derivatives of harmonic receptances h = l^T u by parameters, from fields that were solved already.

    Parameters
    ----------
    fingertip : Fingertip
    force : (n_free, k) array [N]
        Output l of each case: where, and along which direction, its displacement is seen. For the receptance at the
        load that is the unit force itself.
    displacement : (n_free, k) array [m]
        u of each case.
    frequency : float or (k,) array [Hz]
    loss_factor : float or mapping of tissue to float [1]
    adjoint : (n_free, k) array [m], optional
        Z^-1 l of each case; by default ``displacement``, which it is at the load itself.
    names : iterable of str, optional
        Parameters; all by default.

    Returns
    -------
    xr.Dataset
        As `reduced_receptance_sensitivity`. Memory grows with k^2: take that for the cases of a whole curve.

    Raises
    ------
    ValueError
        For shapes that do not fit, an unknown name or tissue, or an element that changes its tissue with any step.
    """
    force, u = np.asarray(force), np.asarray(displacement, dtype=np.complex128)
    a = u if adjoint is None else np.asarray(adjoint, dtype=np.complex128)
    if not force.shape == u.shape == a.shape or u.ndim != 2:
        raise ValueError(
            f"Force, displacement and adjoint have shapes {force.shape}, {u.shape} and {a.shape}, but they must be "
            "(n_free, k) alike: one column a case."
        )
    parts = [u.real, u.imag] if adjoint is None else [u.real, u.imag, a.real, a.imag]
    derivatives = projected_derivatives(fingertip, np.concatenate(parts, axis=1), names)
    k = u.shape[1]
    own = np.zeros((k * len(parts), k), dtype=np.complex128)
    own[:k], own[k : 2 * k] = np.eye(k), 1j * np.eye(k)
    other = own if adjoint is None else np.roll(own, 2 * k, axis=0)
    return _receptances(derivatives, np.sum(force * u, axis=0), own, other, frequency, loss_factor)


def reduced_receptance_sensitivity(
    derivatives: ProjectedDerivatives,
    force: ArrayLike,
    coordinates: ArrayLike,
    frequency: ArrayLike,
    loss_factor: float | Mapping[str, float],
    *,
    adjoint: ArrayLike | None = None,
) -> xr.Dataset:
    """The same through a reduced model u = V y whose basis V is held: h_p = -y^T (V^T Z_p V) y.

    Parameters
    ----------
    derivatives : ProjectedDerivatives
        Between the vectors of V.
    force : (r, k) array
        V^T l of each case.
    coordinates : (r, k) array
        y of each case.
    frequency : float or (k,) array [Hz]
    loss_factor : float or mapping of tissue to float [1]
    adjoint : (r, k) array, optional
        Coordinates of Z^-1 l; by default those of u.

    Returns
    -------
    xr.Dataset
        ``receptance`` (case) and ``derivative`` (parameter, case), complex [m/N] and [m/N per the parameter's unit];
        ``logarithmic`` (parameter, case), per cent of magnitude per cent of the parameter; ``loss_factor_logarithmic``
        (tissue, case), the same per cent of each tissue's loss factor.

    Raises
    ------
    ValueError
        For shapes that do not fit, or an unknown tissue.
    """
    y = np.asarray(coordinates, dtype=np.complex128)
    a = y if adjoint is None else np.asarray(adjoint, dtype=np.complex128)
    r, force = derivatives.mass.shape[1], np.asarray(force)
    if not force.shape == y.shape == a.shape or y.ndim != 2 or len(y) != r:
        raise ValueError(
            f"Force, coordinates and adjoint have shapes {force.shape}, {y.shape} and {a.shape}, but they must be "
            f"({r}, k) alike: one row a vector of the basis, one column a case."
        )
    return _receptances(derivatives, np.sum(force * y, axis=0), y, a, frequency, loss_factor)


def _receptances(
    derivatives: ProjectedDerivatives,
    receptance: NDArray,
    y: NDArray,
    a: NDArray,
    frequency: ArrayLike,
    loss_factor: float | Mapping[str, float],
) -> xr.Dataset:
    eta, cases = loss_factors(loss_factor), y.shape[1]
    frequency = np.broadcast_to(np.asarray(frequency, dtype=np.float64), (cases,))
    inertia = (2 * np.pi * frequency) ** 2

    def form(matrix: NDArray) -> NDArray:
        return np.sum(a * (matrix @ y), axis=0)

    derivative = np.array([
        -form(np.tensordot(1 + 1j * eta, stiffness, axes=1)) + inertia * form(mass)
        for stiffness, mass in zip(derivatives.stiffness, derivatives.mass, strict=True)
    ]).reshape(-1, cases)
    by_loss = np.array([-1j * value * form(one) for value, one in zip(eta, derivatives.tissue_stiffness, strict=True)])
    scale = np.array([parameter.scale for parameter in derivatives.parameters])
    per_cent = {"long_name": "relative change of receptance magnitude per relative change of parameter", "units": "1"}
    return xr.Dataset(
        {
            "receptance": ("case", receptance, {"long_name": "receptance", "units": "m N-1"}),
            "derivative": (("parameter", "case"), derivative, {
                "long_name": "derivative of receptance by parameter", "units": "m N-1 per parameter_unit"}),
            "logarithmic": (("parameter", "case"), scale[:, None] * (derivative / receptance).real, per_cent),
            "loss_factor_logarithmic": (("tissue", "case"), (by_loss / receptance).real, {
                **per_cent, "long_name": "relative change of receptance magnitude per relative change of loss factor"}),
        },
        coords={"frequency": ("case", frequency, {"long_name": "frequency", "units": "Hz"}), "tissue": list(TISSUES)}
        | parameter_coordinates(derivatives.parameters),
    )
