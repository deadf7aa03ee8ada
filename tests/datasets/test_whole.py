"""The whole harmonic grid, stored reduced: verified in every case, read as if it were whole."""

import json
import pickle

import dask.array
import netCDF4
import numpy as np
import pytest
import xarray as xr

import rom.datasets.verified_rom as verified_rom
import rom.datasets.whole as whole_module
from rom import cli
from rom.datasets import (
    ReducedField,
    check_schema,
    make_whole_dataset,
    open_dataset,
    read_dataset,
    select,
)
from rom.errors import SchemaError, SolverError
from rom.fingertip.fingertip import PRESETS
from rom.scenes import CaseArrays, LinearScene

GRID = 300 * 9  # frequencies times loss factors, published
SOME = np.array([0, 5, 2699, 2700, 12345, 33333, 40499])


@pytest.fixture(scope="module", autouse=True)
def _small_pieces():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(whole_module, "LOADS_PER_PIECE", 5)
        yield


@pytest.fixture(scope="module")
def file(tiny_harmonic, tmp_path_factory):
    return make_whole_dataset(tiny_harmonic, tmp_path_factory.mktemp("whole") / "whole.nc", seed=3, confirm=40)


@pytest.fixture
def lazy(file):
    with open_dataset(file) as data:
        yield data


@pytest.fixture(scope="module")
def some(file):
    return read_dataset(file, SOME)


def test_every_case_of_the_grid_is_there(tiny_harmonic, lazy):
    inputs = np.column_stack([lazy["load_node"].values[:, 0], lazy["frequency"], lazy["loss_factor"]])
    assert len(inputs) == tiny_harmonic.n_loads * GRID
    assert len(np.unique(inputs, axis=0)) == len(inputs)
    assert set(lazy["load_node"].values[:, 0]) == set(tiny_harmonic.body.fingertip.mesh.pad_nodes)
    assert (lazy["frequency"].values.min(), lazy["frequency"].values.max()) == (1, 300)
    assert (lazy["loss_factor"].values.min(), lazy["loss_factor"].values.max()) == (0.1, 0.5)


def test_answers_are_those_of_direct_solves(tiny_harmonic, some):
    truth = tiny_harmonic.solve(tiny_harmonic.read(some))[0]["displacement"]
    answers = tiny_harmonic.values(some)
    error = np.linalg.norm(answers - truth, axis=1) / np.linalg.norm(truth, axis=1)
    assert error.max() < 1e-8


def test_stored_residuals_are_true_ones(tiny_harmonic, some):
    arrays, answers = tiny_harmonic.read(some), tiny_harmonic.values(some)
    assert float(some["residual"].max()) < verified_rom.RESIDUAL_LIMIT
    for i in range(len(SOME)):
        found = tiny_harmonic.model.residual(answers[i], tiny_harmonic.force_vectors(arrays.take([i]))[:, 0],
                                                  arrays.frequency[i], arrays.loss_factor[i])
        assert abs(found - float(some["residual"][i])) < 1e-11  # rounding of the products themselves


