"""Z = K (1 + i eta) - omega^2 M on one pattern."""

import numpy as np
import pytest
import scipy.sparse as sp

from rom.fullorder import DynamicStiffness, factorize
from rom.fullorder.pardiso import Pardiso, load_library


def dense(matrix):
    return matrix.to_csc().toarray()


def test_values_are_those_of_the_formula(rod):
    body = rod(9)
    pencil = DynamicStiffness(body.stiffness, body.mass)
    k, m = body.stiffness.toarray(), body.mass.toarray()
    np.testing.assert_allclose(
        dense(pencil.harmonic(200.0, 0.3)), (1 + 0.3j) * k - (2 * np.pi * 200) ** 2 * m, rtol=1e-14
    )
    np.testing.assert_allclose(dense(pencil.shifted(1e6)), k - 1e6 * m, rtol=1e-14)
    assert pencil.shifted(0.0).values.dtype == np.float64
    assert pencil.harmonic(0.0).values.dtype == np.complex128


def test_pattern_is_the_union(rod):
    """K couples neighbours, M ends; K has no entry on one diagonal place."""
    k = sp.csr_array(np.array([[2.0, -1, 0], [-1, 0, 1], [0, 1, 3]]))
    k.eliminate_zeros()
    m = sp.csr_array(np.array([[1.0, 0, 0.5], [0, 1, 0], [0.5, 0, 1]]))
    pencil = DynamicStiffness(k, m)
    matrices = [pencil.shifted(0.0), pencil.shifted(2.0), pencil.harmonic(3.0, 0.1)]
    assert all(matrix.same_pattern(matrices[0]) and len(matrix.values) == 6 for matrix in matrices)
    np.testing.assert_array_equal(dense(matrices[1]), (k - 2 * m).toarray())


def test_loss_factors_by_tissue(rod):
    body = rod(8)
    soft, hard = body.stiffness * 0.25, body.stiffness * 0.75
    together = DynamicStiffness(soft * (1 + 0.1j) + hard * (1 + 0.4j), body.mass).harmonic(100.0)
    one = DynamicStiffness(body.stiffness, body.mass).harmonic(100.0, 0.25 * 0.1 + 0.75 * 0.4)
    np.testing.assert_allclose(dense(together), dense(one), rtol=1e-13)
    # a further loss factor of the whole body adds to each tissue's
    more = DynamicStiffness(body.stiffness * (1 + 0.2j), body.mass).harmonic(100.0, 0.05)
    np.testing.assert_allclose(
        dense(more), dense(DynamicStiffness(body.stiffness, body.mass).harmonic(100.0, 0.25)), rtol=1e-13)


def test_product_from_one_triangle(block, rng):
    k, m = block()
    matrix = DynamicStiffness(k, m).harmonic(50.0, 0.1)
    for x in (rng.standard_normal(k.shape[0]), rng.standard_normal((k.shape[0], 2))):
        np.testing.assert_allclose(matrix.product(x), dense(matrix) @ x, rtol=1e-11, atol=1e-9)


@pytest.mark.skipif(load_library() is None, reason="no oneMKL runtime here")
def test_symbolic_phase_runs_once(block, monkeypatch):
    calls = []
    analyse = Pardiso.analyse
    monkeypatch.setattr(Pardiso, "analyse", lambda self, values: (calls.append(1), analyse(self, values)))
    pencil = DynamicStiffness(*block())
    factor = factorize(pencil.harmonic(30.0, 0.1), backend="pardiso")
    for frequency in (0.0, 30.0, 150.0, 400.0):
        for loss_factor in (0.05, 0.6):
            factor.refactorize(pencil.harmonic(frequency, loss_factor))
    assert len(calls) == 1


def test_refusals(rod):
    body = rod(8)
    pencil = DynamicStiffness(body.stiffness, body.mass)
    for case in ((-1.0, 0.1), (np.nan, 0.1), (10.0, -0.1), (10.0, np.inf)):
        with pytest.raises(ValueError, match="at least 0"):
            pencil.harmonic(*case)
    with pytest.raises(ValueError, match="finite"):
        pencil.shifted(np.inf)
    with pytest.raises(ValueError, match="same dofs"):
        DynamicStiffness(body.stiffness, rod(9).mass)
    with pytest.raises(ValueError, match="mass matrix is complex"):
        DynamicStiffness(body.stiffness, body.mass * 1j)
