"""Methods that know their limits: bounds hold, warnings come once and with reasons, tolerances are met."""

import warnings

import numpy as np
import pytest
from conformance import FINGERTIP, ROWS
from energy import relative_energy_errors

from rom.errors import SolverError
from rom.metamodels import ValidityWarning, create, load
from rom.metamodels.residual_bound import ResidualBound, residual_bound
from rom.metamodels.trained import TrainedRange
from rom.metamodels.validity import UNJUDGED
from rom.scenes import CaseArrays

ROUNDING = 1e-10
"""Relative energy error that the direct reference carries itself: see test_certificate.py."""
CHEAP = ("direct", "direct-reused", "superposition", "modal", "modal-static", "modal-krylov")
"""Methods that judge themselves without assess()."""


@pytest.fixture(scope="module", params=[row for row in ROWS if row.scene in FINGERTIP], ids=str)
def row(request):
    return request.param


@pytest.fixture(scope="module")
def scene(row, scene_of):
    return scene_of[row.scene]


@pytest.fixture(scope="module")
def model(row, scene, data_of):
    return create(row.method, scene, **row.settings).fit(data_of[row.scene] if row.learns else None)


@pytest.fixture(scope="module")
def arrays(scene):
    """Cases that no fixture's dataset was drawn from, within the published ranges and beyond."""
    return scene.sample(8, 91).joined(scene.sample_beyond(8, 91))


@pytest.fixture(scope="module")
def truth(scene, arrays):
    return create("direct", scene).fit().evaluate(arrays)


def relative(scene, answers, truth):
    return relative_energy_errors(answers, truth, scene.model.stiffness)


def quietly(model, cases, **words):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ValidityWarning)
        return model.predict(cases, **words)


def test_what_is_called_a_bound_is_one(scene, model, arrays, truth):
    found = model.assess(arrays)
    values = model.evaluate(arrays, "field")
    made = relative(scene, values, truth)
    assert found.kind in ("bound", "estimate")
    assert found.error.shape == found.reason.shape == (len(arrays),)
    if found.kind == "bound":
        assert (made <= found.error + ROUNDING).all()
        again = model.assess(arrays, values)  # the answer may be handed in
        assert (made <= again.error + ROUNDING).all()
    else:
        assert found.error.max() < 1e-9
        handed = model.assess(arrays, values + 1e-3 * values)
        np.testing.assert_allclose(handed.error, 1e-3, rtol=1e-5)


def test_predict_says_what_it_knows(row, scene, model, arrays):
    answer = quietly(model, scene.cases_from(arrays))
    assert answer["error_estimate"].dims == answer["error_kind"].dims == answer["validity"].dims == ("case",)
    assert "answered_by" not in answer
    known = np.isfinite(answer["error_estimate"].values)
    if row.method in CHEAP:
        assert known.all()
    else:
        assert not known.any()
        assert (answer["error_kind"] == "none").all()
        assert (answer["validity"] != "").all()


def test_one_warning_a_call_and_only_with_a_reason(scene, model, arrays):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        answer = model.predict(scene.cases_from(arrays))
    doubtful = int((answer["validity"] != "").sum())
    assert len(caught) == (doubtful > 0)
    if doubtful:
        assert caught[0].category is ValidityWarning
        assert f"{doubtful} of {len(arrays)} answers" in str(caught[0].message)
        assert caught[0].filename == __file__


@pytest.mark.parametrize("tolerance", [1e-5])
def test_a_tolerance_is_met(row, scene, model, arrays, truth, tolerance):
    answer = model.predict(scene.cases_from(arrays), tolerance)  # no warning: they are errors here
    assert (relative(scene, scene.values(answer), truth) <= tolerance + ROUNDING).all()
    assert (answer["error_estimate"] <= tolerance).all()
    assert (answer["validity"] == "").all()
    by = set(answer["answered_by"].values.tolist())
    assert by <= {row.method, "modal-krylov", "direct-reused"}
    own = model.assess(arrays).error <= tolerance
    assert (answer["answered_by"].values[own] == row.method).all()
    kept = answer["displacement"].values[own]
    np.testing.assert_array_equal(kept, quietly(model, scene.cases_from(arrays))["displacement"].values[own])


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf, "small", True, None.__class__])
def test_tolerances_that_are_none_are_refused(harmonic, harmonic_data, wrong):
    model = create("modal", harmonic, modes=8).fit()
    with pytest.raises(ValueError, match="no relative error: give a number above 0"):
        model.predict(harmonic_data.isel(case=[0]), wrong)


def test_tolerances_beyond_double_precision_are_refused(harmonic, harmonic_data):
    model = create("modal", harmonic, modes=8).fit()
    with pytest.raises(ValueError, match="below what double precision can reach"):
        model.predict(harmonic_data.isel(case=[0]), 1e-14)


