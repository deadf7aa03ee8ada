"""Statics against the direct solution: superposition, POD, regression."""

import numpy as np
import pytest

from rom.metamodels import create
from rom.metamodels.pod_space import pod
from rom.relative import relative_errors
from rom.scenes import CaseArrays


@pytest.fixture(scope="module")
def fresh(static):
    """Forces that no dataset holds: one to three at random nodes, amplitudes of either sign."""
    rng = np.random.default_rng(17)
    node = np.stack([rng.permutation(static.n_loads)[:3] for _ in range(30)])
    force = rng.uniform(-2.0, 2.0, node.shape)
    force[:10, 1:] = 0.0
    return CaseArrays(node, force)


@pytest.fixture(scope="module")
def truth(static, fresh):
    return create("direct", static).fit().evaluate(fresh)


@pytest.mark.parametrize(("precision", "limit"), [("float64", 1e-9), ("float32", 1e-6)])
def test_superposition_is_exact(static, fresh, truth, precision, limit):
    # 1e-9 is the gate of linear statics; in single precision the rounding of three stored fields, 3 x 6e-8
    model = create("superposition", static, precision=precision).fit()
    assert relative_errors(model.evaluate(fresh), truth).max() <= limit


def test_superposition_needs_no_data_and_learns_none(static, static_data, fresh):
    np.testing.assert_array_equal(create("superposition", static).fit(static_data).evaluate(fresh),
                                  create("superposition", static).fit().evaluate(fresh))


def test_pod_of_enough_cases_spans_all_unit_responses(static, static_data, fresh, truth):
    # linear statics: every answer lies in the span of n_pad unit responses, and the training cases load every node
    span = pod(static.values(static_data)).vectors.shape[1]
    assert span == static.n_loads
    model = create("pod-galerkin", static, rank=span).fit(static_data)
    assert relative_errors(model.evaluate(fresh), truth).max() <= 1e-7  # NOISE leaves singular values above 1e-6


def test_galerkin_errors_fall_with_rank_and_are_best_in_energy(static, static_data, fresh, truth):
    stiffness = static.model.stiffness
    errors = []
    for rank in (4, 8, 16, 22):
        model = create("pod-galerkin", static, rank=rank).fit(static_data)
        miss = model.evaluate(fresh) - truth
        # Galerkin orthogonality: the error is K-orthogonal to the basis, so no answer in the basis has less energy
        basis = model._basis.field
        inner = basis @ (stiffness @ miss.T)
        size = np.sqrt(np.einsum("ij,ij->j", truth.T, stiffness @ truth.T))
        assert np.abs(inner).max() <= 1e-8 * size.max()
        errors.append(np.einsum("ij,ji->i", miss, stiffness @ miss.T))
    assert (np.diff(np.array(errors), axis=0) <= 1e-12 * errors[0]).all()  # nested spaces: case by case


def test_best_approximation_bounds_the_error_from_below(static, static_data, fresh, truth):
    for method in ("pod-galerkin", "pod-regression"):
        model = create(method, static, rank=12).fit(static_data)
        best = relative_errors(model.best_approximation(fresh, truth), truth)
        assert (best <= relative_errors(model.evaluate(fresh), truth) * (1 + 1e-9)).all()
        assert best.max() > 1e-3  # rank 12 of 22 cannot be exact


def test_regression_reproduces_its_training_cases(static, static_data):
    # as many centres as loaded nodes and a small ridge: nearly interpolation
    model = create("pod-regression", static, rank=22, ridge=1e-10).fit(static_data)
    arrays = static.read(static_data)
    assert relative_errors(model.evaluate(arrays), static.values(static_data)).max() <= 1e-2


def test_a_rank_beyond_the_snapshots_is_refused(static, static_data):
    with pytest.raises(ValueError, match="rank 60 is out of reach: these snapshots give 22 POD modes"):
        create("pod-galerkin", static, rank=60).fit(static_data)
    with pytest.raises(ValueError, match="rank"):
        create("pod-galerkin", static, rank=0)


def test_a_fit_never_answers_from_data_that_have_changed(static, static_data, fresh):
    changing = static_data.copy(deep=True)
    model = create("pod-galerkin", static, rank=6).fit(changing)
    before = model.evaluate(fresh)
    changing["displacement"].values[8:] = changing["displacement"].values[:1]  # other cases in the same object
    assert relative_errors(model.fit(changing).evaluate(fresh), before).max() > 1e-3
