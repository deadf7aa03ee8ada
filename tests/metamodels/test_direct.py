"""The full-order model in the metamodels' row: residual, reciprocity, power, limits."""

import numpy as np
import pytest
from energy import residuals

from rom.metamodels import create
from rom.relative import relative_errors
from rom.scenes import CaseArrays

TRUTH_RESIDUAL = 1e-10  # the limit with which answers are stored as truth


def grid(scene, nodes, frequency, loss_factor):
    """Unit force at each of ``nodes``, all at one operating point."""
    n = len(nodes)
    return CaseArrays(np.asarray(nodes)[:, None], np.ones((n, 1)), np.full(n, frequency), np.full(n, loss_factor))


@pytest.fixture(scope="module", params=["direct", "direct-reused"])
def name(request):
    return request.param


def test_residual_is_that_of_a_truth(name, scene_of, data_of):
    for key, scene in scene_of.items():
        cases = data_of[key].isel(case=slice(0, None, 20))
        model = create(name, scene).fit()
        assert residuals(scene, cases, model.predict(cases)).max() <= TRUTH_RESIDUAL


def test_residual_of_a_wrong_answer_is_the_size_of_the_mistake(harmonic, harmonic_data):
    cases = harmonic_data.isel(case=slice(4))
    model = create("direct", harmonic).fit()
    answer = model.predict(cases)
    answer["displacement"] = 1.01 * answer["displacement"]  # Z (1.01 u) - f = 0.01 f
    np.testing.assert_allclose(residuals(harmonic, cases, answer), 0.01, rtol=1e-6)


def test_answers_are_the_stored_truth(name, scene_of, data_of):
    for key, scene in scene_of.items():
        cases = data_of[key].isel(case=slice(5, None, 30))
        answers = create(name, scene).fit().evaluate(scene.read(cases))
        assert relative_errors(answers, scene.values(cases)).max() <= 1e-9


def test_backends_agree(tiny_harmonic):
    cases = tiny_harmonic.sample(3)
    fallback, usual = (create("direct", tiny_harmonic, backend=name).fit() for name in ("superlu", "auto"))
    assert fallback.backend == "superlu"
    assert relative_errors(fallback.evaluate(cases), usual.evaluate(cases)).max() <= 1e-9


@pytest.mark.parametrize(("method", "settings", "rounding"), [
    ("direct", {}, 1e-10), ("modal", {"modes": 20}, 1e-12), ("modal-krylov", {"modes": 20, "vectors": 8}, 1e-4),
    ("coarse-fem", {"scale": 0.5}, 1e-10)])
def test_receptance_is_reciprocal(harmonic, method, settings, rounding):
    # Maxwell-Betti: Z is symmetric, so u_i under f_j equals u_j under f_i along the normals. Each load of
    # modal-krylov has vectors of its own, so there it holds as far as the method converges.
    nodes = np.arange(0, harmonic.n_loads, 3)
    answers = create(method, harmonic, **settings).fit().evaluate(grid(harmonic, nodes, 163.0, 0.17))
    receptance = answers @ harmonic.unit_loads[:, nodes]
    scale = np.abs(receptance).max()
    assert np.abs(receptance - receptance.T).max() <= rounding * scale
    assert np.abs(receptance - np.diag(np.diag(receptance))).max() > 0.01 * scale  # not trivially so


@pytest.mark.parametrize("frequency", [3.0, 119.0, 288.0])
def test_dissipated_power_is_the_input_power_and_positive(harmonic, frequency):
    cases = grid(harmonic, range(harmonic.n_loads), frequency, 0.2)
    answer = create("direct", harmonic).fit().evaluate(cases).T
    lost = harmonic.model.dissipated_power(answer, frequency, 0.2)
    put_in = harmonic.model.input_power(harmonic.force_vectors(cases), answer, frequency)
    assert (lost > 0).all()
    np.testing.assert_allclose(lost, put_in, rtol=1e-8)  # energy balance


def test_vibration_tends_to_statics_as_frequency_vanishes(static, harmonic):
    # (1 + i eta) K u = f at 0 Hz
    nodes = [2, 11, 17]
    still = create("direct", static).fit().evaluate(CaseArrays(np.array(nodes)[:, None], np.ones((3, 1))))
    slow = create("direct", harmonic).fit().evaluate(grid(harmonic, nodes, 0.0, 0.3))
    assert relative_errors(slow * (1 + 0.3j), still.astype(complex)).max() <= 1e-9


def test_a_normal_force_pushes_the_skin_in(static):
    n = static.n_loads
    answers = create("direct", static).fit().evaluate(CaseArrays(np.arange(n)[:, None], np.ones((n, 1))))
    # K is positive definite, so the loaded point moves with the force: inwards
    assert (np.einsum("ij,ji->i", answers, static.unit_loads) > 0).all()