def test_extrapolation_is_named(harmonic, harmonic_data):
    inside = harmonic_data.isel(case=slice(0, 112))  # the rest of this dataset lies beyond the ranges
    model = create("pod-galerkin", harmonic, rank=20).fit(inside)
    cases = harmonic.cases_from(CaseArrays(np.array([[3], [3], [3]]), np.ones((3, 1)), np.array([100.0, 900.0, 100.0]),
                                           np.array([0.2, 0.2, 0.001])))
    reasons = quietly(model, cases)["validity"].values
    assert reasons[0] == UNJUDGED
    assert "frequency outside the" in reasons[1]
    assert "loss factor outside the" in reasons[2]


def test_loads_and_forces_outside_training_are_named(static):
    trained = TrainedRange.of(static, CaseArrays(np.array([[1, 2], [4, 0]]), np.array([[1.0, 1.0], [1.0, 0.0]])))
    assert trained == TrainedRange((1, 2, 4), 2, {})
    assert TrainedRange.from_dict(trained.to_dict()) == trained
    reasons = trained.reasons(static, CaseArrays(np.array([[1, 2, 0], [3, 0, 0], [1, 2, 4]]),
                                                 np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0]])))
    assert reasons.tolist() == [
        "", "a load that no training case had", "more than the 2 forces of any training case"]


def test_modes_below_the_frequency_are_named(harmonic):
    model = create("modal", harmonic, modes=4).fit()
    top = np.sqrt(model.next_eigenvalue_bound) / (2 * np.pi)
    cases = CaseArrays(np.zeros((2, 1), int), np.ones((2, 1)), np.array([0.5 * top, 1.1 * top]), np.full(2, 0.3))
    reasons = model.assess(cases).reason
    assert "beyond the modes kept" not in reasons[0]
    assert "beyond the modes kept" in reasons[1]


def test_an_undamped_resonance_is_named_or_refused(harmonic):
    model = create("modal-krylov", harmonic, modes=12, vectors=3).fit()
    resonance = float(np.sqrt(model.eigenvalue[2]) / (2 * np.pi))

    def at(frequency):
        return harmonic.cases_from(CaseArrays(np.array([[5]]), np.ones((1, 1)), np.array([frequency]), np.zeros(1)))

    with pytest.warns(ValidityWarning, match="undamped and within a millionth of a resonance"):
        model.predict(at(resonance * (1 + 1e-9)))
    exactly = model.eigenvalue[2] == (2 * np.pi * resonance) ** 2
    if exactly:  # else rounding of the frequency leaves a finite, warned answer
        with pytest.raises(SolverError, match="no finite answer"):
            model.predict(at(resonance))


def test_ranges_survive_a_file(static, static_data, tmp_path):
    model = create("pod-galerkin", static, rank=20).fit(static_data)
    model.save(tmp_path / "pod.nc")
    assert load(tmp_path / "pod.nc", static).trained == model.trained


def test_the_modal_split_is_tight(harmonic):
    """Answers from anywhere: another case's answer as the error, smooth, and noise, rough."""
    cases = harmonic.sample(24, 17)
    truth = create("direct", harmonic).fit().evaluate(cases)
    size = np.linalg.norm(truth, axis=1, keepdims=True)
    rng = np.random.default_rng(2)
    for share in (1e-8, 1e-3, 0.3):
        for error in (truth[::-1] / size[::-1], rng.standard_normal(truth.shape) / np.sqrt(truth.shape[1])):
            values = truth + share * size * error
            made = relative(harmonic, values, truth)
            ratio = residual_bound(harmonic).bound(cases, values) / made
            assert ratio.min() >= 1 - 1e-3 * (share < 1e-7)
            assert np.median(ratio) < 5


def test_every_metamodel_of_a_scene_shares_one_split(harmonic):
    assert residual_bound(harmonic) is residual_bound(harmonic)
    assert isinstance(residual_bound(harmonic), ResidualBound)


def test_pad_outputs_are_judged_by_the_whole_field(small_tip, static_data):
    from rom.scenes import get_scene

    pad = get_scene("static-point-forces", small_tip, outputs="pad")
    model = create("pod-galerkin", pad, rank=20).fit(static_data)
    answer = model.predict(static_data.isel(case=slice(4)), tolerance=1e-3)
    assert answer.sizes["node"] == pad.n_loads
    assert (answer["error_estimate"] <= 1e-3).all()
    expected = static_data["displacement"].isel(case=slice(4)).sel(node=answer["node"]).values
    np.testing.assert_allclose(answer["displacement"].values, expected, rtol=1e-2, atol=1e-3 * abs(expected).max())
