"""Errors of cases and what is told of them; each number by hand."""

import numpy as np
import pytest
import scipy.sparse as sp

from rom.comparison.errors import energy_errors, statistics
from rom.relative import relative_errors


def test_relative_errors_by_hand():
    truth = np.array([[3.0, 4.0], [0.0, 2.0]])
    answers = np.array([[3.0, 4.5], [0.0, 2.0]])
    np.testing.assert_allclose(relative_errors(answers, truth), [0.1, 0.0])  # .5 / 5


def test_complex_errors_count_the_phase():
    truth = np.array([[3 + 4j]])
    np.testing.assert_allclose(relative_errors(truth * 1j, truth), [np.sqrt(2)])  # |i - 1|
    np.testing.assert_allclose(relative_errors(np.abs(truth), truth), [np.sqrt(20) / 5])  # |5 - 3 - 4i| / 5


def test_zero_truth_is_infinitely_wrong_or_exact():
    truth = np.zeros((2, 3))
    answers = np.array([[0.0, 0.0, 0.0], [0.0, 1e-300, 1.0]])
    np.testing.assert_array_equal(relative_errors(answers, truth), [0.0, np.inf])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_answers_that_are_not_finite_are_infinitely_wrong(value):
    truth = np.ones((2, 2))
    answers = truth.copy()
    answers[1, 0] = value
    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(relative_errors(answers, truth), [0.0, np.inf])


def test_energy_errors_by_hand():
    stiffness = sp.csr_array(np.array([[2.0, -1.0], [-1.0, 3.0]]))
    truth = np.array([[1.0, 1.0]])
    # e = (1, 2): 2 - 4 + 12 = 10; and with imaginary part (1, 0): + 2
    np.testing.assert_allclose(energy_errors(truth + [1.0, 2.0], truth, stiffness), [np.sqrt(10)])
    np.testing.assert_allclose(energy_errors(truth + [1.0 + 1j, 2.0], truth, stiffness), [np.sqrt(12)])


def test_statistics():
    errors = np.random.default_rng(0).permutation(np.arange(1.0, 102.0))  # 1 ... 101
    assert statistics(errors) == (101.0, 96.0, 51.0)
    assert statistics(np.array([0.3])) == (0.3, 0.3, 0.3)
    assert statistics(np.array([1.0, np.inf, np.inf])) == (np.inf, np.inf, np.inf)
    assert statistics(np.array([1.0, 2.0, np.inf]))[2] == 2.0
    assert np.isnan(statistics(np.empty(0))).all()