def test_residuals_of_poor_answers_are_true_ones(tiny_harmonic):
    model, rng = tiny_harmonic.model, np.random.default_rng(0)
    shapes, force = rng.normal(size=(model.n, 6)), tiny_harmonic.unit_loads[:, 3]
    points = np.array([[20.0, 0.1], [250.0, 0.5]])
    coefficients = rng.normal(size=(2, 6)) + 1j * rng.normal(size=(2, 6))
    found = verified_rom.ResidualCheck(model, shapes[:, :4]).residuals(shapes[:, 4:], force, coefficients, points)
    expected = [model.residual(shapes @ c, force, *point) for c, point in zip(coefficients, points, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_direct_solves_beside_are_recorded(lazy, file):
    assert lazy.sizes["confirmed"] == 40
    assert 0 < float(lazy["confirmed_error"].max()) == lazy.attrs["confirmed_error_max"] < 1e-8
    assert lazy.attrs["residual_max"] == float(lazy["residual"].max())
    cases = lazy["confirmed_case"].values
    assert len(np.unique(cases)) == 40
    points = np.column_stack([lazy["frequency"].values[cases], lazy["loss_factor"].values[cases]])
    assert len(np.unique(points, axis=0)) == 5  # eight loads to one factorization


def test_it_opens_lazily_and_as_if_it_were_whole(tiny_harmonic, harmonic_data, lazy, file):
    field = lazy["displacement"]
    assert isinstance(field.data, dask.array.Array)
    assert field.dims == ("case", "node", "component")
    assert field.shape == (tiny_harmonic.n_loads * GRID, len(tiny_harmonic.body.fingertip.mesh.nodes), 3)
    assert field.dtype == complex
    check_schema(lazy, "here")
    tiny_harmonic.check_origin(lazy)
    assert {name: field.attrs[name] for name in ("units", "long_name", "mesh", "location")} == {
        "units": "m", "long_name": "displacement amplitude", "mesh": "mesh", "location": "node"}
    # whatever a whole dataset has, it has too
    assert set(harmonic_data.variables) <= set(lazy.variables)
    assert set(harmonic_data.attrs) <= set(lazy.attrs)


def test_both_ways_of_picking_agree(lazy, file, some):
    truth = some["displacement"].values
    with open_dataset(file, chunks=None) as other:
        for data in (lazy, other):
            np.testing.assert_allclose(data["displacement"][SOME].values, truth, rtol=1e-12, atol=1e-20)
            one = data["displacement"][int(SOME[4])].values
            np.testing.assert_allclose(one, truth[4], rtol=1e-12, atol=1e-20)
            part = data["displacement"].isel(case=SOME, node=[3, 40], component=2).values
            np.testing.assert_allclose(part, truth[:, [3, 40], 2], rtol=1e-12, atol=1e-20)
            part = data["displacement"].isel(case=slice(2699, 2702), node=slice(5, 9), component=[0, 1]).values
            np.testing.assert_allclose(part[:2], truth[2:4, 5:9, :2], rtol=1e-12, atol=1e-20)
            assert data["displacement"].isel(case=7, node=3, component=1).values.shape == ()
    xr.testing.assert_identical(read_dataset(file, [5]).drop_vars("displacement"),
                                some.isel(case=[1]).drop_vars("displacement"))


def test_the_field_projects_and_measures_without_fields(tiny_harmonic, file, some):
    field = ReducedField(file)
    values = tiny_harmonic.values(some)
    np.testing.assert_allclose(field.fields(SOME), values, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(field.norms(SOME), np.linalg.norm(values, axis=1), rtol=1e-12)
    vectors = np.linalg.qr(np.random.default_rng(1).normal(size=(tiny_harmonic.n_free, 4)))[0]
    np.testing.assert_allclose(field.project(vectors, SOME), values @ vectors, rtol=1e-9, atol=1e-18)
    assert field.project(vectors).shape == (len(field), 4)
    again = pickle.loads(pickle.dumps(field))
    np.testing.assert_array_equal(again.fields(SOME), field.fields(SOME))


def test_splits_hold_out_what_they_say(tiny_harmonic, lazy):
    held = select(lazy, "published", "test")
    assert len(held) == round(0.2 * lazy.sizes["case"])
    hard = select(lazy, "hard", "test")
    assert np.isin(tiny_harmonic.body.fingertip.mesh.pad_nodes[tiny_harmonic.held_out_loads(3)],
                   lazy["load_node"].values[hard, 0]).all()
    assert set(np.unique(lazy["hard_region"])) == {0, 1, 2}


def test_beyond_the_published_ranges(tiny_harmonic, tmp_path):
    path = make_whole_dataset(tiny_harmonic, tmp_path / "wide.nc", beyond=True, confirm=8)
    with open_dataset(path) as data:
        assert data.sizes["case"] == tiny_harmonic.n_loads * (GRID + 100 * 9 + 300 * 2)
        assert set(np.unique(data["hard_region"])) == {0, 1, 2, 3, 4}
        assert (data["split_published"][tiny_harmonic.n_loads * GRID:] == 0).all()
        wide = np.flatnonzero((data["frequency"].values == 397) & (data["loss_factor"].values == 0.15))[:3]
        low = np.flatnonzero(data["loss_factor"].values == 0.05)[-3:]
        cases = read_dataset(path, np.concatenate([wide, low]))
        node, point = data["load_node"].values[:, 0], data["frequency"].values
        confirmed = data["confirmed_case"].values
        assert len(np.unique(node[confirmed])) == 8 and len(np.unique(point[confirmed])) == 1
    truth = tiny_harmonic.solve(tiny_harmonic.read(cases))[0]["displacement"]
    np.testing.assert_allclose(tiny_harmonic.values(cases), truth, rtol=0, atol=1e-8 * np.abs(truth).max())


def test_single_precision_states_what_it_costs(tiny_harmonic, file, tmp_path):
    path = make_whole_dataset(tiny_harmonic, tmp_path / "single.nc", seed=3, confirm=8, precision="float32")
    assert path.stat().st_size < 0.9 * file.stat().st_size
    single, double = ReducedField(path), ReducedField(file)
    error = np.linalg.norm(single.fields(SOME) - double.fields(SOME), axis=1) / double.norms(SOME)
    stated = single.data.attrs["precision_error_max"]
    assert 1e-9 < error.max() <= stated < 1e-6
    assert double.data.attrs["precision_error_max"] == 0
    assert double.data.attrs["single_precision_error_max"] == pytest.approx(stated, rel=0.3)


# ---- nothing is lost, nothing is overwritten, nothing foreign is read ------------------------------------------

def test_an_interrupted_run_goes_on(tiny_harmonic, file, tmp_path):
    path, done = tmp_path / "again.nc", []

    def stopping(items):
        for k in items:
            if k == 2:
                raise KeyboardInterrupt
            yield k

    with pytest.raises(KeyboardInterrupt):
        make_whole_dataset(tiny_harmonic, path, seed=3, confirm=40, progress=stopping)
    assert not path.exists()
    folder = tmp_path / "again.nc.pieces"
    kept = {piece.name: piece.stat().st_mtime_ns for piece in folder.glob("0*.nc")}
    assert set(kept) == {"00000.nc", "00001.nc"}

    def watching(items):
        for k in items:
            done.append(k)
            yield k
        assert {name: (folder / name).stat().st_mtime_ns for name in kept} == kept

    make_whole_dataset(tiny_harmonic, path, seed=3, confirm=40, progress=watching)
    assert done == [0, 1, 2] and not folder.exists()
    np.testing.assert_allclose(ReducedField(path).fields(SOME), ReducedField(file).fields(SOME), rtol=1e-6, atol=1e-16)
    before = path.stat().st_mtime_ns
    assert make_whole_dataset(tiny_harmonic, path, seed=3, confirm=40).stat().st_mtime_ns == before
    with pytest.raises(FileExistsError, match="not made from this recipe"):
        make_whole_dataset(tiny_harmonic, path, seed=4, confirm=40)


def test_too_few_vectors_are_refused(tiny_harmonic, tmp_path):
    with pytest.raises(SolverError, match=r"load \d+ at \d+ Hz and loss factor 0.1 .* above 1e-08: give more modes"):
        make_whole_dataset(tiny_harmonic, tmp_path / "poor.nc", modes=10, vectors=2)
    assert not (tmp_path / "poor.nc").exists()


def test_an_answer_that_a_direct_solve_contradicts_is_refused(tiny_harmonic, tmp_path, monkeypatch):
    def wrong(scene, arrays):
        answers, record = solve(scene, arrays)
        answers["displacement"][-1] *= 1 + 1e-5
        return answers, record

    solve = LinearScene.solve
    monkeypatch.setattr(LinearScene, "solve", wrong)
    with pytest.raises(SolverError, match=r"differs from its direct solve by 1.0e-05, above 1e-06"):
        make_whole_dataset(tiny_harmonic, tmp_path / "wrong.nc", confirm=8)
    assert not (tmp_path / "wrong.nc").exists()


@pytest.mark.parametrize(("settings", "text"), [
    ({"modes": 0}, "modes=0"), ({"vectors": 0}, "vectors=0"), ({"confirm": 0}, "confirm=0"),
    ({"precision": "float16"}, "one of float64, float32")])
def test_settings_that_cannot_be_are_refused(tiny_harmonic, tmp_path, settings, text):
    with pytest.raises(ValueError, match=text):
        make_whole_dataset(tiny_harmonic, tmp_path / "none.nc", **settings)


def test_other_scenes_are_refused(static, tmp_path):
    with pytest.raises(ValueError, match="static-point-forces has no whole harmonic grid"):
        make_whole_dataset(static, tmp_path / "none.nc")


def test_damaged_foreign_and_whole_files_are_refused(file, harmonic_file, tmp_path):
    cut = tmp_path / "cut.nc"
    cut.write_bytes(file.read_bytes()[:-5000])
    with pytest.raises(SchemaError, match=r"cut.nc is (truncated|damaged)"):
        read_dataset(cut, [1])
    with pytest.raises(SchemaError, match=r"does not exist"):
        open_dataset(tmp_path / "absent.nc")
    with pytest.raises(SchemaError, match="is not stored reduced"):
        ReducedField(harmonic_file)
    part = tmp_path / "part.nc"
    with xr.open_dataset(file) as data:
        data.drop_vars(["own_theta"]).to_netcdf(part)
    with pytest.raises(SchemaError, match=r"part\.nc lacks own_theta"):
        open_dataset(part)
    old = tmp_path / "old.nc"
    old.write_bytes(file.read_bytes())
    with netCDF4.Dataset(old, "a") as raw:
        raw.schema_version = "0.9"
    with pytest.raises(SchemaError, match=r"schema version 0\.9"):
        open_dataset(old)


def test_more_than_memory_is_refused(file, monkeypatch):
    monkeypatch.setattr("rom.datasets.reduced.MOST_BYTES", 1e6)
    with pytest.raises(ValueError, match=r"40500 cases of .* name fewer"):
        read_dataset(file)


def test_whole_files_open_lazily_too(harmonic_file, harmonic_data):
    with open_dataset(harmonic_file) as data:
        assert isinstance(data["displacement"].data, dask.array.Array)
        xr.testing.assert_identical(data.load(), harmonic_data)


def test_arrays_of_the_whole_set_name_each_case(tiny_harmonic):
    whole = whole_module.WholeSet(tiny_harmonic, whole_module.published_points(), whole_module.published_points(True))
    arrays = whole.arrays()
    rng = np.random.default_rng(0)
    node, point = rng.integers(tiny_harmonic.n_loads, size=50), rng.integers(len(whole.points), size=50)
    found: CaseArrays = arrays.take(whole.case_number(node, point))
    np.testing.assert_array_equal(found.node[:, 0], node)
    np.testing.assert_array_equal(np.column_stack([found.frequency, found.loss_factor]), whole.points[point])


def test_the_command_makes_it(tmp_path, monkeypatch, capsys, tiny_tip):
    monkeypatch.setitem(PRESETS, "metamodel", tiny_tip.density)
    path = tmp_path / "whole.nc"
    assert cli.main(["dataset", "harmonic-point-force", "--whole", "--output", str(path)]) == 0
    with open_dataset(path) as data:
        assert json.loads(data.attrs["recipe"])["whole"] and data.sizes["confirmed"] >= 300
    capsys.readouterr()
    assert cli.main(["dataset", "harmonic-point-force", "--whole", "--beyond", "5", "--output", str(path)]) == 2
    assert "--whole takes no --beyond" in capsys.readouterr().err
