"""What methods of the finger on glass promise beside the contract: lawful answers, honest refusals."""

import numpy as np
import pytest
from conformance import GLASS, ROWS

from rom.datasets import read_dataset
from rom.metamodels import ValidityWarning, applicable, create
from rom.scenes import get_scene
from rom.scenes.path_answers import QUANTITIES

pytestmark = pytest.mark.filterwarnings("ignore::rom.metamodels.ValidityWarning")
# pod-galerkin has tests of its own
LEARNERS = [row for row in ROWS if row.scene == GLASS and row.method != "pod-galerkin"]


@pytest.fixture(scope="module")
def scene():
    return get_scene(GLASS, rays=40, layers=5)


@pytest.fixture(scope="module")
def train(glass_file):
    return read_dataset(glass_file)


@pytest.fixture(scope="module", params=LEARNERS, ids=str)
def row(request):
    return request.param


@pytest.fixture
def fresh(row, scene):
    return create(row.method, scene, **row.settings)


def test_answers_have_the_shapes_of_the_dataset_and_obey_the_contact(fresh, scene, train):
    paths = scene.sample(4, seed=9)
    answer = fresh.fit(train).evaluate(paths)
    assert list(answer) == list(QUANTITIES)
    for name, values in answer.items():
        assert values.shape == (len(paths), *train[name].shape[1:])
        assert values.dtype == np.float64 and np.isfinite(values).all()
    assert (answer["pressure"] >= 0).all()
    width = answer["contact_right"] - answer["contact_left"]
    np.testing.assert_allclose(answer["contact_area"], np.pi / 4 * width**2, rtol=1e-12)
    bone = np.abs(answer["displacement"][:, :, scene.mesh.bone_nodes]).max()
    assert bone <= 1e-9 * np.abs(answer["displacement"]).max()  # the bone holds


def test_what_cannot_be_learned_from_is_refused(fresh, train):
    broken = train.copy(deep=True)
    broken["pressure"][1, 3, 0] = np.nan
    with pytest.raises(ValueError, match="training pressure holds a value that is not finite"):
        fresh.fit(broken)
    unfinished = train.assign(reached=train["reached"] & False)
    with pytest.raises(ValueError, match="no training path reaches its last position"):
        fresh.fit(unfinished)
    if fresh.name != "interpolation":
        with pytest.raises(ValueError, match=r"too few of radial \(1\)"):
            fresh.fit(train.isel(case=slice(0, 3)))
    assert not fresh.fitted


def test_paths_outside_the_trained_ranges_are_named(fresh, scene, train):
    beyond = scene.cases_from(scene.sample_beyond(3, seed=1))
    fresh.fit(train)
    with pytest.warns(ValidityWarning, match="outside the"):
        found = fresh.predict(beyond)
    assert all("of training" in str(text) for text in found["validity"].values)


def test_a_variant_that_was_never_learned_is_refused(fresh, scene, train):
    fresh.fit(train.isel(case=np.flatnonzero(train["variant"].values != 2)))
    with pytest.raises(ValueError, match="never learned the variant random"):
        fresh.predict(scene.cases_from(scene.sample(4, seed=9)))


def test_bad_cases_and_settings_are_refused(fresh, scene, train):
    paths = scene.sample(2)
    with pytest.raises(ValueError, match="friction holds -1"):
        fresh.fit(train).predict(scene.cases_from(paths).assign(friction=("case", -np.ones(len(paths)))))
    with pytest.raises(ValueError, match="does not take the settings colour"):
        create(fresh.name, scene, colour="blue")


@pytest.mark.parametrize(("method", "settings"), [
    ("coarse-fem", {"scale": 0.0}), ("interpolation", {"kind": "cubic"}), ("interpolation", {"neighbours": 0}),
    ("pod-regression", {"rank": 0}), ("pod-regression", {"regressor": "forest"}),
    ("pod-regression", {"registration": "maybe"}), ("mlp", {"width": 0}), ("mlp", {"learning_rate": -1.0})])
def test_impossible_settings_are_refused_in_one_sentence(scene, method, settings):
    with pytest.raises(ValueError, match=r"cannot be|is unknown") as refusal:
        create(method, scene, **settings)
    assert "\n" not in str(refusal.value)


def test_linear_methods_do_not_apply(scene):
    reasons = applicable(scene)
    for name in ("modal", "superposition", "transformer"):
        assert reasons[name]
        with pytest.raises(ValueError, match=f"{name} does not apply to finger-on-glass"):
            create(name, scene)
