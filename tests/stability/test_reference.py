"""The reference knows more digits than a double-precision solve, and says when it does not."""

import numpy as np
import pytest
import scipy.sparse as sp
from atlas.reference import energy_norm, refined, true_answer

from rom.errors import SolverError
from rom.fullorder import SecondOrderModel
from rom.scenes import CaseArrays


def ill_conditioned(n=10):
    """Integers: the inverse of a Pascal matrix is known exactly, its condition number is 4e9 at n = 10."""
    from scipy.linalg import invpascal, pascal

    return pascal(n, exact=True).astype(float), invpascal(n, exact=True).astype(float)


def test_the_reference_of_an_ill_conditioned_matrix_is_exact_to_the_last_digit():
    matrix, inverse = ill_conditioned()
    model = SecondOrderModel(sp.csr_array(matrix), backend="superlu")
    u, condition = refined(model, np.eye(10)[0], None)
    np.testing.assert_allclose(u, inverse[:, 0], rtol=1e-15)
    assert condition == pytest.approx(np.linalg.norm(matrix, 1) * np.linalg.norm(inverse, 1), rel=1e-6)


def test_a_singular_matrix_has_no_truth():
    model = SecondOrderModel(sp.csr_array(np.diag([1.0, 2.0])), sp.csr_array(np.eye(2)), backend="superlu")
    with pytest.raises(SolverError):
        refined(model, np.ones(2), (1.0 / (2 * np.pi), 0.0))


def test_the_energy_norm_of_any_size():
    model = SecondOrderModel(sp.csr_array(np.diag([4.0, 9.0])), backend="superlu")
    for size in (1.0, 1e-200, 1e200):
        assert energy_norm(model, size * np.array([1.0, 1j])) == pytest.approx(size * 13**0.5)
    assert energy_norm(model, np.zeros(2)) == 0.0
    assert np.isnan(energy_norm(model, np.array([np.inf, 0.0])))


def test_cancelling_forces_are_measured_against_the_single_answers(patches):
    case = CaseArrays(np.zeros((1, 2), dtype=int), np.array([[1.0, -1.0 + 1e-6]]), np.array([100.0]), np.array([0.1]))
    truth = true_answer(patches.model, patches, case, cancels=True)
    assert truth.own_size / truth.size == pytest.approx(0.5e-6, rel=1e-3)  # 1e-6 left of two
