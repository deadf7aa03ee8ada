"""The contract that every metamodel of load paths must pass; on the small dataset that comes with the toolkit."""

import copy
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rom.datasets.contact_paths import read_path_dataset
from rom.datasets.contact_schema import CONTACT, QUANTITIES
from rom.errors import NotFittedError, SchemaError
from rom.metamodels import ValidityWarning, applicable, create, load, metamodel_class
from rom.metamodels.registry import CONTACT_METHODS
from rom.scenes import get_scene

pytestmark = pytest.mark.filterwarnings("ignore::rom.metamodels.ValidityWarning")
SMALL = Path(__file__).parents[3] / "data" / "finger-on-glass-small.nc"
NETWORK = {"rank": 6, "width": 12, "depth": 2, "steps": 20, "seed": 5}
ROWS = {
    "direct": ("direct", {}),
    "coarse-fem": ("coarse-fem", {"scale": 0.8}),
    "interpolation": ("interpolation", {}),
    "interpolation-inverse-distance": ("interpolation", {"kind": "inverse-distance", "neighbours": 2}),
    "interpolation-nearest": ("interpolation", {"kind": "nearest"}),
    "pod-regression": ("pod-regression", {"rank": 8}),
    "pod-regression-slip": ("pod-regression", {"rank": 8, "registration": "slip"}),
    "pod-regression-ridge": ("pod-regression", {"rank": None, "regressor": "ridge", "registration": "none"}),
    "pod-regression-knn": ("pod-regression", {"rank": 8, "regressor": "knn"}),
    "mlp": ("mlp", NETWORK),
}
SOLVERS = ("direct", "coarse-fem")
LEARNERS = [name for name, (method, _) in ROWS.items() if method not in SOLVERS]
ROUNDING = 1e-4
"""What float32 and another order of the same sums may change of a quantity's largest value."""


@pytest.fixture(scope="module")
def scene():
    return get_scene("finger-on-glass", rays=40, layers=5)


@pytest.fixture(scope="module")
def train():
    return read_path_dataset(SMALL)


@pytest.fixture(scope="module", params=ROWS)
def row(request):
    return request.param


def made(row, scene):
    method, settings = ROWS[row]
    return create(method, scene, **settings)


@pytest.fixture(scope="module")
def model(row, scene, train):
    fresh = made(row, scene)
    settings = copy.deepcopy(fresh.settings)
    assert fresh.fit(train if fresh.learns else None) is fresh
    assert fresh.settings == settings and fresh.offline_seconds > 0
    return fresh


@pytest.fixture(scope="module")
def paths(row, scene):
    """A batch of mixed variants, two of the first; two paths where each is solved."""
    return scene.sample(2 if ROWS[row][0] in SOLVERS else 4, seed=9)


@pytest.fixture(scope="module")
def answer(model, paths):
    return model.evaluate(paths)


