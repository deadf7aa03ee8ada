"""Condition estimates against dense norms, rounding estimates against what rounding does."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from rom.errors import SolverError
from rom.fullorder import (
    Factorization,
    IllConditionedWarning,
    SecondOrderModel,
    condition_estimate,
    factorize,
    refined_solution,
)
from rom.fullorder.conditioning import rounding_error


def hilbert(n):
    i = np.arange(1, n + 1)
    return sp.csr_array(1.0 / (i[:, None] + i - 1))


@pytest.mark.parametrize("size", [2, 4, 6, 7])
def test_the_condition_of_hilbert_matrices(size):
    # the estimate is a lower bound, exact for small matrices in practice (Higham, section 15.2)
    matrix = hilbert(size)
    exact = np.linalg.cond(matrix.toarray(), 1)
    assert 0.3 * exact <= condition_estimate(matrix, factorize(matrix)) <= exact * (1 + 1e-3)


@pytest.mark.parametrize("frequency", [None, 40.0, 180.0])
def test_the_condition_of_an_elastic_block(block, backend, frequency):
    stiffness, mass = block()
    model = SecondOrderModel(stiffness, mass, backend=backend)
    if frequency is None:
        matrix, estimate = stiffness, condition_estimate(model)
    else:
        matrix = sp.csr_array(stiffness * (1 + 0.01j) - (2 * np.pi * frequency) ** 2 * mass)
        estimate = condition_estimate(matrix, model.harmonic_factorization(frequency, 0.01))
    exact = np.linalg.cond(matrix.toarray(), 1)
    assert exact / 3 <= estimate <= exact * (1 + 1e-6)


def test_the_global_random_generator_is_left_alone(block):
    np.random.seed(3)  # noqa: NPY002 - the generator in question
    expected = np.random.random()  # noqa: NPY002 - as above
    np.random.seed(3)  # noqa: NPY002 - the generator in question
    condition_estimate(block()[0])
    assert np.random.random() == expected  # noqa: NPY002 - as above


def test_sizes_must_fit(block):
    stiffness = block()[0]
    with pytest.raises(ValueError, match="give a matrix and its own"):
        condition_estimate(stiffness[:9, :9], factorize(stiffness))


def test_a_singular_matrix_has_no_condition():
    with pytest.raises(SolverError, match="singular"):
        condition_estimate(sp.csr_array(np.ones((6, 6))))


@pytest.mark.parametrize("distance", [1e-2, 1e-5, 1e-8])
def test_the_rounding_estimate_follows_the_error_near_a_resonance(rod, rng, distance):
    """Relative distance of omega^2 from an eigenvalue known in closed form; the true error is against refinement."""
    body = rod(60)
    shift = body.eigenvalue[2] * (1 + distance)
    matrix = sp.csr_array(body.stiffness - shift * body.mass)
    factor = factorize(matrix)
    force = rng.standard_normal((60, 20))
    u = factor.solve(force)
    exact, own = refined_solution(matrix, force, factor)
    assert np.max(own) < 1e-14
    error = np.linalg.norm(u - exact, axis=0) / np.linalg.norm(exact, axis=0)
    estimate = rounding_error(factor, u, force)
    # a factorization's own errors add to those of the entries: within a hundred below, a thousand above
    assert np.all(error < 100 * estimate) and np.all(estimate < 1000 * np.maximum(error, 2.0**-53))


def relative(u, exact):
    return np.linalg.norm(u - exact) / np.linalg.norm(exact)


def exact_harmonic(model, force, frequency, loss_factor):
    terms = [(1 + 1j * loss_factor, model.stiffness), (-((2 * np.pi * frequency) ** 2), model.mass)]
    exact, own = refined_solution(terms, force, model.harmonic_factorization(frequency, loss_factor))
    assert own < 1e-12
    return exact


@pytest.fixture(scope="module")
def tip_model(small_tip):
    model = SecondOrderModel(small_tip.stiffness, small_tip.mass)
    return model, model.natural_modes(4).frequency_hz


@pytest.mark.parametrize("mode", range(4))
@pytest.mark.parametrize("distance", [1e-3, 1e-6])
def test_near_an_undamped_resonance_an_answer_is_right_or_doubted(small_tip, tip_model, mode, distance):
    """A load in the plane of symmetry leaves no trace of antisymmetric modes in the residual, only in the error."""
    model, frequency = tip_model
    pad = small_tip.mesh.nodes[small_tip.mesh.pad_nodes]
    force = small_tip.normal_force(int(np.argmin(np.abs(pad[:, 1]))))
    near = frequency[mode] + distance
    if distance < 1e-5:  # the last digits of the matrices decide on more than the sixth digit
        with pytest.warns(IllConditionedWarning, match="near a resonance"):
            u = model.solve_harmonic(force, near, 0.0)
    else:
        u = model.solve_harmonic(force, near, 0.0)
    assert relative(u, exact_harmonic(model, force, near, 0.0)) < 1e-7


@pytest.mark.parametrize("fresh", [True, False])
def test_at_an_undamped_resonance_there_is_no_answer_whatever_came_before(small_tip, tip_model, fresh):
    model, frequency = tip_model
    if fresh:
        model = SecondOrderModel(small_tip.stiffness, small_tip.mass)
    else:
        model.solve_harmonic(small_tip.normal_force(0), 50.0, 0.1)
    with pytest.raises(SolverError, match="singular to working precision"):
        model.solve_harmonic(small_tip.normal_force(0), frequency[0], 0.0)
    model.solve_harmonic(small_tip.normal_force(0), 50.0, 0.1)  # and the model lives on


@pytest.mark.parametrize("loss_factor", [1e-5, 2.0])
def test_at_a_damped_resonance_the_answer_is_right(small_tip, tip_model, loss_factor):
    model, frequency = tip_model
    force = small_tip.normal_force(0)
    u = model.solve_harmonic(force, frequency[2], loss_factor)
    assert relative(u, exact_harmonic(model, force, frequency[2], loss_factor)) < 1e-6


@pytest.mark.parametrize("frequency", [0.0, 1e-3, 5000.0])
def test_far_from_resonances_nothing_is_doubted(small_tip, tip_model, frequency):
    model, force = tip_model[0], small_tip.normal_force(0)
    u = model.solve_harmonic(force, frequency, 0.0)
    assert relative(u, exact_harmonic(model, force, frequency, 0.0)) < 1e-9


@pytest.mark.parametrize("formulation", ["full", "b-bar"])
def test_all_extremes_of_the_anatomy_at_once(small_tip, formulation):
    """Nail 17 GPa on hypodermis 0.34 kPa, epidermis 5 um, nu .49999: condition 3e10, and yet the answer is right."""
    anatomy = small_tip.anatomy.replace(epidermis_thickness=0.005)
    anatomy = anatomy.replace_tissue("nail_plate", elastic_modulus=17e3)
    anatomy = anatomy.replace_tissue("hypodermis", elastic_modulus=0.34e-3, poisson_ratio=0.49999)
    anatomy = anatomy.replace_tissue("dermis", poisson_ratio=0.49999)
    tip = replace(small_tip, anatomy=anatomy, formulation=formulation)
    model, force = SecondOrderModel(tip.stiffness), tip.normal_force(0)
    exact, own = refined_solution(model.stiffness, force, model.static_factorization)
    assert own < 1e-12
    assert relative(model.solve_static(force), exact) < 1e-7
    if formulation == "b-bar":
        assert condition_estimate(model) > 1e9


def test_what_doubt_costs(tip_model, small_tip, monkeypatch):
    """One solve more for a factorization, none for a second load on the same."""
    model, calls = tip_model[0], []
    plain = Factorization.solve
    monkeypatch.setattr(Factorization, "solve", lambda self, b: calls.append(np.shape(b)) or plain(self, b))
    model.solve_harmonic(small_tip.normal_force(0), 70.0, 0.2)
    assert len(calls) == 2
    model.solve_harmonic(small_tip.normal_force(1), 70.0, 0.2)
    assert len(calls) == 3


@pytest.mark.parametrize("size", [1e160, 1e300, 1e-200, 1e-306])
def test_forces_of_any_size_are_answered_alike(tip_model, small_tip, size):
    model, force = tip_model[0], small_tip.normal_force(0)
    for solve in (model.solve_static, lambda f: model.solve_harmonic(f, 130.0, 0.2)):
        np.testing.assert_allclose(solve(size * force) / size, solve(force), rtol=1e-6, atol=1e-9)
    both = model.solve_static(np.column_stack([force, size * force, 0 * force]))
    np.testing.assert_allclose(both[:, 1] / size, both[:, 0], rtol=1e-6, atol=1e-9)
    assert not both[:, 2].any()
