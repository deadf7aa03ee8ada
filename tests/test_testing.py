"""`rom.testing.check_metamodel` passes methods that strangers write, and catches each promise that is broken."""

import sys
from pathlib import Path

import numpy as np
import pytest
from own_methods import MeanPath, StaticResponse

sys.path.insert(0, str(Path(__file__).parent / "metamodels"))

from conformance import springs

from rom.datasets import read_dataset
from rom.errors import SchemaError
from rom.metamodels import Metamodel, create, load, metamodel_class, method_names, register, registry
from rom.metamodels.validity import Assessment
from rom.scenes import get_scene
from rom.testing import PROMISES, check_metamodel


@pytest.fixture(scope="module")
def scene():
    return springs(harmonic=True)


@pytest.fixture
def registered(monkeypatch):
    monkeypatch.setattr(registry, "_REGISTERED", {})
    return register(StaticResponse), register(MeanPath)


@pytest.mark.parametrize("name", ["springs", "springs at a frequency", "static", "patches"])
def test_a_strangers_method_passes_on_any_linear_scene(name, request):
    scene = springs(name != "springs") if name.startswith("springs") else request.getfixturevalue(name)
    check_metamodel(StaticResponse(scene))


def test_a_strangers_method_passes_on_the_finger_on_glass(glass_file):
    check_metamodel(MeanPath(get_scene("finger-on-glass", rays=40, layers=5)), read_dataset(glass_file))


def test_a_method_that_learns_is_given_cases_where_none_are(scene):
    class Copy(StaticResponse):
        learns = True

    check_metamodel(Copy(scene))


def test_a_registered_method_is_one_of_all(registered, scene, tmp_path):
    assert method_names()[-2:] == ["static-response", "mean-path"]
    assert metamodel_class("static-response", scene) is StaticResponse
    with pytest.raises(ValueError, match="mean-path does not apply to springs-at-a-frequency: it has seen load paths"):
        create("mean-path", scene)
    create("static-response", scene).fit().save(tmp_path / "a.nc")
    assert isinstance(load(tmp_path / "a.nc", scene), StaticResponse)
    with pytest.raises(ValueError, match="the name 'modal' is taken"):
        register(type("Mine", (StaticResponse,), {"name": "modal"}))
    with pytest.raises(ValueError, match="is no metamodel with a name"):
        register(dict)


# ---- what is broken is caught -------------------------------------------------------------------------------

def changed(answer):
    """A method whose answers go through ``answer(self, cases, values)``."""
    def evaluate(self, cases, outputs, out):
        values = StaticResponse._evaluate(self, cases, outputs, out)
        values[:] = answer(self, cases, values)
        return values
    return {"_evaluate": evaluate}


def keeps_no_settings(self, train):
    self.settings["rank"] = 3
    StaticResponse._fit(self, train)


def other_each_time(self, cases, values):
    self.calls = getattr(self, "calls", 0) + 1
    return values * self.calls


def without_units(self, cases, tolerance=None):
    answer = StaticResponse.predict(self, cases, tolerance)
    answer["displacement"].attrs = {}
    return answer


def believes_everything(self, cases, tolerance=None):
    try:
        return StaticResponse.predict(self, cases, tolerance)
    except ValueError:
        return cases


def learns_blindly(self, train=None):
    self.trained = 1
    self.fitted, self.offline_seconds = True, 1.0
    self._fit(train)
    return self


@classmethod
def loads_anything(cls, path, scene=None):
    try:
        return StaticResponse.load.__func__(cls, path, scene)
    except SchemaError:
        if scene is None:
            raise
        return cls(scene).fit()


BROKEN = {
    "states_its_facts": {"colour": "blue"},
    "answers_nothing_before_a_fit": {"_check_fitted": lambda self: self._fit(None) if not self.fitted else None},
    "fits_and_refits": {"_fit": keeps_no_settings},
    "refuses_what_it_cannot_learn_from": {"learns": True, "fit": learns_blindly},
    "predicts_purely": changed(other_each_time) | {"seeded": False},
    "labels_like_the_truth": {"predict": without_units},
    "evaluates_a_batch_like_its_parts": changed(lambda self, cases, values: values * len(cases)),
    "gives_the_part_that_is_asked_for": {
        "evaluate": lambda self, cases, outputs=None, out=None: StaticResponse.evaluate(self, cases, outputs)},
    "is_linear_where_the_scene_is": changed(lambda self, cases, values: values + 1e-6),
    "judges_itself_honestly": {"assess": lambda self, cases, values=None: Assessment(
        np.zeros(len(cases)), "bound", np.full(len(cases), ""))},
    "saves_and_loads": {"stored": ()},
    "refuses_wrong_files": {"load": loads_anything},
    "follows_its_seed": {"seeded": True, "__init__": lambda self, scene, seed=0: Metamodel.__init__(
        self, scene, seed=seed)},
    "refuses_wrong_cases": {"predict": believes_everything},
}


def test_each_promise_has_a_method_that_breaks_it():
    assert list(BROKEN) == [promise.__name__ for promise in PROMISES]


@pytest.mark.parametrize("promise", PROMISES, ids=lambda promise: promise.__name__)
def test_a_broken_promise_is_caught_and_named(promise, scene):
    broken = type("Broken", (StaticResponse,), BROKEN[promise.__name__])
    with pytest.raises((AssertionError, AttributeError)) as caught:
        check_metamodel(broken(scene))
    assert caught.value.__notes__ == [f"static-response breaks the promise: {promise.__doc__}"]
