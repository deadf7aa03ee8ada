"""Static and harmonic response against closed forms and dense solves; power balance and reciprocity."""

import numpy as np
import pytest

from rom.errors import SolverError
from rom.fullorder import SecondOrderModel
from rom.fullorder.factorization import Factorization
from rom.fullorder.products import real_times

#: What direct solves must reach on blocks of condition 1e5: rounding (2e-16) times condition.
RESIDUAL = 1e-11


def point_load(n, *dofs):
    force = np.zeros((n, len(dofs)))
    force[list(dofs), range(len(dofs))] = 0.1
    return force


def test_static_rod_is_two_straight_lines(rod, backend):
    body = rod(60)
    model = SecondOrderModel(body.stiffness, backend=backend)
    for j in (0, 17, 59):
        u = model.solve_static(point_load(60, j)[:, 0])
        np.testing.assert_allclose(u, 0.1 * body.green(j), rtol=1e-11)  # analytic


def test_harmonic_rod_is_its_modal_sum(rod, backend):
    """Analytic: all n modes in closed form, u = sum phi phi^T f / (lambda (1 + i eta) - omega^2)."""
    body = rod(60)
    model = SecondOrderModel(body.stiffness, body.mass, backend=backend)
    force = point_load(60, 17, 40)
    for frequency, eta in ((0.0, 0.1), (body.frequency_hz[0], 0.1), (body.frequency_hz[3], 0.5), (300.0, 0.05)):
        amplification = 1 / (body.eigenvalue * (1 + 1j * eta) - (2 * np.pi * frequency) ** 2)
        exact = body.shape @ (amplification[:, None] * (body.shape.T @ force))
        u = model.solve_harmonic(force, frequency, eta)
        assert u.dtype == np.complex128
        np.testing.assert_allclose(u, exact, rtol=1e-9, atol=1e-11 * np.abs(exact).max())


def test_harmonic_block_equals_dense_solve_and_residual_is_small(block, backend):
    k, m = block()
    model = SecondOrderModel(k, m, backend=backend)
    force = point_load(model.n, 5, 100) * np.array([1, 1 - 2j])
    for frequency, eta in ((20.0, 0.1), (90.0, 0.3), (250.0, 0.05)):
        u = model.solve_harmonic(force, frequency, eta)
        z = k.toarray() * (1 + 1j * eta) - (2 * np.pi * frequency) ** 2 * m.toarray()
        exact = np.linalg.solve(z, force)
        assert np.linalg.norm(u - exact) <= 1e-10 * np.linalg.norm(exact)
        assert np.all(model.residual(u, force, frequency, eta) <= RESIDUAL)
        assert np.all(model.residual(1.01 * u, force, frequency, eta) > 0.009)  # Z (1.01 u) - f = .01 f
        assert np.all(model.residual(u, force, frequency, eta + 0.05) > 1e-3)


def test_static_residual_and_many_columns(block, backend):
    k, _ = block()
    model = SecondOrderModel(k, backend=backend)
    force = point_load(model.n, 3, 77, 120)
    u = model.solve_static(force)
    assert u.dtype == np.float64 and np.all(model.residual(u, force) <= RESIDUAL)
    np.testing.assert_allclose(model.residual(np.zeros_like(u), force), 1.0, rtol=1e-15)  # by definition
    for i in range(3):
        np.testing.assert_allclose(model.solve_static(force[:, i]), u[:, i], rtol=1e-10, atol=1e-13 * np.abs(u).max())


def test_one_complex_variable(block):
    """u(f, eta) = v(s) / (1 + i eta) with s = omega^2 / (1 + i eta): two cases of one s are proportional."""
    k, m = block()
    model = SecondOrderModel(k, m)
    force = point_load(model.n, 50)[:, 0]
    static = model.solve_static(force)
    for eta in (0.1, 0.5):
        u = model.solve_harmonic(force, 0.0, eta)
        assert np.linalg.norm(u - static / (1 + 1j * eta)) <= 1e-10 * np.linalg.norm(u)


def test_receptance_is_reciprocal(block, backend):
    """Maxwell-Betti: u_j under f_i equals u_i under f_j, as Z is symmetric."""
    model = SecondOrderModel(*block(), backend=backend)
    dofs = [4, 61, 118]
    u = model.solve_harmonic(point_load(model.n, *dofs), 80.0, 0.1)[dofs]
    np.testing.assert_allclose(u, u.T, rtol=1e-9)
    assert np.all(np.diag(u).imag < 0)  # the displacement lags behind its force


def test_power_put_in_is_dissipated(block, rng):
    """Imaginary part of u^H (Z u - f) = 0."""
    model = SecondOrderModel(*block())
    force = rng.standard_normal((model.n, 3)) + 1j * rng.standard_normal((model.n, 3))
    for frequency, eta in ((15.0, 0.1), (120.0, 0.5)):
        u = model.solve_harmonic(force, frequency, eta)
        put_in, lost = model.input_power(force, u, frequency), model.dissipated_power(u, frequency, eta)
        assert put_in.shape == (3,) and np.all(lost > 0)
        np.testing.assert_allclose(put_in, lost, rtol=1e-9)
    assert model.dissipated_power(u[:, 0], 120.0, 0.0) == 0.0


def test_power_of_one_dof(rod):
    """Analytic: a single spring-mass at resonance, u = f / (i eta k), P = omega f^2 / (2 eta k)."""
    body = rod(2)
    k, m = body.stiffness[:1, :1], body.mass[:1, :1]
    frequency = np.sqrt(k[0, 0] / m[0, 0]) / (2 * np.pi)
    model = SecondOrderModel(k, m)
    u = model.solve_harmonic([0.1], frequency, 0.2)
    np.testing.assert_allclose(u, [0.1 / (0.2j * k[0, 0])], rtol=1e-10)
    power = 2 * np.pi * frequency * 0.1**2 / (2 * 0.2 * k[0, 0])
    np.testing.assert_allclose(model.input_power([0.1], u, frequency), power, rtol=1e-10)
    np.testing.assert_allclose(model.dissipated_power(u, frequency, 0.2), power, rtol=1e-10)


