"""What a strain tensor says in one number: principal strains, energy density, equivalent strain; over a cycle too.

A complex strain stands for eps(t) = Re(eps exp(i omega t)), an ellipse in the space of strains.  Any quadratic
measure q(t) = eps(t) . Q eps(t) along it is, with a = eps^H Q eps and b = eps^T Q eps,

    q(t) = (a + Re(b exp(2 i omega t))) / 2 :    mean a / 2,  peak (a + |b|) / 2 at the phase -arg(b) / 2 ,

so peak and mean of strain energy density and of equivalent strain need no sampling of the cycle.

Principal strains have no such form.  They are taken at the instant of the cycle at which the strain energy density
is largest.  That is one instant for the whole tensor, hence three principal strains that exist at the same time, and
it is exact where the cycle is a straight line (all components in phase).  The energy peaks twice a cycle, with
opposite signs of strain; of the two instants the one with the larger tension counts, so that a cycle that only pulls
and one that starts by pushing say the same.  The largest principal strain so found never exceeds the maximum
over the cycle, which `largest_principal_over_cycle` finds by sampling.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def tensor(strain: ArrayLike) -> np.ndarray:
    """(..., 3, 3) ndarray [-] : symmetric tensors of (..., 6) Voigt strains with engineering shear."""
    xx, yy, zz, yz, xz, xy = np.moveaxis(_six(strain), -1, 0)
    rows = [[xx, xy / 2, xz / 2], [xy / 2, yy, yz / 2], [xz / 2, yz / 2, zz]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def principal_strains(strain: ArrayLike) -> Floats:
    """Principal strains of real tensors, by the trigonometric solution of the characteristic equation.

    Parameters
    ----------
    strain : (..., 6) array_like [-]
        Real; see `strain_at_peak` for a complex one.

    Returns
    -------
    principal : (..., 3) ndarray [-]
        Largest first.  Where two coincide, accurate to about 1e-8 of the largest (square root of rounding).

    Raises
    ------
    ValueError
        For complex strains or other than six components.
    """
    values = _six(strain)
    if np.iscomplexobj(values):
        raise ValueError("The strain is complex, but principal strains belong to one instant: use strain_at_peak.")
    xx, yy, zz, yz, xz, xy = np.moveaxis(values.astype(float), -1, 0)
    mean = (xx + yy + zz) / 3
    a, b, c, d, e, f = xx - mean, yy - mean, zz - mean, yz / 2, xz / 2, xy / 2
    radius = np.sqrt((a * a + b * b + c * c + 2 * (d * d + e * e + f * f)) / 6)
    scale = np.where(radius > 0, radius, 1.0)
    a, b, c, d, e, f = (one / scale for one in (a, b, c, d, e, f))
    half = (a * (b * c - d * d) - f * (f * c - d * e) + e * (f * d - b * e)) / 2
    angle = np.arccos(np.clip(half, -1, 1)) / 3
    first, third = np.cos(angle), np.cos(angle + 2 * np.pi / 3)
    return mean[..., None] + 2 * radius[..., None] * np.stack([first, -first - third, third], axis=-1)


def energy_density(strain: ArrayLike, shear_modulus: ArrayLike, bulk_modulus: ArrayLike) -> Floats:
    """Strain energy density, of a complex strain its peak over the cycle.

    Parameters
    ----------
    strain : (..., p, 6) array_like [-]
    shear_modulus, bulk_modulus : float or (p,) array_like [Pa]

    Returns
    -------
    density : (..., p) ndarray [J/m3]
        mu e : e + kappa (tr eps)^2 / 2, with e the deviator; the elastic part, whatever the loss factor.
    """
    values = _six(strain)
    return _peak(values, _stress(values, shear_modulus, bulk_modulus) / 2)


def mean_energy_density(strain: ArrayLike, shear_modulus: ArrayLike, bulk_modulus: ArrayLike) -> Floats:
    """Mean over the cycle of the strain energy density, sigma : conj(eps) / 4; arguments as `energy_density`."""
    values = _six(strain)
    return np.sum(_stress(values, shear_modulus, bulk_modulus) * values.conj(), axis=-1).real / 4


def equivalent_strain(strain: ArrayLike) -> Floats:
    """Von Mises strain sqrt(2/3 e : e), e the deviator; of a complex strain its peak over the cycle.

    It is the stretch of the uniaxial test of an incompressible body with the same distortion energy.

    Parameters
    ----------
    strain : (..., 6) array_like [-]

    Returns
    -------
    equivalent : (...) ndarray [-]
    """
    values = _six(strain)
    return np.sqrt(_peak(values, _stress(values, 1 / 3, 0.0)))


def strain_at_peak(strain: ArrayLike, shear_modulus: ArrayLike, bulk_modulus: ArrayLike) -> Floats:
    """Real strain at the instant of the cycle at which the energy density is largest.

    Of the two instants half a period apart, whose strains differ in sign, the one with the larger tension.

    Parameters
    ----------
    strain : (..., p, 6) array_like [-]
        Of a cycle; a real strain is one whose components are in phase.
    shear_modulus, bulk_modulus : float or (p,) array_like [Pa]

    Returns
    -------
    strain : (..., p, 6) ndarray [-]
    """
    values = _six(strain)
    swing = np.sum(values * _stress(values, shear_modulus, bulk_modulus), axis=-1)
    snapshot = (values * np.exp(-0.5j * np.angle(swing))[..., None]).real
    principal = principal_strains(snapshot)
    return np.where((principal[..., 0] < -principal[..., 2])[..., None], -snapshot, snapshot)


def largest_principal_over_cycle(strain: ArrayLike, samples: int = 90) -> Floats:
    """Maximum over the cycle of the largest principal strain, by sampling half of it (the other half by sign).

    Parameters
    ----------
    strain : (..., 6) array_like [-]
    samples : int
        Low by a factor cos(pi / (2 samples)) at most: 1.5e-4 for 90.

    Returns
    -------
    largest : (...) ndarray [-]
    """
    values = _six(strain)
    largest = np.zeros(values.shape[:-1])
    for phase in np.pi * np.arange(samples) / samples:
        principal = principal_strains((values * np.exp(1j * phase)).real)
        np.maximum(largest, np.maximum(principal[..., 0], -principal[..., 2]), out=largest)
    return largest


def _six(strain: ArrayLike) -> np.ndarray:
    values = np.asarray(strain)
    if values.ndim == 0 or values.shape[-1] != 6:
        raise ValueError(f"The strain has the shape {values.shape}, but its last axis must hold six components: "
                         "xx, yy, zz and the engineering shears yz, xz, xy.")
    return values


def _stress(strain: np.ndarray, shear_modulus: ArrayLike, bulk_modulus: ArrayLike) -> np.ndarray:
    """Elastic stress (..., 6) in Voigt order, work-conjugate to the strain."""
    mu, kappa = np.asarray(shear_modulus)[..., None], np.asarray(bulk_modulus)
    trace = strain[..., :3].sum(axis=-1)
    stress = mu * strain * np.array([2.0, 2.0, 2.0, 1.0, 1.0, 1.0])
    stress[..., :3] += ((kappa - 2 / 3 * mu[..., 0]) * trace)[..., None]
    return stress


def _peak(strain: np.ndarray, conjugate: np.ndarray) -> Floats:
    """Largest value over the cycle of eps(t) . Q eps(t), given eps and Q eps; its one value for a real strain."""
    if not np.iscomplexobj(strain):
        return np.sum(strain * conjugate, axis=-1)
    return (np.sum(strain.conj() * conjugate, axis=-1).real + np.abs(np.sum(strain * conjugate, axis=-1))) / 2
