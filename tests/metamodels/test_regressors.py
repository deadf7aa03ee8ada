"""Regressors keep plain arrays: what they answer from those is what scikit-learn's own models answer."""

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesRegressor

from rom.datasets import carve_validation
from rom.metamodels import create
from rom.metamodels.regressors import REGRESSORS, TREES, ExtraTrees


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(0)
    features = rng.uniform(size=(90, 5))
    return features, smooth(features)


def smooth(x):
    return np.column_stack([np.sin(3 * x[:, 0]) + x[:, 3], x[:, 1] * x[:, 4], np.ones(len(x))])


@pytest.mark.parametrize("leaf", [1, 4])
def test_trees_answer_as_scikit_learn(data, leaf):
    features, target = data
    found = ExtraTrees()
    found._learn(features, target, {"leaf": leaf})
    size = np.linalg.norm(target, axis=1)
    expected = ExtraTreesRegressor(TREES, min_samples_leaf=leaf, random_state=0)
    expected.fit(features, target, sample_weight=(size.mean() / size) ** 2)
    asked = np.random.default_rng(1).uniform(size=(40, 5))
    np.testing.assert_allclose(found.predict(asked), expected.predict(asked), rtol=1e-10)


@pytest.mark.parametrize("name", REGRESSORS)
def test_arrays_alone_give_the_answers(data, name):
    features, target = data
    found = REGRESSORS[name]()
    found.fit(features, target, *carve_validation(len(features)))
    assert set(found.arrays) == set(found.stored)
    again = REGRESSORS[name]()
    again.arrays = {key: np.array(found.arrays[key]) for key in found.stored}
    asked = np.random.default_rng(1).uniform(size=(40, 5))
    np.testing.assert_array_equal(again.predict(asked), found.predict(asked))
    truth = smooth(asked)
    miss = np.linalg.norm(found.predict(asked) - truth, axis=1) / np.linalg.norm(truth, axis=1)
    assert np.median(miss) < 0.5 * np.median(np.linalg.norm(truth - target.mean(axis=0), axis=1))  # it learnt something


@pytest.mark.parametrize(("settings", "text"), [
    ({"regressor": "oracle"}, "regressor='oracle' is unknown: choose one of ridge, knn, gp, extra-trees"),
    ({"regressor": "knn", "width": 0.3}, "width and ridge are settings of the regressor ridge, not of knn"),
    ({"regressor": None}, "regressor=None is unknown")])
def test_settings_that_cannot_be_are_refused(harmonic, settings, text):
    with pytest.raises(ValueError, match=text):
        create("pod-regression", harmonic, **settings)


def test_static_forces_take_what_is_linear_in_them(static):
    with pytest.raises(ValueError, match="regressor='gp' is not linear in several forces: static-point"):
        create("pod-regression", static, regressor="gp")
