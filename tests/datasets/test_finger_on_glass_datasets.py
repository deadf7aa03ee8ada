"""Datasets of load paths: drawn, solved on workers, resumed, read, refused."""

import json

import numpy as np
import pytest
import xarray as xr

from rom.cli import main
from rom.datasets import draw_cases, make_dataset, read_dataset, select, snapshots
from rom.errors import SchemaError
from rom.scenes import get_scene
from rom.scenes.path_answers import QUANTITIES, solve_path


@pytest.fixture(scope="module")
def scene():
    """The coarsest section that a path goes through: a path takes about a tenth of a second."""
    return get_scene("finger-on-glass", rays=32, layers=3)


@pytest.fixture(scope="module")
def made(scene, tmp_path_factory):
    return make_dataset(scene, 5, tmp_path_factory.mktemp("paths") / "paths.nc", beyond=1, seed=2)


def test_draw_holds_out_a_fifth_and_all_beyond(scene):
    paths, cases = draw_cases(scene, 30, beyond=5, seed=1)
    assert len(paths) == 35
    assert len(select(cases, "published", "test")) == 6  # 20 % of 30
    assert not set(select(cases, "published", "train")) & set(range(30, 35))
    assert set(range(30, 35)) <= set(select(cases, "hard", "test"))
    for count, beyond in ((0, 0), (3, -1), (10**9, 0)):
        with pytest.raises(ValueError, match=r"cannot be drawn|ask for fewer"):
            draw_cases(scene, count, beyond)


def test_dataset_carries_labels_units_and_mesh(scene, made):
    data = read_dataset(made)
    assert data["displacement"].dims == ("case", "position", "node", "component")
    assert data["displacement"].dtype == np.float64
    assert data.sizes == {"case": 6, "position": 32, "node": 128, "component": 2, "skin": 32, "quadrilateral": 96,
                          "corner": 4}
    for name, quantity in QUANTITIES.items():
        assert data[name].attrs["units"] == quantity.unit and data[name].attrs["long_name"]
    for name in data.variables:
        assert "long_name" in data[name].attrs, name
    assert data["mesh"].attrs["cf_role"] == "mesh_topology"
    assert data["mesh_face_nodes"].values.max() == 127


def test_dataset_holds_what_the_full_order_model_answers(scene, made):
    data = read_dataset(made)
    paths = scene.read(data)
    values, record = solve_path(scene, paths, 1)
    for name in QUANTITIES:
        # the same operations in the same order; threads may differ
        np.testing.assert_allclose(data[name].values[1], values[name], rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(data["reached"].values[1], record["reached"])
    assert (data["solve_seconds"].values > 0).all() and (data["iterations"].values >= 32).all()


def test_coulomb_and_equilibrium_hold_in_the_dataset(made):
    data = read_dataset(made)
    reached = data["reached"].values
    limit = (data["friction"] * data["normal_force"] * data["force_share"]).transpose("case", "position").values
    assert (np.abs(data["tangential_force"].values) <= limit * (1 + 1e-9))[reached].all()
    assert (data["pressure"].values[reached] >= 0).all()
    assert (data["contact_right"].values > data["contact_left"].values)[reached].all()


def test_killed_run_goes_on_from_its_pieces(scene, made, tmp_path, monkeypatch):
    path, solved = tmp_path / "paths.nc", []

    def counting(*words):
        solved.append(words[1])
        if len(solved) == 4:
            raise KeyboardInterrupt
        return original(*words)

    original = snapshots.solve_piece
    monkeypatch.setattr(snapshots, "solve_piece", counting)
    with pytest.raises(KeyboardInterrupt):
        make_dataset(scene, 5, path, beyond=1, seed=2)
    assert not path.exists()
    assert len(list((tmp_path / "paths.nc.pieces").glob("*.nc"))) == 3
    make_dataset(scene, 5, path, beyond=1, seed=2)
    assert len(solved) == 4 + 3  # three pieces were found again
    assert not (tmp_path / "paths.nc.pieces").exists()
    times = ["solve_seconds"]
    xr.testing.assert_allclose(read_dataset(path).drop_vars(times), read_dataset(made).drop_vars(times),
                               rtol=1e-6, atol=1e-9)


def test_cluster_by_address_answers_like_none(scene, made, tmp_path):
    from distributed import LocalCluster

    expected = read_dataset(made)
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0") as cluster:
        path = make_dataset(scene, 5, tmp_path / "by-address.nc", beyond=1, seed=2, scheduler=cluster.scheduler_address)
    found = read_dataset(path)
    for name in QUANTITIES:
        np.testing.assert_allclose(found[name].values, expected[name].values, rtol=1e-6, atol=1e-9)


def test_finished_file_is_found_and_another_is_not_overwritten(scene, made, tmp_path):
    assert make_dataset(scene, 5, made, beyond=1, seed=2) == made
    with pytest.raises(FileExistsError, match="was not made from this recipe"):
        make_dataset(scene, 6, made, beyond=1, seed=2)
    (tmp_path / "other.nc.pieces").mkdir()
    (tmp_path / "other.nc.pieces" / "recipe.json").write_text(json.dumps({"paths": 3}))
    with pytest.raises(SchemaError, match="pieces of another recipe"):
        make_dataset(scene, 5, tmp_path / "other.nc")


def test_cached_dataset_is_found_again(scene):
    first = make_dataset(scene, 3, seed=1)
    stamp = first.stat().st_mtime_ns
    assert make_dataset(scene, 3, seed=1) == first and first.stat().st_mtime_ns == stamp


@pytest.mark.parametrize(("options", "message"), [
    ({"workers": 0}, "workers=0 cannot be"), ({"workers": True}, "workers=True cannot be"),
    ({"workers": 2, "scheduler": "tcp://127.0.0.1:1"}, "has its own")])
def test_impossible_workers_are_refused(scene, tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        make_dataset(scene, 3, tmp_path / "x.nc", **options)


def test_foreign_and_truncated_files_are_refused(scene, made, tmp_path, static_file):
    cut = tmp_path / "cut.nc"
    cut.write_bytes(made.read_bytes()[:4000])
    other = get_scene("finger-on-glass", rays=40, layers=5)
    for path, given in ((cut, None), (tmp_path / "absent.nc", None), (static_file, None), (made, other)):
        with pytest.raises(SchemaError, match=path.name) as refusal:
            (given or scene).check_origin(read_dataset(path), path.name)
        assert "\n" not in str(refusal.value)


def test_small_dataset_is_complete(glass_file):
    data = read_dataset(glass_file)
    assert data.sizes["case"] == 12 and data.sizes["node"] == 240  # 40 rays of 6 nodes
    assert data["reached"].values.all() and (data["reason"] == "").all()
    assert sorted(np.bincount(data["variant"].values)) == [4, 4, 4]


def test_command_refuses_what_belongs_to_other_scenes(tmp_path, capsys):
    for words, message in ((["finger-on-glass", "--preset", "study"], "--preset means nothing"),
                           (["static-point-forces", "--rays", "40"], "--rays means nothing"),
                           (["finger-on-glass", "--rays", "2"], "rays=2 cannot be")):
        assert main(["dataset", *words, "--cases", "3", "--output", str(tmp_path / "x.nc")]) == 2
        assert message in capsys.readouterr().err


def test_command_makes_a_dataset(tmp_path, capsys):
    path = tmp_path / "two.nc"
    assert main(["dataset", "finger-on-glass", "--cases", "2", "--rays", "32", "--layers", "3", "--workers", "1",
                 "--output", str(path)]) == 0
    assert str(path) in capsys.readouterr().out
    assert read_dataset(path).sizes["case"] == 2
