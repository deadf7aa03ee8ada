"""A loss factor for each tissue: K* = sum K_t (1 + i eta_t), and what it makes of each mode.

The complex stiffness is K + i L with the loss stiffness L = sum eta_t K_t. Where all eta_t are equal the natural modes
uncouple the response; elsewhere they do not, and phi_k^T L phi_k keeps of L only what each mode does to itself. The
modal loss factor that this gives is a mean of the tissues', weighted by their shares of the mode's strain energy:

    eta_k = phi_k^T L phi_k / lambda_k = sum eta_t U_t,k,    U_t,k = phi_k^T K_t phi_k / lambda_k

(modal strain energy method: Ungar and Kerwin, J. Acoust. Soc. Am. 34, 1962, 954; Johnson and Kienholz, AIAA J. 20,
1982, 1284).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from rom.checks import real_number
from rom.fingertip import Fingertip
from rom.fingertip.anatomy import TISSUES
from rom.fullorder import Modes, SecondOrderModel

Floats = NDArray[np.float64]

#: Loss factors by tissue: assumptions, not measurements. What was published is one number for the whole pad, 0.1. Here
#: fat lobules flow most, cells and water between fibres more than the fibres' own network, and hard keratin least.
ASSUMED_LOSS_FACTORS: Mapping[str, float] = {
    "stratum_corneum": 0.10,
    "epidermis": 0.15,
    "dermis": 0.12,
    "hypodermis": 0.25,
    "nail_bed": 0.15,
    "nail_plate": 0.03,
}


def loss_factors(loss_factor: float | Mapping[str, float]) -> Floats:
    """Loss factor of each tissue, in the order of `rom.fingertip.anatomy.TISSUES`.

    Parameters
    ----------
    loss_factor : float or mapping of tissue to float [1]
        One for all, or one for each.

    Returns
    -------
    eta : (6,) ndarray [1]

    Raises
    ------
    ValueError
        For an unknown or missing tissue, or a value that is negative or not finite.
    """
    if isinstance(loss_factor, Mapping):
        if set(loss_factor) != set(TISSUES):
            given = ", ".join(loss_factor) or "no tissue"
            raise ValueError(f"Loss factors are given for {given}, but each of {', '.join(TISSUES)} needs one.")
        values = np.array([loss_factor[name] for name in TISSUES], dtype=np.float64)
    else:
        values = np.full(len(TISSUES), loss_factor, dtype=np.float64)
    if not (np.isfinite(values).all() and (values >= 0).all()):
        raise ValueError(f"The loss factor is {loss_factor!r}, but it must be a finite number of at least 0.")
    return values


def with_contrast(loss_factor: Mapping[str, float], contrast: float) -> dict[str, float]:
    """Loss factors spread further apart, or drawn together: m (eta_t / m)^contrast, m their geometric mean.

    Parameters
    ----------
    loss_factor : mapping of tissue to float [1]
        All greater than zero.
    contrast : float [1]
        0 makes them equal, 1 leaves them as they are; ratios between tissues are raised to this power.

    Raises
    ------
    ValueError
        As `loss_factors`, or for a loss factor of zero or a contrast that is negative or not finite.
    """
    eta = loss_factors(loss_factor)
    contrast = real_number("contrast", contrast, 0.0)
    if not (eta > 0).all():
        raise ValueError("A loss factor is 0, but ratios between tissues need all to be greater than 0.")
    mean = np.exp(np.log(eta).mean())
    return {name: float(mean * (value / mean) ** contrast) for name, value in zip(TISSUES, eta, strict=True)}


def loss_stiffness(fingertip: Fingertip, loss_factor: float | Mapping[str, float]) -> sparse.csc_matrix:
    """L = sum eta_t K_t : (n_free, n_free) csc_matrix [N/m], symmetric, positive semi-definite.

    Raises
    ------
    ValueError
        As `loss_factors`.
    """
    eta = loss_factors(loss_factor)
    by_tissue = fingertip.stiffness_by_tissue
    return sparse.csc_matrix(sum(value * by_tissue[name] for name, value in zip(TISSUES, eta, strict=True)))


def damped_model(fingertip: Fingertip, loss_factor: float | Mapping[str, float]) -> SecondOrderModel:
    """Full-order model with a loss factor for each tissue; ask it for harmonic solutions with loss factor 0.

    Raises
    ------
    ValueError
        As `loss_factors`.
    """
    loss = loss_stiffness(fingertip, loss_factor)
    return SecondOrderModel(fingertip.stiffness, fingertip.mass, loss_stiffness=loss)


def strain_energy_shares(fingertip: Fingertip, modes: Modes) -> Floats:
    """Share of each tissue in each mode's strain energy.

    Parameters
    ----------
    fingertip : Fingertip
    modes : Modes
        Of its stiffness and mass.

    Returns
    -------
    share : (6, m) ndarray [1]
        In the order of `rom.fingertip.anatomy.TISSUES`; every mode's shares add up to one.
    """
    by_tissue, shape = fingertip.stiffness_by_tissue, modes.shape
    energy = np.array([np.sum(shape * (by_tissue[name] @ shape), axis=0) for name in TISSUES])
    return energy / energy.sum(axis=0)


def modal_loss_factors(fingertip: Fingertip, modes: Modes, loss_factor: float | Mapping[str, float]) -> xr.DataArray:
    """What each tissue adds to each mode's loss factor; the sum over tissues is the mode's.

    Parameters
    ----------
    fingertip : Fingertip
    modes : Modes
        Of its stiffness and mass.
    loss_factor : float or mapping of tissue to float [1]

    Returns
    -------
    xr.DataArray
        (tissue, mode) [1], with coordinates ``tissue``, ``mode`` (from 1) and ``frequency`` [Hz].

    Raises
    ------
    ValueError
        As `loss_factors`.
    """
    share = loss_factors(loss_factor)[:, None] * strain_energy_shares(fingertip, modes)
    return xr.DataArray(
        share,
        dims=("tissue", "mode"),
        coords={
            "tissue": list(TISSUES),
            "mode": np.arange(1, modes.count + 1),
            "frequency": ("mode", modes.frequency_hz, {"long_name": "natural frequency", "units": "Hz"}),
        },
        attrs={"long_name": "share of a tissue in a mode's loss factor", "units": "1"},
    )
