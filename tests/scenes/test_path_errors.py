"""Errors of load paths, against numbers worked out by hand."""

import numpy as np
import pytest

from rom.scenes.path_answers import DEFINITIONS, path_errors
from rom.scenes.paths import PathArrays

PATHS = PathArrays(*(np.array([value]) for value in (0, 3000.0, 1e6, 0.8, 0.5)))


def displacement_errors(answer, truth):
    return path_errors(PATHS, {"displacement": answer}, {"displacement": truth})["displacement"]


def test_displacement_error_is_over_all_nodes_of_a_state():
    truth = np.zeros((1, 2, 2, 2))
    truth[0, :, 0, 0], truth[0, :, 1, 1] = 3e-3, 4e-3  # length 5 mm
    answer = truth.copy()
    answer[0, 1, 1, 1] += 1e-3
    assert displacement_errors(answer, truth) == pytest.approx(np.array([[0.0, 0.2]]), abs=1e-15)


def test_no_answer_is_an_unbounded_error_and_no_truth_is_no_error():
    truth = np.ones((1, 3, 1, 2))
    answer = truth.copy()
    answer[0, 1] = np.nan
    truth[0, 2] = np.nan
    found = displacement_errors(answer, truth)
    assert found[0, 0] == 0.0
    assert found[0, 1] == np.inf
    assert np.isnan(found[0, 2])


def test_contact_errors_follow_their_definitions():
    truth = {"displacement": np.ones((1, 1, 1, 2)), "tangential_force": np.array([[0.1]]),
             "contact_area": np.array([[4e-5]]), "normal_displacement": np.array([[8e-4]]),
             "pressure": np.array([[[3e3, 4e3]]])}
    answer = {"displacement": np.ones((1, 1, 1, 2)), "tangential_force": np.array([[0.12]]),
              "contact_area": np.array([[3e-5]]), "normal_displacement": np.array([[1e-3]]),
              "pressure": np.array([[[3e3, 5e3]]])}
    first, *others = path_errors(PATHS, answer, truth).items()
    assert first[0] == "displacement" and first[1] == 0.0
    # .02 N of .5 N; a quarter of the area; 1 of 5 kPa; a quarter of the approach
    assert {name: error[0, 0] for name, error in others} == pytest.approx(
        {"tangential force": 0.04, "contact area": 0.25, "pressure": 0.2, "approach": 0.25})
    assert set(DEFINITIONS) == {name for name, _ in others}
