"""A loss factor for each tissue: energy shares, the direct model, and the reduced ones."""

import numpy as np
import pytest

from rom.fingertip.anatomy import TISSUES
from rom.fingertip.fingertip import DIRECTIONS
from rom.fullorder import SecondOrderModel
from rom.vibration.tissue_damped_rom import TissueDampedModel
from rom.vibration.tissue_damping import (
    ASSUMED_LOSS_FACTORS,
    damped_model,
    loss_factors,
    loss_stiffness,
    modal_loss_factors,
    strain_energy_shares,
    with_contrast,
)

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
    """Direct fields (frequency, dof, load) by contrast."""
    found = {}
    for contrast in (0.0, 1.0, 2.0):
        model = damped_model(tiny_tip, with_contrast(ASSUMED_LOSS_FACTORS, contrast))
        found[contrast] = np.array([model.solve_harmonic(loads, f, 0.0) for f in FREQUENCY])
    return found


def worst(fields, truth):
    return np.max(np.linalg.norm(fields - truth, axis=1) / np.linalg.norm(truth, axis=1))


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
    for f, u in zip(FREQUENCY, truth[1.0], strict=True):
        np.testing.assert_allclose(model.input_power(loads, u, f), model.dissipated_power(u, f, 0.0), rtol=1e-8)
        receptance = loads.T @ u
        np.testing.assert_allclose(receptance, receptance.T, atol=1e-9 * abs(receptance).max())


def test_ritz_vectors(tiny_tip, model, modes, loads):
    reduced = TissueDampedModel(tiny_tip, modes, loads, 2, [ASSUMED_LOSS_FACTORS], model)
    w = reduced.basis
    np.testing.assert_allclose(w.T @ (model.mass @ w), np.eye(reduced.size), atol=1e-8)
    scale = np.sqrt(reduced.eigenvalue)
    stiffness = w.T @ (model.stiffness @ w) / np.outer(scale, scale)
    np.testing.assert_allclose(stiffness, np.eye(reduced.size), atol=1e-8)
    np.testing.assert_allclose(reduced.eigenvalue[:12], modes.eigenvalue, rtol=1e-9)
    np.testing.assert_allclose(np.abs(np.sum(w[:, :12] * (model.mass @ modes.shape), axis=0)), 1.0, rtol=1e-6)
    eta = modal_loss_factors(tiny_tip, modes, ASSUMED_LOSS_FACTORS).sum("tissue")
    np.testing.assert_allclose(reduced.ritz_loss_factors(ASSUMED_LOSS_FACTORS)[:12], eta, rtol=1e-6)


def test_galerkin_converges_and_real_modes_do_not(tiny_tip, model, loads, truth):
    strong = with_contrast(ASSUMED_LOSS_FACTORS, 2.0)
    full, real = [], []
    for count, vectors in ((6, 1), (15, 2), (30, 4)):
        reduced = TissueDampedModel(tiny_tip, model.natural_modes(count=count), loads, vectors, [strong], model)
        full.append(worst(reduced.basis @ reduced.galerkin(FREQUENCY, strong), truth[2.0]))
        real.append(worst(reduced.basis @ reduced.uncoupled(FREQUENCY, strong), truth[2.0]))
    assert full[0] > 5 * full[1] > 25 * full[2]
    assert full[2] < 1e-3 < 0.03 < min(real)  # what the coupling is worth stays, however many modes


def test_the_coupling_matters_with_the_contrast_only(tiny_tip, model, modes, loads, truth):
    """With equal loss factors L is a multiple of K and uncouples: both reduced models are one. Analytic."""
    strong = with_contrast(ASSUMED_LOSS_FACTORS, 2.0)
    reduced = TissueDampedModel(tiny_tip, modes, loads, 3, [ASSUMED_LOSS_FACTORS, strong], model)
    equal = with_contrast(ASSUMED_LOSS_FACTORS, 0.0)
    both = [reduced.basis @ answer(FREQUENCY, equal) for answer in (reduced.galerkin, reduced.uncoupled)]
    assert worst(both[1], both[0]) < 1e-8
    real = [worst(reduced.basis @ reduced.uncoupled(FREQUENCY, with_contrast(ASSUMED_LOSS_FACTORS, c)), truth[c])
            for c in (0.0, 1.0, 2.0)]
    assert 3 * real[0] < real[1] < real[2]


def test_receptance_of_unit_loads(tiny_tip, model, modes, loads):
    reduced = TissueDampedModel(tiny_tip, modes, loads, 1, model=model)
    y = reduced.galerkin(FREQUENCY, 0.1)
    fields = reduced.basis @ y
    np.testing.assert_allclose(reduced.field(y[1]), fields[1], atol=1e-12 * np.abs(fields[1]).max())
    many = reduced.galerkin(np.tile(FREQUENCY, 4), 0.1)  # a sweep goes another way
    np.testing.assert_allclose(many[:3], y, rtol=1e-12)
    np.testing.assert_allclose(reduced.receptance(y), np.einsum("nk,fnk->fk", loads, fields), rtol=1e-9)


def test_refusals(tiny_tip, modes, loads):
    for call, words in (
        (lambda: loss_factors({"dermis": 0.1}), "each of .* needs one"),
        (lambda: loss_factors({}), "no tissue"),
        (lambda: loss_factors(np.nan), "at least 0"),
        (lambda: loss_factors(dict(ASSUMED_LOSS_FACTORS, dermis=-0.1)), "at least 0"),
        (lambda: with_contrast(ASSUMED_LOSS_FACTORS, -1.0), "contrast is -1"),
        (lambda: with_contrast(dict(ASSUMED_LOSS_FACTORS, dermis=0.0), 1.0), "greater than 0"),
        (lambda: TissueDampedModel(tiny_tip, modes, loads[:-1]), "one row a free dof"),
        (lambda: TissueDampedModel(tiny_tip, modes, loads, 0), "one or more"),
    ):
        with pytest.raises(ValueError, match=words):
            call()