def test_factors_are_kept_or_made_afresh_as_asked(block, monkeypatch):
    made = []
    original = Factorization._factorize
    monkeypatch.setattr(
        Factorization, "_factorize", lambda self, **options: (made.append(options), original(self, **options))
    )
    model = SecondOrderModel(*block())
    force = point_load(model.n, 5)[:, 0]
    assert made == []  # nothing is done before it is needed

    def count(call):
        made.clear()
        call()
        return len(made)

    assert count(lambda: model.solve_static(force)) == 1
    assert count(lambda: model.solve_static(force)) == 0
    assert count(lambda: model.solve_static(force, reuse_factor=False)) == 1
    assert count(lambda: model.solve_harmonic(force, 50.0, 0.1)) == 1
    assert count(lambda: model.solve_harmonic(force, 50.0, 0.1)) == 0
    assert count(lambda: model.solve_harmonic(force, 50.0, 0.1, reuse_factor=False)) == 1
    assert count(lambda: model.solve_harmonic(force, 50.0, 0.2)) == 1
    assert made == [{}]  # the symbolic phase was reused
    assert count(lambda: model.solve_harmonic(force, 60.0, 0.2)) == 1
    assert count(lambda: model.solve_static(force)) == 0


def test_poor_solution_is_refined_once(block, monkeypatch):
    model = SecondOrderModel(block()[0])
    force = point_load(model.n, 5)[:, 0]
    exact = model.solve_static(force)
    solve = Factorization.solve
    monkeypatch.setattr(Factorization, "solve", lambda self, b: solve(self, b) * (1 + 1e-7))
    u = model.solve_static(force)
    assert model.residual(u, force) <= RESIDUAL  # (1e-7)^2 by one step
    np.testing.assert_allclose(u, exact, rtol=1e-9, atol=1e-11 * np.abs(exact).max())
    monkeypatch.setattr(Factorization, "solve", lambda self, b: solve(self, b) * 0.9)
    with pytest.raises(SolverError, match="residual"):
        model.solve_static(force)


def test_undamped_resonance_is_refused(rod, backend):
    body = rod(30)
    model = SecondOrderModel(body.stiffness, body.mass, backend=backend)
    with pytest.raises(SolverError, match="singular"):
        model.solve_harmonic(point_load(30, 11)[:, 0], body.frequency_hz[0], 0.0)
    # A failed case leaves nothing behind.
    u = model.solve_harmonic(point_load(30, 11)[:, 0], body.frequency_hz[0], 0.1)
    assert model.residual(u, point_load(30, 11)[:, 0], body.frequency_hz[0], 0.1) <= RESIDUAL


def test_free_body_is_refused(block, backend):
    model = SecondOrderModel(block(held=False)[0], backend=backend)
    with pytest.raises(SolverError, match="rigid"):
        model.solve_static(np.ones(model.n))


def test_statics_needs_no_mass_and_dynamics_says_so(block):
    model = SecondOrderModel(block()[0])
    force = np.ones(model.n)
    for call in (
        lambda: model.mass,
        lambda: model.solve_harmonic(force, 10.0, 0.1),
        lambda: model.natural_modes(count=2),
        lambda: model.residual(force, force, 10.0, 0.1),
    ):
        with pytest.raises(ValueError, match="no mass matrix"):
            call()


def test_zero_force_gives_zero(block):
    model = SecondOrderModel(*block())
    zero = np.zeros(model.n)
    assert not np.any(model.solve_static(zero)) and not np.any(model.solve_harmonic(zero, 10.0, 0.1))
    assert model.residual(zero, zero) == 0.0
    assert model.residual(np.ones(model.n), zero) == np.inf
    assert model.solve_static(np.zeros((model.n, 0))).shape == (model.n, 0)


def test_refusals(block, rod):
    k, m = block()
    model = SecondOrderModel(k, m)
    force = np.ones(model.n)
    for call, words in (
        (lambda: SecondOrderModel(k * (1 + 0.1j), m), "complex"),
        (lambda: SecondOrderModel(k, rod(9).mass), "same dofs"),
        (lambda: SecondOrderModel(k.toarray()), "sparse"),
        (lambda: SecondOrderModel(None), "sparse"),
        (lambda: SecondOrderModel(k, backend="fast"), "'fast'"),
        (lambda: model.solve_static(force[1:]), "shape"),
        (lambda: model.solve_static(force * np.nan), "NaN"),
        (lambda: model.solve_harmonic(force, -1.0, 0.1), "frequency"),
        (lambda: model.solve_harmonic(force, 1.0, np.nan), "loss factor"),
        (lambda: model.residual(force, force[:, None]), "equal"),
        (lambda: model.residual(force, force, loss_factor=0.1), "without a frequency"),
        (lambda: model.dissipated_power(force, 10.0, -0.1), "loss factor"),
        (lambda: model.input_power(force, force[1:], 10.0), "shape"),
    ):
        with pytest.raises(ValueError, match=words):
            call()


def test_products_with_real_matrices_stay_real(block, rng):
    k, _ = block()
    for shape in ((k.shape[0],), (k.shape[0], 3)):
        u = np.asfortranarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
        np.testing.assert_allclose(real_times(k, u), k.toarray() @ u, rtol=1e-10, atol=1e-9)
