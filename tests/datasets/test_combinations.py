"""Numbered combinations, uniform draws from all of them, superposed truth."""

import itertools
import math

import numpy as np
import pytest

from rom.datasets import draw_cases, select
from rom.datasets.combinations import draw_combinations, superposed, unit_responses
from rom.scenes.combinations import combination, combination_number, count_combinations


def test_the_published_pad_has_the_published_number():
    assert count_combinations(239) == 239 + math.comb(239, 2) + math.comb(239, 3) == 2_275_519


@pytest.mark.parametrize(("n_node", "most"), [(1, 3), (4, 3), (9, 3), (7, 5), (12, 1)])
def test_every_number_is_one_combination(n_node, most):
    nodes = combination(np.arange(count_combinations(n_node, most)), n_node, most)
    found = [tuple(int(c) for c in row if c >= 0) for row in nodes]
    expected = [c for k in range(1, most + 1) for c in itertools.combinations(range(n_node), k)]
    assert set(found) == set(expected) and len(found) == len(expected)
    assert [len(c) for c in found] == sorted(len(c) for c in expected)
    np.testing.assert_array_equal(combination_number(nodes, n_node), np.arange(len(found)))


def test_large_numbers_come_back():
    number = np.random.default_rng(0).integers(count_combinations(239), size=5000)
    number[:2] = 0, count_combinations(239) - 1
    np.testing.assert_array_equal(combination_number(combination(number, 239), 239), number)


@pytest.mark.parametrize("number", [-1, 2_275_519])
def test_numbers_out_of_range_are_refused(number):
    with pytest.raises(ValueError, match=f"combination {number} does not exist: 239 nodes have 2275519"):
        combination(np.array([3, number]), 239)


def numbers(scene, arrays):
    return combination_number(np.where(arrays.force != 0, arrays.node, -1), scene.n_loads)


def test_training_and_held_out_share_nothing(static):
    train, test = draw_combinations(static, 900, seed=4, held_out=300)
    assert (len(train), len(test)) == (900, 300)
    drawn, held = numbers(static, train), numbers(static, test)
    assert len(np.unique(np.concatenate([drawn, held]))) == 1200
    inside = test.force[test.force != 0]
    assert inside.min() >= 0.1 and inside.max() <= 1


def test_a_seed_decides_and_more_training_changes_nothing_else(static):
    few, held = draw_combinations(static, 50, seed=4, held_out=100)
    more, same = draw_combinations(static, 500, seed=4, held_out=100)
    np.testing.assert_array_equal(held.node, same.node)
    np.testing.assert_array_equal(held.force, same.force)
    np.testing.assert_array_equal(more.node[:50], few.node)
    np.testing.assert_array_equal(more.force[:50], few.force)
    _, other = draw_combinations(static, 50, seed=5, held_out=100)
    assert (other.node != held.node).any()


def test_draws_are_uniform(static):
    _, test = draw_combinations(static, 0, seed=1, held_out=static.n_published // 5)
    singles, share = ((test.force != 0).sum(axis=1) == 1).sum(), 0.2
    deviation = math.sqrt(share * (1 - share) * static.n_loads)
    assert abs(singles - share * static.n_loads) < 4 * deviation
    loaded = np.bincount(test.node[test.force != 0], minlength=static.n_loads)
    assert loaded.max() < 1.6 * loaded.min()


def test_all_combinations_can_be_drawn(static):
    total = static.n_published
    held = round(0.2 * total)
    train, test = draw_combinations(static, total - held, held_out=held)
    assert len(np.unique(np.concatenate([numbers(static, train), numbers(static, test)]))) == total
    with pytest.raises(ValueError, match=f"of the {total} combinations of one to 3"):
        draw_combinations(static, total, held_out=1)


def test_a_combination_is_held_out_in_every_dataset_of_a_seed(static):
    _, held = draw_combinations(static, 0, seed=3, held_out=round(0.2 * static.n_published))
    arrays, cases = draw_cases(static, 300, 20, seed=3)
    tested = np.isin(numbers(static, arrays.take(np.arange(300))), numbers(static, held))
    np.testing.assert_array_equal(select(cases, "published", "test"), np.flatnonzero(tested))


def test_other_scenes_are_refused(harmonic):
    with pytest.raises(ValueError, match="harmonic-point-force has no combinations"):
        draw_combinations(harmonic, 5)


def test_superposed_answers_are_direct_ones(static):
    cases, _ = draw_combinations(static, 40, seed=2, held_out=10)
    truth = static.solve(cases)[0]["displacement"]
    responses = unit_responses(static)
    found = np.empty_like(truth)
    blocks = list(superposed(responses, cases, block=16))
    assert [index.stop - index.start for index, _ in blocks] == [16, 16, 8]
    for index, values in blocks:
        found[index] = values
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-9 * np.abs(truth).max())
    vectors = np.random.default_rng(0).normal(size=(static.n_free, 3))
    index, coefficients = next(superposed(responses @ vectors, cases))
    np.testing.assert_allclose(coefficients, truth[index] @ vectors, rtol=0, atol=1e-9 * np.abs(coefficients).max())
