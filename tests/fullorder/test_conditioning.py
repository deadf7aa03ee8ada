"""Condition estimates against dense norms, rounding estimates against what rounding does."""

import numpy as np
import pytest
import scipy.sparse as sp

from rom.errors import SolverError
from rom.fullorder import SecondOrderModel, condition_estimate, factorize, refined_solution
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
    estimate = rounding_error(factor, matrix, u, force)
    # a factorization's own errors add to those of the entries: within a hundred below, a thousand above
    assert np.all(error < 100 * estimate) and np.all(estimate < 1000 * np.maximum(error, 2.0**-53))
