"""Errors of load paths, against numbers worked out by hand."""

import numpy as np
import pytest
from rom.comparison.path_errors import DEFINITIONS, QUANTITIES, contact_errors, displacement_errors


def test_displacement_error_is_over_all_nodes_of_a_state():
    truth = np.zeros((1, 2, 2, 2))
    truth[0, :, 0, 0], truth[0, :, 1, 1] = 3e-3, 4e-3  # length 5 mm
    answer = truth.copy()
    answer[0, 1, 1, 1] += 1e-3
    found = displacement_errors(answer, truth, np.ones((1, 2), dtype=bool))
    assert found == pytest.approx(np.array([[0.0, 0.2]]), abs=1e-15)


def test_no_answer_is_an_unbounded_error_and_no_truth_is_no_error():
    truth = np.ones((1, 3, 1, 2))
    answer = truth.copy()
    answer[0, 1] = np.nan
    truth[0, 2] = np.nan
    found = displacement_errors(answer, truth, np.array([[True, True, False]]))
    assert found[0, 0] == 0.0
    assert found[0, 1] == np.inf
    assert np.isnan(found[0, 2])


def test_contact_errors_follow_their_definitions():
    truth = {"tangential_force": np.array([[0.1]]), "contact_area": np.array([[4e-5]]),
             "normal_displacement": np.array([[8e-4]]), "pressure": np.array([[[3e3, 4e3]]]),
             "reached": np.array([[True]])}
    answer = {"tangential_force": np.array([[0.12]]), "contact_area": np.array([[3e-5]]),
              "normal_displacement": np.array([[1e-3]]), "pressure": np.array([[[3e3, 5e3]]])}
    found = contact_errors(answer, truth, np.array([0.5]))
    # .02 N of .5 N; a quarter of the area; 1 of 5 kPa; a quarter of the approach
    assert dict(zip(QUANTITIES, found[0, 0], strict=True)) == pytest.approx(
        {"tangential force": 0.04, "contact area": 0.25, "pressure": 0.2, "approach": 0.25})
    assert set(DEFINITIONS) == set(QUANTITIES)
