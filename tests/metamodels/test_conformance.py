"""The contract that every registered metamodel must pass, on every scene that it answers."""

import copy
import json

import numpy as np
import pytest
import xarray as xr
from conformance import ROWS
from safetensors.numpy import load_file, save_file

from rom.relative import relative_errors
from rom.errors import NotFittedError, SchemaError
from rom.fingertip import Fingertip, MeshDensity
from rom.metamodels import METHODS, create, load, metamodel_class
from rom.datasets.tensors import read_attributes
from rom.scenes import SCENES, CaseArrays, get_scene

pytestmark = pytest.mark.filterwarnings("ignore::rom.metamodels.ValidityWarning")  # test_validity.py looks at them
N_CASE = 6
SOLVERS = ("direct", "direct-reused", "coarse-fem")
"""Methods that solve a full model for each case: nothing of theirs is stored but settings."""


def only(condition):
    """Run a test on the rows that it means something for."""
    return pytest.mark.parametrize("row", [row for row in ROWS if condition(row)], ids=str, indirect=True,
                                   scope="module")


@pytest.fixture(scope="module", params=ROWS, ids=str)
def row(request):
    return request.param


@pytest.fixture(scope="module")
def scene(row, scene_of):
    return scene_of[row.scene]


@pytest.fixture(scope="module")
def train(row, data_of):
    return data_of[row.scene]


@pytest.fixture(scope="module")
def model(row, scene, train):
    made = create(row.method, scene, **row.settings)
    settings = copy.deepcopy(made.settings)
    assert made.fit(train if row.learns else None) is made
    assert made.settings == settings
    assert made.offline_seconds > 0
    return made


@pytest.fixture(scope="module")
def cases(scene, train):
    """Inputs alone, spread over the dataset."""
    names = [*scene.load_variables, *scene.point_variables]
    return train[names].isel(case=np.linspace(0, train.sizes["case"] - 1, N_CASE).astype(int))


@pytest.fixture(scope="module")
def arrays(scene, cases):
    return scene.read(cases)


