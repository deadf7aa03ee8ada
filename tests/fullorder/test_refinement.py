"""Refined solutions against exact rational arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse as sp

from rom.fullorder import factorize, refined_solution


def exact_solution(matrix, rhs):
    """Gauss-Jordan elimination in fractions of the doubles as stored."""
    rows = [[Fraction(float(a)) for a in row] + [Fraction(float(b))] for row, b in zip(matrix, rhs, strict=True)]
    n = len(rows)
    for i in range(n):
        pivot = next(j for j in range(i, n) if rows[j][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [a / rows[i][i] for a in rows[i]]
        for j in range(n):
            if j != i and rows[j][i]:
                rows[j] = [a - rows[j][i] * b for a, b in zip(rows[j], rows[i], strict=True)]
    return np.array([float(row[-1]) for row in rows])


@pytest.mark.parametrize("size", [3, 5, 6, 7])
def test_hilbert_matrices(size):
    i = np.arange(1, size + 1)
    dense = 1.0 / (i[:, None] + i - 1)
    matrix = sp.csr_array(dense)
    factor = factorize(matrix)
    rhs = np.eye(size)[:, 0] - 2 * np.eye(size)[:, -1]
    exact = exact_solution(dense, rhs)
    refined, error = refined_solution(matrix, rhs, factor)
    assert np.linalg.norm(refined - exact) <= 2.0**-52 * np.linalg.norm(exact)
    assert error <= 2.0**-52
    if size > 5:  # and plain solves are indeed further off
        assert np.linalg.norm(factor.solve(rhs) - exact) > 1e-12 * np.linalg.norm(exact)


def test_whole_numbers_many_columns(rng):
    dense = rng.integers(-9, 10, (9, 9))
    dense = (dense + dense.T + 40 * np.diag(np.arange(-4, 5) ** 3)).astype(float)
    matrix = sp.csr_array(dense)
    rhs = rng.integers(-99, 100, (9, 3)).astype(float)
    refined, error = refined_solution(matrix, rhs, factorize(matrix))
    exact = np.column_stack([exact_solution(dense, column) for column in rhs.T])
    np.testing.assert_allclose(refined, exact, rtol=3e-16)
    assert error.shape == (3,) and np.max(error) <= 2.0**-52


def test_a_complex_sum_is_never_rounded(rod):
    """K (1 + i eta) - omega^2 M at a resonance, against the same system as one of twice the size in fractions."""
    body = rod(6)
    stiffness, mass, eta = body.stiffness.toarray(), body.mass.toarray(), 1e-9
    square = body.eigenvalue[1]
    rhs = np.arange(1.0, 7.0)
    f = np.vectorize(Fraction)
    real, loss = f(stiffness) - Fraction(float(square)) * f(mass), Fraction(eta) * f(stiffness)
    double = np.block([[real, -loss], [loss, real]])
    # fractions enter as they are: exact_solution would round the entries
    rows = [list(row) + [Fraction(float(b))] for row, b in zip(double, np.concatenate([rhs, 0 * rhs]), strict=True)]
    for i in range(12):
        rows[i] = [a / rows[i][i] for a in rows[i]]
        for j in range(12):
            if j != i:
                rows[j] = [a - rows[j][i] * b for a, b in zip(rows[j], rows[i], strict=True)]
    exact = np.array([float(row[-1]) for row in rows])
    exact = exact[:6] + 1j * exact[6:]
    factor = factorize(sp.csr_array(body.stiffness * (1 + 1j * eta) - square * body.mass))
    refined, error = refined_solution([(1 + 1j * eta, body.stiffness), (-square, body.mass)], rhs, factor)
    assert np.linalg.norm(refined - exact) <= 1e-15 * np.linalg.norm(exact)
    assert error <= 2.0**-50
    assert np.linalg.norm(factor.solve(rhs) - exact) > 1e-9 * np.linalg.norm(exact)


def test_a_foreign_factor_is_admitted_or_owned_up_to(rod, rng):
    body, rhs = rod(20), rng.standard_normal(20)
    near, far = factorize(1.3 * body.stiffness), factorize(sp.csr_array(-body.stiffness))
    expected = np.linalg.solve(body.stiffness.toarray(), rhs)
    refined, error = refined_solution(body.stiffness, rhs, near)
    np.testing.assert_allclose(refined, expected, rtol=1e-11)
    assert error < 1e-9
    assert refined_solution(body.stiffness, rhs, far)[1] == np.inf


def test_zero_load_and_sizes(rod):
    body = rod(8)
    factor = factorize(body.stiffness)
    refined, error = refined_solution(body.stiffness, np.zeros(8), factor)
    assert not refined.any() and error <= 2.0**-53
    with pytest.raises(ValueError, match="same size"):
        refined_solution(body.stiffness, np.zeros(7), factor)
