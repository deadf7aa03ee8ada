"""Modal methods against the direct solution: truncation, residual flexibility, load-dependent vectors."""

import dataclasses

import numpy as np
import pytest
import scipy.linalg as sla

from rom.metamodels import create, load
from rom.relative import relative_errors
from rom.scenes import CaseArrays, get_scene


def random_cases(scene, count, low=1.0, high=300.0, seed=23):
    rng = np.random.default_rng(seed)
    return CaseArrays(rng.integers(scene.n_loads, size=(count, 1)), rng.uniform(0.01, 0.1, (count, 1)),
                      rng.uniform(low, high, count), rng.uniform(0.1, 0.5, count))


@pytest.fixture(scope="module")
def cases(harmonic):
    return random_cases(harmonic, 16)


@pytest.fixture(scope="module")
def truth(harmonic, cases):
    return create("direct", harmonic).fit().evaluate(cases)


def worst(scene, name, cases, truth, **settings):
    return relative_errors(create(name, scene, **settings).fit().evaluate(cases), truth).max()


def test_all_modes_are_the_direct_solution(tiny_harmonic):
    # the eigenvectors of (K, M) are a complete basis that diagonalises Z
    cases = random_cases(tiny_harmonic, 10)
    model = create("modal", tiny_harmonic, modes=tiny_harmonic.n_free).fit()
    truth = create("direct", tiny_harmonic).fit().evaluate(cases)
    assert relative_errors(model.evaluate(cases), truth).max() <= 1e-8


def test_all_modes_by_dense_linear_algebra(tiny_harmonic):
    model = create("modal", tiny_harmonic, modes=8).fit()
    dense = sla.eigh(tiny_harmonic.model.stiffness.toarray(), tiny_harmonic.model.mass.toarray(),
                     eigvals_only=True)
    np.testing.assert_allclose(model.eigenvalue, dense[:8], rtol=1e-8)
    assert dense[7] < model.next_eigenvalue_bound <= dense[8] * (1 + 1e-9)


def test_modes_default_to_those_within_the_band(harmonic):
    model = create("modal", harmonic).fit()
    frequency = np.sqrt(model.eigenvalue) / (2 * np.pi)
    more = harmonic.model.natural_modes(count=len(frequency) + 1).frequency_hz
    assert frequency.max() < harmonic.band_hz <= more[-1]
    assert np.sqrt(model.next_eigenvalue_bound) / (2 * np.pi) <= more[-1]


def test_krylov_converges_with_vectors(harmonic, cases, truth):
    errors = [worst(harmonic, "modal-krylov", cases, truth, modes=20, vectors=p) for p in (1, 2, 4, 6, 8)]
    assert (np.diff(errors) < 0).all()
    assert errors[0] > 0.05  # and not because everything is exact: point loads defeat one vector
    assert errors[-1] < 1e-4 * errors[0]


def test_krylov_converges_with_modes(harmonic, cases, truth):
    errors = [worst(harmonic, "modal-krylov", cases, truth, modes=m, vectors=4) for m in (11, 20, 40, 80)]
    assert (np.diff(errors) < 0).all()


def test_residual_flexibility_helps_and_vectors_help_more(harmonic, cases, truth):
    plain, static, krylov = (worst(harmonic, name, cases, truth, modes=40) for name in
                             ("modal", "modal-static", "modal-krylov"))
    assert krylov < 0.01 * static < 0.01 * plain
    assert plain > 0.1  # truncation alone misses a point load's own neighbourhood


def test_residual_flexibility_is_exact_at_rest(static, harmonic):
    # at 0 Hz the left-out modes answer statically: modes + residual flexibility = K^-1 f / (1 + i eta)
    n = harmonic.n_loads
    unit = CaseArrays(np.arange(n)[:, None], np.ones((n, 1)))
    still = CaseArrays(unit.node, unit.force, np.zeros(n), np.full(n, 0.4))
    truth = create("superposition", static).fit().evaluate(unit) / (1 + 0.4j)
    for name in ("modal-static", "modal-krylov"):
        assert worst(harmonic, name, still, truth, modes=6) <= 1e-9
    assert worst(harmonic, "modal", still, truth, modes=6) > 0.1


def test_single_precision_costs_its_rounding_only(harmonic, cases):
    double, single = (create("modal-krylov", harmonic, modes=20, vectors=3, precision=p).fit().evaluate(cases)
                      for p in ("float64", "float32"))
    assert single.dtype == np.complex64
    assert relative_errors(single, double).max() <= 1e-5  # some 23 terms of 6e-8, some of which cancel


def test_other_tissue_gives_other_modes(small_tip):
    anatomy = small_tip.anatomy
    stiffer = dataclasses.replace(anatomy, dermis=dataclasses.replace(
        anatomy.dermis, elastic_modulus=2 * anatomy.dermis.elastic_modulus))
    first = [np.sqrt(create("modal", get_scene("harmonic-point-force", tip), modes=3).fit().eigenvalue[0])
             for tip in (small_tip, dataclasses.replace(small_tip, anatomy=stiffer))]
    assert first[1] > 1.01 * first[0]


@pytest.mark.parametrize(("name", "settings", "message"), [
    ("modal", {"modes": 0}, "modes=0 is too few"), ("modal-krylov", {"vectors": 0}, "vectors=0 is too few"),
    ("modal", {"precision": "float16"}, "precision='float16' is unknown"),
    ("modal-static", {"vectors": 3}, "modal-static does not take the settings vectors")])
def test_impossible_settings_are_refused(harmonic, name, settings, message):
    with pytest.raises(ValueError, match=message):
        create(name, harmonic, **settings)


def test_modes_answer_no_static_scene(static):
    with pytest.raises(ValueError, match="modal does not apply to static-point-forces"):
        create("modal", static)


def test_a_model_of_some_loads_answers_those_alone(harmonic, cases, tmp_path):
    some = create("modal-krylov", harmonic, modes=12, vectors=2, loads=np.unique(cases.node)[:5]).fit()
    whole = create("modal-krylov", harmonic, modes=12, vectors=2).fit()
    known = np.isin(cases.node[:, 0], some.settings["loads"])
    assert 0 < known.sum() < len(cases)
    mine = cases.take(known)
    np.testing.assert_allclose(some.evaluate(mine), whole.evaluate(mine), rtol=1e-9, atol=1e-20)
    np.testing.assert_allclose(some.error_bound(mine), whole.error_bound(mine), rtol=1e-6)
    assert some.model_bytes < whole.model_bytes
    some.save(tmp_path / "some.nc")
    again = load(tmp_path / "some.nc", harmonic)
    np.testing.assert_array_equal(again.evaluate(mine), some.evaluate(mine))
    np.testing.assert_array_equal(again.error_bound(mine), some.error_bound(mine))
    with pytest.raises(ValueError, match="is not among the 5 that this model was made for"):
        some.evaluate(cases)


@pytest.mark.parametrize("loads", [[], [1, 1], [-1], [10_000], [0.5]])
def test_loads_that_cannot_be_are_refused(harmonic, loads):
    with pytest.raises(ValueError, match="load"):
        create("modal", harmonic, loads=loads)