@pytest.fixture(scope="module")
def saved(row, model, tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / f"{row.method}{row.suffix}"
    model.save(path)
    return path


def close(found, expected, rounding):
    assert found.shape == expected.shape
    assert relative_errors(found, expected).max() <= rounding


def test_every_method_answers_some_scene_and_has_a_row():
    assert {row.method for row in ROWS} == set(METHODS)


def test_a_refit_forgets_the_first_fit(row, scene, train, model, arrays):
    again = create(row.method, scene, **row.settings)
    settings = copy.deepcopy(again.settings)
    for data in (train.isel(case=slice(1, None, 2)), train):
        assert again.fit(data if row.learns else None) is again
    assert again.settings == settings
    close(again.evaluate(arrays), model.evaluate(arrays), row.rounding)


def test_predict_is_pure(model, cases):
    before = cases.copy(deep=True)
    first = model.predict(cases)
    second = model.predict(cases)
    xr.testing.assert_identical(first, second)
    xr.testing.assert_identical(cases, before)
    first["displacement"].values[:] = 0.0  # the answer is the caller's own
    xr.testing.assert_identical(model.predict(cases), second)


def test_evaluate_leaves_its_inputs_alone(model, arrays):
    before = copy.deepcopy(arrays)
    model.evaluate(arrays)
    for found, expected in zip(arrays, before, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_answers_go_where_they_are_wanted(row, model, arrays):
    for outputs in ("field", "pad"):
        fresh = model.evaluate(arrays, outputs)
        given = np.full_like(fresh, np.nan)
        assert model.evaluate(arrays, outputs, given) is given
        close(given, fresh, row.rounding)
    with pytest.raises(ValueError, match="out has shape"):
        model.evaluate(arrays, "field", np.empty((len(arrays), 5), dtype=fresh.dtype))


def test_answers_have_the_labels_of_the_full_order_model(row, scene, train, model, cases):
    found, truth = model.predict(cases)["displacement"], train["displacement"].isel(case=slice(N_CASE))
    assert found.dims == truth.dims == ("case", "node", "component")
    assert found.shape == (N_CASE, *truth.shape[1:])
    assert {name: found.attrs[name] for name in ("units", "long_name")} == {
        name: truth.attrs[name] for name in ("units", "long_name")}
    for name in ("node", "component", "node_x", "node_y", "node_z"):
        xr.testing.assert_identical(found[name].variable, train[name].variable)
    np.testing.assert_array_equal(found["case"], cases["case"])
    wanted = truth.dtype if not row.single else np.complex64 if scene.harmonic else np.float32
    assert found.dtype == wanted
    assert np.isfinite(found.values).all()
    assert (found.values[:, scene.body.fingertip.mesh.bone_nodes] == 0).all()  # the bone holds


def test_answers_to_a_stored_dataset_do_not_carry_its_truth(model, train):
    answer = model.predict(train.isel(case=slice(2)))
    assert "residual" not in answer and "solve_seconds" not in answer
    assert answer.attrs["method"] == model.name


def test_a_batch_equals_the_loop(row, model, arrays):
    batch = model.evaluate(arrays)
    loop = np.concatenate([model.evaluate(arrays.take(slice(i, i + 1))) for i in range(len(arrays))])
    close(batch, loop, row.rounding)
    order = np.random.default_rng(0).permutation(len(arrays))
    close(model.evaluate(arrays.take(order)), batch[order], row.rounding)


@only(lambda row: row.method not in SOLVERS)
def test_a_batch_longer_than_a_block_equals_its_parts(row, model, arrays):
    long = arrays.take(np.arange(150) % len(arrays))  # blocks of combine() hold 64
    close(model.evaluate(long), model.evaluate(arrays)[np.arange(150) % len(arrays)], row.rounding)


def test_pad_outputs_are_the_pad_rows_of_the_field(row, scene, model, arrays):
    close(model.evaluate(arrays, "pad"), model.evaluate(arrays, "field")[:, scene.part_rows], row.rounding)
    one = arrays.take(slice(0, 1))
    close(model.evaluate(one, "pad"), model.evaluate(one, "field")[:, scene.part_rows], row.rounding)


def test_amplitude_multiplies(row, model, arrays):
    scaled = CaseArrays(arrays.node, -2.5 * arrays.force, arrays.frequency, arrays.loss_factor)
    close(model.evaluate(scaled), -2.5 * model.evaluate(arrays), row.rounding)


def test_forces_add(row, scene, model):
    rng = np.random.default_rng(1)
    node = np.stack([rng.permutation(scene.n_loads)[:5] for _ in range(3)])  # five: beyond what any scene draws
    force = rng.uniform(0.1, 1.0, node.shape)
    point = (rng.uniform(1.0, 300.0, 3), rng.uniform(0.1, 0.5, 3)) if scene.harmonic else ()
    alone = [model.evaluate(CaseArrays(node[:, [j]], force[:, [j]], *point)) for j in range(5)]
    close(model.evaluate(CaseArrays(node, force, *point)), sum(alone), row.rounding)


def test_room_for_further_forces_changes_nothing(row, model, arrays):
    wide = CaseArrays(np.pad(arrays.node, ((0, 0), (0, 2))), np.pad(arrays.force, ((0, 0), (0, 2))),
                      arrays.frequency, arrays.loss_factor)
    close(model.evaluate(wide), model.evaluate(arrays), row.rounding)


def test_model_bytes_count_what_is_held(model):
    assert model.model_bytes > 0
    assert model.online_bytes >= 0


# ---- files --------------------------------------------------------------------------------------------------

def test_saved_and_loaded_models_answer_alike(row, scene, model, arrays, saved):
    again = load(saved, scene)
    assert type(again) is type(model)
    assert again.settings == model.settings
    assert again.offline_seconds == pytest.approx(model.offline_seconds)
    exact = row.rounding if row.method in SOLVERS else 0.0
    close(again.evaluate(arrays), model.evaluate(arrays), exact)
    assert again.trained == model.trained
    for name, values in model.indicators(arrays).items():
        np.testing.assert_array_equal(again.indicators(arrays)[name][1], values[1])


def test_files_rebuild_their_own_scene(model, saved):
    again = load(saved)
    assert again.scene is not model.scene
    assert again.scene.to_json() == model.scene.to_json()
    assert again.scene.content_hash == model.scene.content_hash


def test_files_of_another_mesh_are_refused(scene, saved):
    other = get_scene(scene.name, Fingertip(density=MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))))
    with pytest.raises(SchemaError, match=f"{saved.name} belongs to another anatomy or mesh"):
        load(saved, other)


