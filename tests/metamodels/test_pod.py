"""POD of snapshots that are collinear, tiny, huge, rank-deficient or useless."""

import numpy as np
import pytest

from rom.metamodels.pod_space import PodSpace, pod

RNG = np.random.default_rng(5)
SNAPSHOTS = RNG.standard_normal((20, 100))


def check_basis(space: PodSpace, snapshots, rank):
    assert space.vectors.shape == (snapshots.shape[1], rank)
    np.testing.assert_allclose(space.vectors.T @ space.vectors, np.eye(rank), atol=1e-10)


@pytest.mark.parametrize("size", [1.0, 1e-300, 1e300, 1e-310])
@pytest.mark.parametrize("part", [1.0, 1 + 1j])
def test_the_size_of_snapshots_does_not_matter(size, part):
    # subnormal numbers keep few digits: the spaces agree as far as those go
    space, reference = pod(size * part * SNAPSHOTS), pod(part * SNAPSHOTS)
    check_basis(space, SNAPSHOTS, 20)
    np.testing.assert_allclose(space.singular_values, reference.singular_values, rtol=1e-9 if size > 1e-308 else 1e-4)


def test_snapshots_of_many_sizes_count_alike():
    space = pod(SNAPSHOTS * np.logspace(-300, 300, 20)[:, None])
    np.testing.assert_allclose(space.singular_values, pod(SNAPSHOTS).singular_values, rtol=1e-10)


def test_collinear_and_repeated_snapshots_give_what_they_span():
    one = pod(np.outer(RNG.standard_normal(30), SNAPSHOTS[0]))
    check_basis(one, SNAPSHOTS, 1)
    check_basis(pod(np.vstack([SNAPSHOTS[:5]] * 4)), SNAPSHOTS, 5)
    check_basis(pod(RNG.standard_normal((300, 100))), SNAPSHOTS, 100)
    with pytest.raises(ValueError, match="rank 2 is out of reach: these snapshots give 1"):
        one.truncated(2)


def test_differences_below_the_noise_limit_are_dropped_those_above_are_kept():
    """Singular values below 1e-6 of the largest are noise by the Gram matrix; see `NOISE`."""
    assert pod(SNAPSHOTS[0] + 1e-9 * SNAPSHOTS).vectors.shape[1] == 1
    assert pod(SNAPSHOTS[0] + 1e-4 * SNAPSHOTS).vectors.shape[1] == 20


def test_snapshots_that_vanish_are_left_out_unless_all_do():
    mixed = np.vstack([0 * SNAPSHOTS[:3], SNAPSHOTS])
    np.testing.assert_allclose(pod(mixed).singular_values, pod(SNAPSHOTS).singular_values)
    with pytest.raises(ValueError, match="all 20 snapshots vanish"):
        pod(0 * SNAPSHOTS)


@pytest.mark.parametrize("bad", [np.nan, np.inf, complex(0, np.nan)])
def test_snapshots_that_are_not_finite_are_refused(bad):
    spoiled = SNAPSHOTS.astype(type(bad))
    spoiled[3, 7] = bad
    with pytest.raises(ValueError, match="1 of 20 snapshots hold NaN or infinity"):
        pod(spoiled)
