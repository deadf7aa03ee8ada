"""Splits: disjoint, decided by the seed, 20 %; the hard one keeps whole nodes, bands and ranges from training."""

import numpy as np
import pytest

from rom.datasets import SPLITS, carve_validation, draw_cases, select
from rom.datasets.splits import held_out_numbers
from rom.scenes.harmonic_point_force import HELD_OUT_BANDS


@pytest.fixture(params=["static", "harmonic"])
def scene(request):
    return request.getfixturevalue(request.param)


def parts(cases, split):
    return select(cases, split, "train"), select(cases, split, "test")


@pytest.mark.parametrize("seed", [0, 9])
def test_parts_are_disjoint_and_decided_by_the_seed(scene, seed):
    cases, again, other = (draw_cases(scene, 200, 20, s)[1] for s in (seed, seed, seed + 1))
    for split in SPLITS:
        train, test = parts(cases, split)
        assert not set(train) & set(test)
        for a, b in zip((train, test), parts(again, split), strict=True):
            np.testing.assert_array_equal(a, b)
    assert not np.array_equal(parts(cases, "published")[1], parts(other, "published")[1])


def test_the_published_split_holds_out_20_percent_within_the_ranges(scene):
    _, cases = draw_cases(scene, 605, 20, 2)
    train, test = parts(cases, "published")
    assert abs(len(test) - 121) < 4 * 9.8  # four standard deviations of a draw from a fifth
    assert set(train) | set(test) == set(range(605))
    np.testing.assert_array_equal(select(cases, "published", "unused"), np.arange(605, 625))


def test_a_case_is_held_out_in_every_dataset_of_a_seed_or_in_none(scene):
    def found(count):
        arrays, cases = draw_cases(scene, count, 0, 5)
        return dict(zip(scene.published_number(arrays).tolist(), cases["split_published"].values.tolist(), strict=True))

    few, many = found(150), found(900)
    shared = set(few) & set(many)
    assert len(shared) > 10
    assert all(few[number] == many[number] for number in shared)
    assert max(many) < scene.n_published and len(held_out_numbers(scene.n_published, 5)) == round(
        0.2 * scene.n_published)


def test_a_few_cases_are_split_too(scene):
    for seed in range(30):
        train, test = parts(draw_cases(scene, 3, 0, seed)[1], "published")
        assert len(train) and len(test)


def test_the_hard_split_keeps_whole_nodes_from_training(scene):
    arrays, cases = draw_cases(scene, 300, 30, 2)
    train, test = parts(cases, "hard")
    assert len(train) + len(test) == 330
    loaded = {part: set(arrays.node[rows][arrays.force[rows] != 0]) for part, rows in
              (("train", train), ("test", test))}
    held = set(scene.held_out_loads(2))
    assert held and not loaded["train"] & held
    assert held <= loaded["test"]


def test_the_hard_split_keeps_whole_bands_and_ranges_from_training(harmonic):
    arrays, cases = draw_cases(harmonic, 600, 60, 2)
    train, test = parts(cases, "hard")
    frequency, loss_factor = arrays.frequency[train], arrays.loss_factor[train]
    for low, high in HELD_OUT_BANDS:
        assert not ((low <= frequency) & (frequency <= high)).any()
        assert ((low <= arrays.frequency[test]) & (arrays.frequency[test] <= high)).any()
    assert frequency.max() <= 300 and loss_factor.min() >= 0.1 and loss_factor.max() <= 0.5
    assert set(np.unique(cases["hard_region"].values)) == {0, 1, 2, 3, 4}  # every reason occurs
    np.testing.assert_array_equal(np.flatnonzero(cases["hard_region"].values == 0), train)


def test_the_hard_split_keeps_four_and_five_forces_from_training(static):
    arrays, cases = draw_cases(static, 200, 20, 2)
    number = (arrays.force != 0).sum(axis=1)
    train, test = parts(cases, "hard")
    assert number[train].max() == 3
    assert set(number[test]) >= {4, 5}


def test_validation_is_carved_from_training(scene):
    train, validation = carve_validation(100, 0.1, 3)
    assert len(validation) == 10 and set(train) | set(validation) == set(range(100))
    assert not set(train) & set(validation)
    np.testing.assert_array_equal(carve_validation(100, 0.1, 3)[1], validation)
    assert not np.array_equal(carve_validation(100, 0.1, 4)[1], validation)
    assert len(carve_validation(4, 0.1)[1]) == 1


def test_unknown_splits_and_parts_are_refused(static_data):
    with pytest.raises(ValueError, match="'easy' is no split: choose one of published, hard"):
        select(static_data, "easy", "test")
    with pytest.raises(ValueError, match="'exam' is no part of a split"):
        select(static_data, "hard", "exam")


@pytest.mark.parametrize(("count", "beyond"), [(0, 0), (-3, 0), (5, -1)])
def test_no_cases_are_refused(scene, count, beyond):
    with pytest.raises(ValueError, match=f"{count} cases and {beyond} beyond"):
        draw_cases(scene, count, beyond)
