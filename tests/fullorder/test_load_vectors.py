"""Load-dependent vectors: orthogonality, Galerkin, the residual without a solve; all against dense algebra."""

import numpy as np
import pytest
import scipy.linalg as sla

from rom.fullorder.load_vectors import load_vectors

COUNT = 5


@pytest.fixture(scope="module")
def model(tiny_harmonic):
    return tiny_harmonic.model


@pytest.fixture(scope="module")
def modes(model):
    return model.natural_modes(count=10)


@pytest.fixture(scope="module")
def loads(tiny_harmonic):
    return np.ascontiguousarray(tiny_harmonic.unit_loads[:, :4])


@pytest.fixture(scope="module")
def found(model, modes, loads):
    return load_vectors(model, modes, loads, COUNT)


def test_vectors_are_k_orthonormal(model, found):
    for own in found.vectors:
        np.testing.assert_allclose(own @ (model.stiffness @ own.T), np.eye(COUNT), atol=1e-10)


def test_vectors_are_k_orthogonal_to_the_modes(model, modes, found):
    shapes = modes.shape / np.sqrt(modes.eigenvalue)  # K-normalised too, so that the products are cosines
    for own in found.vectors:
        assert np.abs(own @ (model.stiffness @ shapes)).max() <= 1e-9
        assert np.abs(own @ (model.mass @ modes.shape)).max() * np.sqrt(modes.eigenvalue[0]) <= 1e-9


def test_theta_are_the_reduced_masses(model, found):
    for own, theta in zip(found.vectors, found.theta, strict=True):
        reduced = own @ (model.mass @ own.T)
        np.testing.assert_allclose(reduced, np.diag(theta), atol=1e-9 * theta.max())


def test_first_is_the_load_in_the_reduced_space(loads, found):
    for own, first, load in zip(found.vectors, found.first, loads.T, strict=True):
        np.testing.assert_allclose(own @ load, first, atol=1e-9 * np.abs(first).max())


def test_one_vector_is_the_residual_flexibility(model, modes, loads):
    # v = K^-1 f - sum phi_k (phi_k^T f) / lambda_k, divided by its energy norm
    alone = load_vectors(model, modes, loads, 1)
    dense = np.linalg.solve(model.stiffness.toarray(), loads)
    left = dense - modes.shape @ ((modes.shape.T @ loads) / modes.eigenvalue[:, None])
    np.testing.assert_allclose(alone.vectors[:, 0] * alone.first, left.T, atol=1e-9 * np.abs(left).max())


@pytest.mark.parametrize(("frequency", "loss_factor"), [(40.0, 0.3), (210.0, 0.1), (360.0, 0.05)])
def test_the_residual_needs_no_solve(tiny_harmonic, model, modes, loads, found, frequency, loss_factor):
    # ||r||_(K^-1) of the Galerkin answer, by a dense Cholesky factor of K
    stiffness, mass = model.stiffness.toarray(), model.mass.toarray()
    lower = np.linalg.cholesky(stiffness)
    omega2, damped = (2 * np.pi * frequency) ** 2, 1 + 1j * loss_factor
    for j in range(loads.shape[1]):
        basis = np.concatenate([modes.shape, found.vectors[j].T], axis=1)
        dynamic = damped * stiffness - omega2 * mass
        answer = basis @ np.linalg.solve(basis.T @ dynamic @ basis, basis.T @ loads[:, j])
        residual = loads[:, j] - dynamic @ answer
        dense = np.linalg.norm(sla.solve_triangular(lower, residual, lower=True))
        y = found.first[j] / (damped - omega2 * found.theta[j])
        assert omega2 * found.beta[j] * abs(found.last[j] @ y) == pytest.approx(dense, rel=1e-5)
        # and the sum of poles is Galerkin's answer
        q = (modes.shape.T @ loads[:, j]) / (modes.eigenvalue * damped - omega2)
        np.testing.assert_allclose(modes.shape @ q + found.vectors[j].T @ y, answer,
                                   atol=1e-9 * np.abs(answer).max())


def test_an_exhausted_space_stops_at_zero(model, modes):
    # a load M phi_k of a left-out mode: its Krylov space has one dimension
    more = model.natural_modes(count=14)
    load = model.mass @ more.shape[:, [12]]
    found = load_vectors(model, modes, load, 3)
    assert np.isfinite(found.vectors).all() and np.isfinite(found.theta).all()
    y = found.first[0] / (1.1j + 1 - 1e5 * found.theta[0])
    expected = more.shape[:, 12] / (more.eigenvalue[12] * (1 + 1.1j) - 1e5)
    np.testing.assert_allclose(found.vectors[0].T @ y, expected, atol=1e-7 * np.abs(expected).max())


def test_no_vector_is_refused(model, modes, loads):
    with pytest.raises(ValueError, match="0 load-dependent vectors are too few"):
        load_vectors(model, modes, loads, 0)
