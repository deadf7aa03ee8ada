"""Loss factors of several tissues: K* = K (1 + i eta) + i L with L = sum eta_t K_t."""

import numpy as np
import pytest
import scipy.sparse as sp

from rom.errors import SolverError
from rom.fullorder import SecondOrderModel

#: Rounding (2e-16) times the condition of the blocks (1e5).
ROUNDING = 1e-11


@pytest.fixture
def two_tissues(block):
    """A block whose stiffness is the sum of two, neither a multiple of the other, and its mass."""
    k, m = block()
    weight = sp.diags_array(np.linspace(0.1, 0.9, k.shape[0]))
    soft = (weight @ k @ weight).tocsr()  # congruent to k, so positive definite
    return soft, (k + soft).tocsr(), m


@pytest.fixture
def loads(two_tissues, rng):
    return rng.standard_normal((two_tissues[0].shape[0], 2)) + 1j * rng.standard_normal((two_tissues[0].shape[0], 2))


def test_equal_loss_factors_are_the_scalar_one(two_tissues, loads, backend):
    """L = eta K, whole or in part, says what the loss factor says."""
    _, k, m = two_tissues
    scalar = SecondOrderModel(k, m, backend=backend).solve_harmonic(loads, 90.0, 0.3)
    for share in (1.0, 0.25):
        model = SecondOrderModel(k, m, loss_stiffness=share * 0.3 * k, backend=backend)
        u = model.solve_harmonic(loads, 90.0, (1 - share) * 0.3)
        assert np.linalg.norm(u - scalar) <= ROUNDING * np.linalg.norm(scalar)


def test_unequal_loss_factors_are_the_dense_solve(two_tissues, loads, backend):
    soft, k, m = two_tissues
    loss = 0.4 * soft + 0.05 * (k - soft)
    model = SecondOrderModel(k, m, loss_stiffness=loss, backend=backend)
    for frequency, eta in ((0.0, 0.0), (70.0, 0.0), (150.0, 0.1)):
        z = k * (1 + 1j * eta) + 1j * loss - (2 * np.pi * frequency) ** 2 * m
        exact = np.linalg.solve(z.toarray(), loads)
        u = model.solve_harmonic(loads, frequency, eta)
        assert np.linalg.norm(u - exact) <= ROUNDING * np.linalg.norm(exact)
        assert np.all(model.residual(u, loads, frequency, eta) <= ROUNDING)
        assert np.all(model.residual(1.01 * u, loads, frequency, eta) > 0.009)  # Z (1.01 u) - f = .01 f


def test_power_put_in_is_dissipated(two_tissues, loads):
    """Imaginary part of u^H (Z u - f) = 0; with L alone and with both."""
    soft, k, m = two_tissues
    model = SecondOrderModel(k, m, loss_stiffness=0.4 * soft)
    for eta in (0.0, 0.2):
        u = model.solve_harmonic(loads, 120.0, eta)
        lost = model.dissipated_power(u, 120.0, eta)
        assert np.all(lost > 0)
        np.testing.assert_allclose(model.input_power(loads, u, 120.0), lost, rtol=1e-9)
    by_hand = np.pi * 120.0 * np.einsum("ij,ij->j", u.conj(), (0.2 * k + 0.4 * soft) @ u).real
    np.testing.assert_allclose(lost, by_hand, rtol=1e-12)


def test_receptance_is_reciprocal(two_tissues):
    """Maxwell-Betti holds with any complex symmetric Z."""
    soft, k, m = two_tissues
    model = SecondOrderModel(k, m, loss_stiffness=0.5 * soft)
    dofs = [4, 61, 118]
    u = model.solve_harmonic(np.eye(model.n)[:, dofs], 80.0, 0.0)[dofs]
    np.testing.assert_allclose(u, u.T, rtol=1e-9)
    assert np.all(np.diag(u).imag < 0)  # the displacement lags behind its force


def test_statics_and_modes_are_those_of_the_real_stiffness(two_tissues, loads):
    soft, k, m = two_tissues
    plain, damped = SecondOrderModel(k, m), SecondOrderModel(k, m, loss_stiffness=0.5 * soft)
    np.testing.assert_array_equal(damped.solve_static(loads.real), plain.solve_static(loads.real))
    np.testing.assert_array_equal(damped.natural_modes(count=3).eigenvalue, plain.natural_modes(count=3).eigenvalue)


def test_a_loss_stiffness_alone_damps_a_resonance(rod):
    """Analytic: at its natural frequency a mode answers u = phi phi^T f / (i eta lambda)."""
    body = rod(30)
    frequency, force = body.frequency_hz[0], body.mass @ body.shape[:, 0]
    with pytest.raises(SolverError, match="singular"):
        SecondOrderModel(body.stiffness, body.mass).solve_harmonic(force, frequency, 0.0)
    model = SecondOrderModel(body.stiffness, body.mass, loss_stiffness=0.1 * body.stiffness)
    exact = body.shape[:, 0] / (0.1j * body.eigenvalue[0])
    np.testing.assert_allclose(model.solve_harmonic(force, frequency, 0.0), exact, rtol=1e-9)


def test_refusals(two_tissues, rod):
    soft, k, m = two_tissues
    for loss, words in (
        (1j * soft, "loss stiffness is complex"),
        (soft.toarray(), "loss stiffness is a ndarray"),
        (rod(9).stiffness, "loss stiffness has shape .* same dofs"),
        (-soft, "positive semi-definite"),
        (sp.triu(soft), "loss stiffness is not symmetric"),
    ):
        with pytest.raises(ValueError, match=words):
            SecondOrderModel(k, m, loss_stiffness=loss)
