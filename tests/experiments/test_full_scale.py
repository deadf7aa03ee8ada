"""Errors from Gram matrices are those of whole fields; tables and parts of the whole grid."""

from __future__ import annotations

import numpy as np
import pytest
from full_scale.errors_by import Table, largest_by
from full_scale.network_errors import network_errors
from full_scale.static import additive_errors

from rom.datasets import draw_combinations, superposed, unit_responses
from rom.datasets.reduced import ReducedField
from rom.datasets.whole import make_whole_dataset
from rom.metamodels import create
from rom.relative import relative_errors

SETTINGS = {"mlp": {"rank": 20, "terms": 8, "width": 8, "steps": 2},
            "mlp-residual": {"modes": 8, "rank": 12, "terms": 2, "width": 8, "steps": 2},
            "pole-network": {"rank": 20, "poles": 6, "steps": 2, "precision": "float64"}}


@pytest.fixture(scope="module")
def stored(tiny_harmonic, tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "whole.nc"
    return make_whole_dataset(tiny_harmonic, path, beyond=True, confirm=8)


@pytest.mark.parametrize("method", list(SETTINGS))
def test_errors_of_stored_cases_are_those_of_whole_fields(method, tiny_harmonic, stored):
    field = ReducedField(stored)
    rng = np.random.default_rng(3)
    model = create(method, tiny_harmonic, **SETTINGS[method]).fit_stored(
        stored, np.sort(rng.choice(tiny_harmonic.n_published, 1500, replace=False)))
    cases = rng.choice(len(field), 60, replace=False)
    expected = relative_errors(model.evaluate(field.arrays(cases), "field"), field.fields(cases))
    assert expected.max() > 1e-4
    np.testing.assert_allclose(network_errors(model, field, cases), expected, rtol=2e-3)


def test_errors_of_added_answers_are_those_of_whole_fields(static, data_of):
    model = create("transformer", static, width=16, heads=2, steps=30).fit(data_of[static.name].isel(case=slice(8)))
    _, cases = draw_combinations(static, 0, seed=2, held_out=200)
    responses = unit_responses(static)
    expected = np.concatenate([relative_errors(model.evaluate(cases.take(index), "field"), truth)
                               for index, truth in superposed(responses, cases)])
    assert expected.max() > 1e-4
    np.testing.assert_allclose(additive_errors(model, cases, responses), expected, rtol=1e-3, atol=1e-6)


def test_largest_errors_by_value():
    found = largest_by(np.array([0.1, 0.4, 0.2]), np.array([2.0, 2.0, 5.0]), np.array([1.0, 2.0, 5.0]))
    np.testing.assert_array_equal(found, [np.nan, 0.4, 0.2])


def test_a_table_keeps_statistics_of_held_out_cases_and_regions_of_all():
    table = Table(2, 2, {"pad_node": np.arange(3), "full_scale_region": np.arange(2)})
    table.put(1, 0, np.array([0.1, 0.3, 0.9]), np.array([True, True, False]),
              {"pad_node": (np.array([True, True, False]), np.array([0, 2])),
               "full_scale_region": (np.arange(3), np.array([0, 0, 1]))})
    found = table.variables()
    assert found["full_scale_count"][1][1, 0] == 2 and found["full_scale_max"][1][1, 0] == 0.3
    np.testing.assert_array_equal(found["by_pad_node"][1][1, 0], [0.1, np.nan, 0.3])
    np.testing.assert_array_equal(found["by_full_scale_region"][1][1, 0], [0.3, 0.9])
    assert np.isnan(found["full_scale_max"][1][0]).all()
