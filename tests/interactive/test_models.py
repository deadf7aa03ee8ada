"""Models come from the cache, are fitted where it lacks them, and are the ones that a comparison fits."""

import logging

import numpy as np
import pytest

from rom.commands.progress import patient_bar
from rom.comparison.entries import fit_or_load
from rom.comparison.truth import find_truth, truth_path
from rom.interactive import models as offered
from rom.interactive.models import MODAL, REFERENCE, Models
from rom.metamodels import Curve
from rom.metamodels.modal import ModalKrylov
from rom.metamodels.pod import PodGalerkin
from rom.metamodels.validity import ValidityWarning
from rom.scenes import CaseArrays
from rom.scenes.extent import Extent


@pytest.fixture
def few(monkeypatch, tmp_path):
    """A cache of its own, few cases, a small POD, no torch; the number of cases."""
    monkeypatch.setenv("ROM_CACHE", str(tmp_path))
    monkeypatch.setattr("rom.scenes.LinearScene.extent", Extent(quick_cases=96))
    monkeypatch.setattr(PodGalerkin, "quick_curve", classmethod(lambda cls, scene: Curve(({"rank": 10},))))
    monkeypatch.setattr(offered, "_torch_is_there", lambda: False)
    return 96


def truth_of(scene, cases):
    return truth_path(scene, cases, scene.extent.beyond(cases), scene.extent.seed)


def recorded(steps):
    def progress(items, title):
        for item in items:
            steps.append((title, item))
            yield item
    return progress


def test_the_first_start_fits_and_the_next_one_reads(few, tiny_tip):
    first, again = [], []
    Models(tiny_tip, quick=True).prepare(recorded(first))
    assert [method for _, (method, _) in first] == ["superposition", *reversed(MODAL)]
    models = Models(tiny_tip, quick=True)
    models.prepare(recorded(again))
    assert again == []
    assert models.is_loaded(REFERENCE, True)
    assert not models.is_loaded("modal", True)
    assert models.model("modal", False) is models.model("modal", True)


def damaged(kind, good):
    """A cached file's bytes after damage."""
    random = np.random.default_rng(7)
    if kind == "flipped":
        return bytes(byte ^ 0xff if flip else byte for byte, flip in zip(good, random.random(len(good)) < 1e-3,
                                                                         strict=True))
    return {"foreign": b"no netCDF", "empty": b"", "truncated": good[:len(good) // 2],
            "header": random.bytes(512) + good[512:]}[kind]


@pytest.mark.parametrize("kind", ["foreign", "empty", "truncated", "header", "flipped"])
def test_a_damaged_model_is_named_and_fitted_again(few, tiny_tip, caplog, kind):
    models = Models(tiny_tip, quick=True)
    models.prepare(recorded([]))
    path = models.sources[REFERENCE, True].path
    path.write_bytes(damaged(kind, path.read_bytes()))
    with caplog.at_level(logging.WARNING):
        again = Models(tiny_tip, quick=True)
        again.prepare(recorded([]))
    assert f"fitted again: {path}" in caplog.text
    assert "Traceback" not in caplog.text
    one = CaseArrays(np.array([[2]]), np.array([[0.1]]), np.array([90.0]), np.array([0.2]))
    values = [each.model(REFERENCE, True).evaluate(one, "field") for each in (models, again)]
    np.testing.assert_allclose(values[1], values[0], rtol=1e-9, atol=1e-12 * np.abs(values[0]).max())


def test_whatever_a_reader_makes_of_damage_stops_nobody(few, tiny_tip, caplog, monkeypatch):
    models = Models(tiny_tip, quick=True)
    models.prepare(recorded([]))

    def read(path, scene):
        raise AttributeError("NetCDF: HDF error")

    monkeypatch.setattr(offered, "load", read)
    monkeypatch.setattr(ModalKrylov, "save", refuse)
    Models(tiny_tip, quick=True).prepare(recorded([]))
    assert f"{models.sources[REFERENCE, True].path} cannot be read (AttributeError('NetCDF: HDF error'))" in caplog.text
    assert "cannot be written" in caplog.text


def refuse(*_, **__):
    raise PermissionError(13, "Permission denied")


def test_damaged_snapshots_and_learners_are_made_anew_on_demand(few, tiny_tip, caplog):
    models = Models(tiny_tip, quick=True)
    models.fit_all(recorded([]))
    pod = models.sources["pod-galerkin", True].path
    truth = truth_of(models.harmonic, few)
    for path in (pod, truth):
        path.write_bytes(b"no netCDF")
    again = Models(tiny_tip, quick=True)
    with pytest.raises(ValueError, match="rom serve --fit"):
        again.model("pod-galerkin", True)
    again.fit_all(recorded([]))
    assert f"solved again: {truth}" in caplog.text
    assert again.model("pod-galerkin", True).learns


def test_what_learns_is_fitted_on_demand_just_as_a_comparison_fits_it(few, tiny_tip, monkeypatch):
    models = Models(tiny_tip, quick=True)
    assert "has not been fitted" in models.reason("pod-galerkin", True)
    models.fit_all(recorded([]))
    assert models.reason("pod-galerkin", True) == models.reason("pod-galerkin", False) == ""
    assert "needs torch" in models.reason("mlp", True)
    with pytest.raises(ValueError, match="needs torch"):
        models.model("transformer", False)
    scene = models.harmonic
    truth = find_truth(scene, few, scene.extent.beyond(few), scene.extent.seed, lambda items, _: items)
    headline = fit_or_load(PodGalerkin, scene, {"rank": 10}, truth)
    cases = scene.sample(3, seed=4)
    with pytest.warns(ValidityWarning):
        expected = headline.predict(scene.cases_from(cases))
    np.testing.assert_array_equal(models.model("pod-galerkin", True).evaluate(cases, "field"), scene.values(expected))


def test_what_cannot_be_fitted_is_left_out_with_its_reason(few, tiny_tip, monkeypatch, caplog):
    monkeypatch.setattr(PodGalerkin, "quick_curve", classmethod(
        lambda cls, scene: Curve(({"rank": 60 if scene.harmonic else 6},))))
    monkeypatch.setattr("rom.scenes.LinearScene.extent", Extent(quick_cases=16))
    models = Models(tiny_tip, quick=True)
    models.fit_all(recorded([]))
    assert "pod-galerkin is left out: rank 60 is out of reach" in caplog.text
    assert models.reason("pod-galerkin", False) == ""
    assert "has not been fitted" in models.reason("pod-galerkin", True)


def test_the_patient_bar_hands_on_every_step(capsys):
    assert list(patient_bar(["a", "b"], "fitting")) == ["a", "b"]
    assert capsys.readouterr().out == ""
