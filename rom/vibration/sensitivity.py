"""Derivatives of natural frequencies by anything a fingertip is made from.

lambda_p = phi^T (K_p - lambda M_p) phi with phi^T M phi = 1, and f_p = lambda_p / (8 pi^2 f) (Fox and Kapoor, AIAA J.
6, 1968, 2426). Modes of one frequency have no shape of their own: their derivatives are the eigenvalues of
Phi^T (K_p - lambda M_p) Phi over the cluster (Ojalvo, AIAA J. 26, 1988, 361; Dailey, AIAA J. 27, 1989, 486).
Close but distinct modes of one parity have derivatives that hold over changes small against their distance, no further.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy.linalg as sla
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from rom.fingertip import Fingertip
from rom.fullorder import Modes
from rom.vibration.matrix_derivatives import projected_derivatives
from rom.vibration.parameters import parameter_coordinates

Floats = NDArray[np.float64]

#: Relative distance of neighbouring eigenvalues below which modes count as one cluster. A shape is known to its
#: residual (1e-9) over the relative distance to its neighbour: beyond this distance each shape is its own to 1e-3 at
#: worst, usually far better.
CLUSTER = 1e-6


def frequency_sensitivity(fingertip: Fingertip, modes: Modes, names: Iterable[str] | None = None) -> xr.Dataset:
    """Derivatives of natural frequencies by parameters.

    Parameters
    ----------
    fingertip : Fingertip
    modes : Modes
        Of its stiffness and mass.
    names : iterable of str, optional
        Parameters as `rom.vibration.parameters` lists them; all by default.

    Returns
    -------
    xr.Dataset
        ``derivative`` (parameter, mode) [Hz per the parameter's unit]; ``logarithmic`` (parameter, mode), per cent of
        frequency per cent of the parameter (of one unit, where it is zero); ``frequency`` and ``cluster`` (mode):
        modes of one number count as having one frequency, and each parameter sorts their derivatives upwards.

    Raises
    ------
    ValueError
        For an unknown name, modes of another model, or an element that changes its tissue with any step.
    """
    derivatives = projected_derivatives(fingertip, modes.shape, names)
    cluster = clusters(modes.eigenvalue)
    change = np.array([
        eigenvalue_derivatives(modes.eigenvalue, cluster, stiffness, mass)
        for stiffness, mass in zip(derivatives.stiffness.sum(axis=1), derivatives.mass, strict=True)
    ]).reshape(-1, modes.count)
    frequency = modes.frequency_hz
    derivative = change / (8 * np.pi**2 * frequency)
    scale = np.array([parameter.scale for parameter in derivatives.parameters])
    return xr.Dataset(
        {
            "derivative": (("parameter", "mode"), derivative, {
                "long_name": "derivative of natural frequency by parameter", "units": "Hz per parameter_unit"}),
            "logarithmic": (("parameter", "mode"), scale[:, None] * derivative / frequency, {
                "long_name": "relative change of natural frequency per relative change of parameter", "units": "1"}),
            "frequency": ("mode", frequency, {"long_name": "natural frequency", "units": "Hz"}),
            "cluster": ("mode", cluster, {"long_name": "number of the cluster", "units": "1"}),
        },
        coords={"mode": np.arange(1, modes.count + 1)} | parameter_coordinates(derivatives.parameters),
    )


def clusters(eigenvalue: ArrayLike) -> NDArray[np.int64]:
    """Number of each eigenvalue's cluster, from 0: (m,) ndarray; ``eigenvalue`` (m,) is ascending."""
    values = np.asarray(eigenvalue, dtype=np.float64)
    apart = np.diff(values) > CLUSTER * np.abs(values[1:])
    return np.concatenate([[0], np.cumsum(apart)]).astype(np.int64)[: len(values)]


def eigenvalue_derivatives(eigenvalue: Floats, cluster: NDArray, stiffness: Floats, mass: Floats) -> Floats:
    """Derivatives of eigenvalues by one parameter.

    Parameters
    ----------
    eigenvalue : (m,) ndarray [rad^2/s^2]
    cluster : (m,) ndarray
        See `clusters`.
    stiffness, mass : (m, m) ndarray
        Phi^T K_p Phi and Phi^T M_p Phi for mass-orthonormal modes.

    Returns
    -------
    derivative : (m,) ndarray [rad^2/s^2 per unit]
        Within a cluster sorted upwards.
    """
    derivative = np.empty(len(eigenvalue))
    for number in np.unique(cluster):
        some = np.flatnonzero(cluster == number)
        block = np.ix_(some, some)
        derivative[some] = sla.eigvalsh(stiffness[block] - eigenvalue[some].mean() * mass[block])
    return derivative