def test_files_of_another_anatomy_are_refused(scene, saved):
    tip = scene.body.fingertip
    stiffer = tip.anatomy.to_dict()
    stiffer["dermis"]["elastic_modulus"] *= 1.01
    other = get_scene(scene.name, Fingertip(type(tip.anatomy).from_dict(stiffer), tip.density))
    with pytest.raises(SchemaError, match=f"{saved.name} belongs to another anatomy or mesh"):
        load(saved, other)


def test_files_of_another_scene_are_refused(row, scene, scene_of, saved):
    other = next(scene_of[name] for name in SCENES if name != row.scene)
    with pytest.raises((SchemaError, ValueError), match=r"fitted to the scene|does not apply"):
        load(saved, other)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.97])
def test_truncated_files_are_refused(scene, saved, tmp_path, share):
    content = saved.read_bytes()
    cut = tmp_path / saved.name
    cut.write_bytes(content[:int(share * len(content))])
    with pytest.raises(SchemaError, match=saved.name) as refusal:
        load(cut, scene)
    assert "\n" not in str(refusal.value)


def test_foreign_files_are_refused(row, scene, static_file, tmp_path):
    text = tmp_path / f"text{row.suffix}"
    text.write_text("four words of nonsense\n")
    for path in (text, tmp_path / f"absent{row.suffix}", static_file):
        with pytest.raises(SchemaError, match=path.name):
            load(path, scene)


@only(lambda row: row.method not in SOLVERS)  # whose files hold no arrays: the scene is all that they are
def test_a_file_without_its_arrays_is_refused(row, scene, saved, tmp_path):
    if row.network:
        path, arrays = tmp_path / "part.safetensors", load_file(saved)
        arrays.pop(sorted(arrays)[0])
        save_file(arrays, path, {name: json.dumps(value) for name, value in read_attributes(saved).items()})
    else:
        path = tmp_path / "part.nc"
        with xr.open_dataset(saved) as data:
            data.drop_vars(sorted(map(str, data.data_vars))[0]).to_netcdf(path)
    with pytest.raises(SchemaError, match=path.name):
        load(path, scene)


# ---- refusals -----------------------------------------------------------------------------------------------

def test_nothing_is_answered_before_a_fit(row, scene, cases, arrays, tmp_path):
    fresh = create(row.method, scene, **row.settings)
    assert not fresh.fitted
    path = tmp_path / f"fresh{row.suffix}"
    for ask in (lambda: fresh.predict(cases), lambda: fresh.evaluate(arrays), lambda: fresh.save(path)):
        with pytest.raises(NotFittedError, match="fit"):
            ask()
    assert not path.exists()


@only(lambda row: row.learns)
def test_learners_refuse_what_they_cannot_learn_from(row, scene, data_of, train):
    fresh = create(row.method, scene, **row.settings)
    with pytest.raises(ValueError, match="give fit\\(\\) a training dataset"):
        fresh.fit()
    other = next(data_of[name] for name in SCENES if name != row.scene)
    with pytest.raises(SchemaError, match="belongs to the scene"):
        fresh.fit(other)
    broken = train.isel(case=slice(30)).copy(deep=True)
    broken["displacement"][3, -1, 0] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        fresh.fit(broken)
    assert not fresh.fitted


def test_scenes_that_a_method_does_not_answer_are_refused(row, scene_of):
    kind = metamodel_class(row.method)
    for name in set(SCENES) - set(kind.scenes):
        with pytest.raises(ValueError, match=f"{row.method} does not apply to {name}"):
            create(row.method, scene_of[name])


def test_unknown_settings_are_refused(row, scene):
    with pytest.raises(ValueError, match=f"{row.method} does not take the settings colour"):
        create(row.method, scene, colour="blue")


@only(lambda row: row.network)
def test_the_seed_decides_a_network(row, scene, train, model, arrays):
    same = create(row.method, scene, **row.settings).fit(train)
    np.testing.assert_array_equal(same.evaluate(arrays), model.evaluate(arrays))
    other = create(row.method, scene, **row.settings | {"seed": row.settings["seed"] + 1}).fit(train)
    # weights, not answers: an output layer in closed form may leave nothing to chance
    assert not other._state().identical(model._state())