@pytest.fixture(scope="module")
def saved(row, model, tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / f"{row}.nc"
    model.save(path)
    return path


def close(found, expected, rounding=ROUNDING):
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        assert found[name].shape == values.shape
        np.testing.assert_allclose(found[name], values, rtol=0, atol=rounding * np.abs(values).max())


def test_every_method_has_a_row():
    # pod-galerkin has tests of its own
    assert {method for method, _ in ROWS.values()} | {"pod-galerkin"} == set(CONTACT_METHODS)
    assert applicable("finger-on-glass") == list(CONTACT_METHODS)
    for name in CONTACT_METHODS:
        assert metamodel_class(name, "finger-on-glass").name == name


def test_answers_have_the_shapes_of_the_dataset(scene, train, answer, paths):
    assert list(answer) == list(QUANTITIES)
    for name, values in answer.items():
        assert values.shape == (len(paths), *train[name].shape[1:])
        assert values.dtype == np.float64 and np.isfinite(values).all()
    assert (answer["pressure"] >= 0).all()
    width = answer["contact_right"] - answer["contact_left"]
    np.testing.assert_allclose(answer["contact_area"], np.pi / 4 * width**2, rtol=1e-12)
    bone = np.abs(answer["displacement"][:, :, scene.mesh.bone_nodes]).max()
    assert bone <= 1e-9 * np.abs(answer["displacement"]).max()  # the bone holds


@pytest.mark.parametrize("row", LEARNERS, indirect=True, scope="module")
def test_a_refit_forgets_the_first_fit(row, scene, train, answer, paths):
    again = made(row, scene)
    again.fit(train.isel(path=slice(0, 9))).fit(train)
    close(again.evaluate(paths), answer)


def test_predict_is_pure(model, scene, paths):
    cases = scene.cases_from(paths.take(slice(0, 1)))
    before = cases.copy(deep=True)
    first = model.predict(cases)
    second = model.predict(cases)
    xr.testing.assert_identical(first, second)
    xr.testing.assert_identical(cases, before)
    first["displacement"].values[:] = 0.0  # the answer is the caller's own
    xr.testing.assert_identical(model.predict(cases), second)


def test_predict_labels_like_the_dataset_and_carries_no_truth(model, train):
    found = model.predict(train.isel(path=slice(0, 1)))
    for name in QUANTITIES:
        assert found[name].dims == train[name].dims
        assert found[name].attrs["units"] == train[name].attrs["units"]
    for name in ("node_x", "node_y", "skin", "travel", "force_share"):
        np.testing.assert_array_equal(found[name].values, train[name].values)
    assert not {"solve_seconds", "iterations", "reason", "reached", "viscosity"} & set(found.variables)
    assert found["answered"].values.all() and found.attrs["method"] == model.name


def test_a_batch_equals_the_loop(model, answer, paths):
    loop = [model.evaluate(paths.take(slice(i, i + 1))) for i in range(len(paths))]
    close({name: np.concatenate([one[name] for one in loop]) for name in answer}, answer)


@pytest.mark.parametrize("row", LEARNERS, indirect=True, scope="module")
def test_positions_and_outputs_are_parts_of_the_whole(model, answer, paths):
    some = np.array([7, 3, 31])
    close(model.evaluate(paths, some), {name: values[:, some] for name, values in answer.items()})
    found = model.evaluate(paths, outputs="contact")
    close(found, {name: answer[name] for name in CONTACT})
    before = copy.deepcopy(paths)
    model.evaluate(paths)
    for mine, theirs in zip(paths, before, strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_saved_and_loaded_models_answer_alike(model, answer, paths, saved):
    again = load(saved)
    assert type(again) is type(model) and again.settings == model.settings
    assert again.scene is not model.scene and again.scene == model.scene
    assert again.offline_seconds == pytest.approx(model.offline_seconds)
    assert again.trained == model.trained and model.model_bytes > 0
    close(again.evaluate(paths), answer, 1e-9)


def test_damaged_and_foreign_files_are_refused(model, saved, tmp_path):
    cut = tmp_path / saved.name
    cut.write_bytes(saved.read_bytes()[:saved.stat().st_size // 3])
    other = get_scene("finger-on-glass", rays=41, layers=5)
    for ask, message in ((lambda: load(cut), saved.name), (lambda: load(saved, other), "another section or mesh"),
                         (lambda: load(SMALL), "no metamodel"), (lambda: load(tmp_path / "absent.nc"), "absent")):
        with pytest.raises(SchemaError, match=message) as refusal:
            ask()
        assert "\n" not in str(refusal.value)
    if model.learns:
        with xr.open_dataset(saved) as data:
            data.drop_vars(sorted(map(str, data.data_vars))[0]).to_netcdf(tmp_path / "part.nc")
        with pytest.raises(SchemaError, match=r"part\.nc"):
            load(tmp_path / "part.nc")


def test_nothing_is_answered_before_a_fit(row, scene, paths, tmp_path):
    fresh = made(row, scene)
    for ask in (lambda: fresh.evaluate(paths), lambda: fresh.predict(scene.cases_from(paths)),
                lambda: fresh.save(tmp_path / "x.nc")):
        with pytest.raises(NotFittedError, match="fit"):
            ask()


@pytest.mark.parametrize("row", LEARNERS, indirect=True, scope="module")
def test_learners_refuse_what_they_cannot_learn_from(row, scene, train, static_data):
    fresh = made(row, scene)
    with pytest.raises(ValueError, match="learns from stored paths"):
        fresh.fit()
    with pytest.raises(SchemaError, match="belongs to the scene"):
        fresh.fit(static_data)
    broken = train.copy(deep=True)
    broken["pressure"][1, 3, 0] = np.nan
    with pytest.raises(ValueError, match="training pressure holds a value that is not finite"):
        fresh.fit(broken)
    unfinished = train.assign(reached=train["reached"] & False)
    with pytest.raises(ValueError, match="no training path reaches its last position"):
        fresh.fit(unfinished)
    if fresh.least_paths > 1:
        with pytest.raises(ValueError, match=r"too few of radial \(1\)"):
            fresh.fit(train.isel(path=slice(0, 3)))
    assert not fresh.fitted


def test_paths_outside_the_trained_ranges_are_named(row, model, scene):
    if not model.learns:
        assert model.reasons(scene.sample_beyond(3, seed=1)) == [""] * 3
        return
    beyond = scene.cases_from(scene.sample_beyond(3, seed=1))
    with pytest.warns(ValidityWarning, match="lies outside the trained"):
        found = model.predict(beyond)
    assert all("lies outside the trained" in str(text) for text in found["validity"].values)


@pytest.mark.parametrize("row", LEARNERS, indirect=True, scope="module")
def test_a_variant_that_was_never_learned_is_refused(row, scene, train, paths):
    fresh = made(row, scene).fit(train.isel(path=np.flatnonzero(train["variant"].values != 2)))
    with pytest.raises(ValueError, match="never learned the variant random"):
        fresh.predict(scene.cases_from(paths))


def test_bad_cases_and_settings_are_refused(row, model, scene, paths):
    with pytest.raises(ValueError, match="friction holds -1"):
        model.predict(scene.cases_from(paths).assign(friction=("path", -np.ones(len(paths)))))
    with pytest.raises(ValueError, match="does not take the settings colour"):
        create(ROWS[row][0], scene, colour="blue")


@pytest.mark.parametrize(("method", "settings"), [
    ("coarse-fem", {"scale": 0.0}), ("interpolation", {"kind": "cubic"}), ("interpolation", {"neighbours": 0}),
    ("pod-regression", {"rank": 0}), ("pod-regression", {"regressor": "forest"}),
    ("pod-regression", {"registration": "maybe"}), ("mlp", {"width": 0}), ("mlp", {"learning_rate": -1.0})])
def test_impossible_settings_are_refused_in_one_sentence(scene, method, settings):
    with pytest.raises(ValueError, match=r"cannot be|is no interpolation|is unknown") as refusal:
        create(method, scene, **settings)
    assert "\n" not in str(refusal.value)


def test_linear_methods_do_not_apply(scene):
    for name in ("modal", "superposition", "transformer"):
        with pytest.raises(ValueError, match=f"{name} does not apply to finger-on-glass"):
            create(name, scene)


def test_seed_decides_the_network(scene, train):
    paths = scene.sample(3, seed=9)
    first, same, other = (create("mlp", scene, **NETWORK | {"seed": seed}).fit(train).evaluate(paths)["displacement"]
                          for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, same)
    assert np.abs(first - other).max() > 1e-6 * np.abs(first).max()
