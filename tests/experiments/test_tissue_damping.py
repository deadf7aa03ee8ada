"""A loss factor for each tissue: energy shares and the direct model."""

import numpy as np
import pytest
from analysis.tissue_damping import (
    ASSUMED_LOSS_FACTORS,
    damped_model,
    loss_factors,
    loss_stiffness,
    modal_loss_factors,
    strain_energy_shares,
    with_contrast,
)

from rom.fingertip.anatomy import TISSUES
from rom.fingertip.fingertip import DIRECTIONS
from rom.fullorder import SecondOrderModel

FREQUENCY = np.array([60.0, 125.0, 230.0])


@pytest.fixture(scope="module")
def model(tiny_tip):
    return SecondOrderModel(tiny_tip.stiffness, tiny_tip.mass)


@pytest.fixture(scope="module")
def modes(model):
    return model.natural_modes(count=12)


@pytest.fixture(scope="module")
def loads(tiny_tip):
    return np.stack([tiny_tip.patch_force(tiny_tip.mesh.fingerprint_centroid, one) for one in DIRECTIONS], axis=1)


@pytest.fixture(scope="module")
def truth(tiny_tip, loads):
    """Direct fields (frequency, dof, load)."""
    model = damped_model(tiny_tip, ASSUMED_LOSS_FACTORS)
    return np.array([model.solve_harmonic(loads, f, 0.0) for f in FREQUENCY])


def test_energy_shares_are_derivatives_by_modulus(tiny_tip, modes):
    """Independent, by re-solving: d ln lambda / d ln E_t is the tissue's share of the strain energy."""
    share = strain_energy_shares(tiny_tip, modes)
    np.testing.assert_allclose(share.sum(axis=0), 1.0, rtol=1e-12)
    assert (share > 0).all()
    by_tissue = tiny_tip.stiffness_by_tissue
    for t in (0, 3):
        low, high = (SecondOrderModel(tiny_tip.stiffness + s * by_tissue[TISSUES[t]], tiny_tip.mass).natural_modes(
            count=12).eigenvalue for s in (-1e-4, 1e-4))
        np.testing.assert_allclose(share[t], (high - low) / 2e-4 / modes.eigenvalue, rtol=1e-4, atol=1e-6)


def test_modal_loss_factors(tiny_tip, modes):
    """Equal loss factors are the mode's own; else it lies between the smallest and the largest. By definition."""
    np.testing.assert_allclose(modal_loss_factors(tiny_tip, modes, 0.17).sum("tissue"), 0.17, rtol=1e-12)
    eta = modal_loss_factors(tiny_tip, modes, ASSUMED_LOSS_FACTORS).sum("tissue")
    assert min(ASSUMED_LOSS_FACTORS.values()) < eta.min() and eta.max() < max(ASSUMED_LOSS_FACTORS.values())
    rayleigh = np.sum(modes.shape * (loss_stiffness(tiny_tip, ASSUMED_LOSS_FACTORS) @ modes.shape), axis=0)
    np.testing.assert_allclose(eta, rayleigh / modes.eigenvalue, rtol=1e-8)


def test_contrast():
    mean = np.prod(list(ASSUMED_LOSS_FACTORS.values())) ** (1 / 6)
    assert with_contrast(ASSUMED_LOSS_FACTORS, 0.0) == pytest.approx(dict.fromkeys(TISSUES, mean))
    assert with_contrast(ASSUMED_LOSS_FACTORS, 1.0) == pytest.approx(dict(ASSUMED_LOSS_FACTORS))
    strong = with_contrast(ASSUMED_LOSS_FACTORS, 2.0)
    ratio = ASSUMED_LOSS_FACTORS["hypodermis"] / ASSUMED_LOSS_FACTORS["dermis"]
    assert strong["hypodermis"] / strong["dermis"] == pytest.approx(ratio**2)


def test_equal_loss_factors_are_the_scalar_one(tiny_tip, model, loads):
    u = damped_model(tiny_tip, 0.2).solve_harmonic(loads, 125.0, 0.0)
    scalar = model.solve_harmonic(loads, 125.0, 0.2)
    assert np.linalg.norm(u - scalar) <= 1e-9 * np.linalg.norm(scalar)  # rounding times the condition


def test_power_balances_and_receptance_is_reciprocal(tiny_tip, loads, truth):
    model = damped_model(tiny_tip, ASSUMED_LOSS_FACTORS)
    for f, u in zip(FREQUENCY, truth, strict=True):
        np.testing.assert_allclose(model.input_power(loads, u, f), model.dissipated_power(u, f, 0.0), rtol=1e-8)
        receptance = loads.T @ u
        np.testing.assert_allclose(receptance, receptance.T, atol=1e-9 * abs(receptance).max())


def test_refusals():
    for call, words in (
        (lambda: loss_factors({"dermis": 0.1}), "each of .* needs one"),
        (lambda: loss_factors({}), "no tissue"),
        (lambda: loss_factors(np.nan), "at least 0"),
        (lambda: loss_factors(dict(ASSUMED_LOSS_FACTORS, dermis=-0.1)), "at least 0"),
        (lambda: with_contrast(ASSUMED_LOSS_FACTORS, -1.0), "contrast=-1.0 cannot be"),
        (lambda: with_contrast(dict(ASSUMED_LOSS_FACTORS, dermis=0.0), 1.0), "greater than 0"),
    ):
        with pytest.raises(ValueError, match=words):
            call()
