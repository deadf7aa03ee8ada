"""Energy norms enclose exact ones (fractions); counts of negative eigenvalues are refused where rounding decides."""

from fractions import Fraction

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp

from rom.errors import SolverError
from rom.fullorder import SecondOrderModel
from rom.fullorder.energy_norm import EnergyNorm, block_product, gamma
from rom.fullorder.factorization import Factorization
from rom.fullorder.inertia import count_negative
from rom.fullorder.symmetric import symmetric_matrix


@pytest.fixture
def energy(block):
    return EnergyNorm(SecondOrderModel(*block()))


def exact_square(matrix, field):
    """x^T K x without rounding."""
    numbers = [Fraction(float(x)) for x in field]
    rows = sp.coo_array(matrix)
    return sum(Fraction(float(value)) * numbers[i] * numbers[j]
               for i, j, value in zip(rows.row, rows.col, rows.data, strict=True))


def test_floor_and_spread_enclose_the_scaled_spectrum(energy):
    root = np.sqrt(energy.diagonal)
    value = sla.eigh(energy.model.stiffness.toarray() / np.outer(root, root), eigvals_only=True)
    assert 0.3 * value[0] < energy.floor < value[0]  # within the factor of 0.6 that is tried, and of the estimate
    assert value[-1] < energy.spread
    size = np.linalg.eigvalsh(np.abs(energy.model.stiffness.toarray()) / np.outer(root, root))[-1]
    assert size <= energy.spread < 1.1 * size


def test_norms_enclose_the_exact_one(energy, rng):
    fields = rng.standard_normal((3, energy.model.n)) * [[1.0], [1e-60], [1e60]]
    least, most = energy.norms(fields)
    for field, low, high in zip(fields, least, most, strict=True):
        exact = exact_square(energy.model.stiffness, field)
        assert Fraction(float(low)) ** 2 <= exact <= Fraction(float(high)) ** 2
        assert high < 1.000001 * low


def test_dual_norms_are_bounds(energy, rng):
    response = rng.standard_normal((2, energy.model.n))
    residual = energy.image(response)  # its dual norm is the energy norm of the response, but for one product
    _, miss, norm = energy.dual(residual)
    least, most = energy.norms(response)
    assert (least <= norm).all() and (norm <= 1.0001 * most).all()
    assert (energy.plain_dual(residual) >= least).all()
    assert (miss < 1e-6 * norm).all()


def test_nothing_has_no_norm_even_where_no_floor_is_proven(energy, monkeypatch):
    monkeypatch.setitem(energy.__dict__, "floor", 0.0)
    assert energy.reach == np.inf
    np.testing.assert_array_equal(energy.plain_dual(np.array([np.zeros(energy.model.n), np.ones(energy.model.n)])),
                                  [0.0, np.inf])


def test_a_hopeless_stiffness_has_no_floor():
    # two dofs joined by a spring 1e17 times stiffer than the one that holds them: rounding swallows the hold
    matrix = np.array([[1e17, -1e17], [-1e17, 1e17]]) + np.diag([1.0, 0.0])
    with pytest.raises(SolverError):
        _ = EnergyNorm(SecondOrderModel(sp.csr_array(matrix))).floor


def test_block_products_count_their_roundings(rng):
    rows, columns = rng.standard_normal((3, 1000)), rng.standard_normal((1000, 2))
    product, terms = block_product(rows, columns)
    np.testing.assert_allclose(product, rows @ columns, rtol=1e-12, atol=1e-12)
    assert terms <= 2 * np.sqrt(1000) + 2
    assert gamma(1e17) == np.inf


def test_count_negative(rng):
    root = rng.standard_normal((30, 30))
    value = np.r_[-np.arange(1.0, 8.0), np.arange(1.0, 24.0)]
    turn = np.linalg.qr(root)[0]
    matrix = turn * value @ turn.T
    assert count_negative(symmetric_matrix(sp.csr_array((matrix + matrix.T) / 2)), np.ones(30)) == 7


def test_a_count_that_rounding_may_have_changed_is_refused(monkeypatch, rng):
    solve = Factorization.solve
    monkeypatch.setattr(Factorization, "solve", lambda self, b: solve(self, b) * (
        1 + 1e-3 * rng.standard_normal(b.shape)))
    with pytest.raises(SolverError, match="may hide the signs"):
        count_negative(symmetric_matrix(sp.csr_array(np.diag([1.0, -2.0, 3.0]))), np.ones(3))
