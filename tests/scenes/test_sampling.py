"""What is drawn: distinct cases on the published grids, every node equally often, the hard split's parts."""

import numpy as np
import pytest

from rom.scenes import CaseArrays
from rom.scenes.harmonic_point_force import FREQUENCY, FREQUENCY_BEYOND, HELD_OUT_BANDS, LOSS_FACTOR

SEEDS = [0, 7]


def identity(arrays):
    """One hashable per case, whatever the order of its forces."""
    return [(*sorted(node[force != 0.0]), *point) for node, force, point in zip(
        arrays.node, arrays.force, zip(*(a for a in (arrays.frequency, arrays.loss_factor) if a is not None),
                                       strict=True) if arrays.frequency is not None else [()] * len(arrays),
        strict=True)]


@pytest.fixture(params=["static", "harmonic"])
def scene(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("count", [1, 7, 44, 300])
def test_cases_are_distinct_and_counted(scene, count, seed):
    arrays = scene.sample(count, seed)
    assert len(arrays) == count
    assert len(set(identity(arrays))) == count


@pytest.mark.parametrize("seed", SEEDS)
def test_every_node_is_loaded_equally_often(scene, seed):
    arrays = scene.sample(6 * scene.n_loads, seed)
    often = np.bincount(arrays.node[arrays.force != 0.0], minlength=scene.n_loads)
    # one shuffled pad after another; triples that would meet a node twice are put off, by a walk or two
    assert np.ptp(often) <= (0 if scene.harmonic else 2)


def test_the_seed_decides_everything(scene):
    first, same, other = scene.sample(50, 4), scene.sample(50, 4), scene.sample(50, 5)
    for a, b in zip(first, same, strict=True):
        np.testing.assert_array_equal(a, b)
    assert identity(first) != identity(other)
    for a, b in zip(scene.sample_beyond(9, 4), scene.sample_beyond(9, 4), strict=True):
        np.testing.assert_array_equal(a, b)


def test_static_cases_have_one_to_three_forces(static):
    arrays = static.sample(120)
    assert (np.bincount((arrays.force != 0).sum(axis=1))[1:] == [11, 40, 69]).all()  # 22 nodes: 11 singles at most
    present = arrays.force[arrays.force != 0]
    assert present.min() >= 0.1 and present.max() <= 1.0
    beyond = static.sample_beyond(11)
    assert (np.bincount((beyond.force != 0).sum(axis=1))[4:] == [5, 6]).all()


def test_harmonic_cases_lie_on_the_published_grid(harmonic):
    arrays = harmonic.sample(300)
    assert np.isin(arrays.frequency, np.arange(1, 301)).all()  # published: every hertz from 1 to 300
    steps = (arrays.loss_factor - 0.1) / 0.05  # published: .1 to .5 in steps of .05
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert arrays.loss_factor.min() >= 0.1 and arrays.loss_factor.max() <= 0.5
    assert len(FREQUENCY) * len(LOSS_FACTOR) * 239 == 645_300  # the published number of cases


def test_harmonic_cases_beyond_leave_the_ranges(harmonic):
    arrays = harmonic.sample_beyond(40)
    higher, lossy = arrays.frequency > 300, np.isin(arrays.loss_factor, [0.05, 0.6])
    assert (higher | lossy).all() and higher.any() and lossy.any()
    assert np.isin(arrays.frequency[higher], FREQUENCY_BEYOND).all()


def test_groups_hold_every_case_once_and_one_operating_point_each(harmonic):
    arrays = harmonic.sample(100)
    groups = harmonic.groups(arrays)
    np.testing.assert_array_equal(np.sort(np.concatenate(groups)), np.arange(100))
    for group in groups:
        assert len(np.unique(arrays.frequency[group])) == len(np.unique(arrays.loss_factor[group])) == 1
    points = [(arrays.frequency[group[0]], arrays.loss_factor[group[0]]) for group in groups]
    assert len(set(points)) == len(points)


def test_more_cases_than_exist_are_refused(static, harmonic):
    most = 300 * 9 * harmonic.n_loads
    with pytest.raises(ValueError, match=f"{most + 1} cases are more than the {most}"):
        harmonic.sample(most + 1)
    with pytest.raises(ValueError, match="distinct combinations"):
        static.sample(3000)  # 11 + 115 + 22 x 21 x 20 / 6 = 1666 at most


@pytest.mark.parametrize("seed", SEEDS)
def test_hard_regions(static, harmonic, seed):
    held = harmonic.held_out_loads(seed)
    assert len(held) == round(0.1 * harmonic.n_loads)
    free = np.setdiff1d(np.arange(harmonic.n_loads), held)[0]
    (low, high), _ = HELD_OUT_BANDS

    def region(node, frequency, loss_factor):
        return harmonic.hard_region(CaseArrays(np.array([[node]]), np.ones((1, 1)), np.array([frequency]),
                                               np.array([loss_factor])), seed)[0]

    names = ("", *harmonic.regions)
    assert names[region(free, 50.0, 0.3)] == ""
    assert names[region(held[0], 50.0, 0.3)] == "unseen node"
    assert names[region(free, low, 0.3)] == names[region(free, high, 0.3)] == "unseen frequency band"
    assert names[region(free, low - 1, 0.3)] == names[region(free, high + 1, 0.3)] == ""
    assert names[region(free, 301.0, 0.3)] == "301-400 Hz"
    assert names[region(free, 50.0, 0.05)] == names[region(free, 50.0, 0.6)] == "loss factor 0.05 or 0.6"
    assert names[region(free, 50.0, 0.1)] == names[region(free, 50.0, 0.5)] == ""
    one = CaseArrays(np.array([[free, held[0]]] * 2), np.array([[1.0, 0.0], [1.0, 0.5]]))
    np.testing.assert_array_equal(static.hard_region(one, seed), [0, 1])  # where no force acts no node is held out
