"""Reduced models with a loss factor for each tissue, against direct solutions and analytic limits."""

import numpy as np
import pytest
from analysis.tissue_damped_rom import TissueDampedModel
from analysis.tissue_damping import ASSUMED_LOSS_FACTORS, damped_model, modal_loss_factors, with_contrast

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
    """Direct fields (frequency, dof, load) by contrast."""
    found = {}
    for contrast in (0.0, 1.0, 2.0):
        model = damped_model(tiny_tip, with_contrast(ASSUMED_LOSS_FACTORS, contrast))
        found[contrast] = np.array([model.solve_harmonic(loads, f, 0.0) for f in FREQUENCY])
    return found


def worst(fields, truth):
    return np.max(np.linalg.norm(fields - truth, axis=1) / np.linalg.norm(truth, axis=1))


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
    for call, words in ((lambda: TissueDampedModel(tiny_tip, modes, loads[:-1]), "one row a free dof"),
                        (lambda: TissueDampedModel(tiny_tip, modes, loads, 0), "one or more")):
        with pytest.raises(ValueError, match=words):
            call()
