"""Making datasets: what is stored, and that nothing finished is lost by a kill, a full disk or another recipe."""

import errno
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import rom.datasets.snapshots as snapshots
from rom import cli
from rom.datasets import draw_cases, make_dataset, read_dataset, solve_dataset
from rom.errors import SchemaError, SolverError
from rom.files import remove_leftovers
from rom.fingertip.fingertip import PRESETS
from rom.scenes import CaseArrays, direct_truth

SCRIPT = Path(__file__).with_name("small_dataset.py")
CASES, PIECE_CASES, SEED = 48, 8, 6  # those of SCRIPT


@pytest.fixture(autouse=True)
def _small_pieces(monkeypatch):
    monkeypatch.setattr(direct_truth, "PIECE_CASES", PIECE_CASES)


@pytest.fixture(scope="module")
def uninterrupted(tiny_harmonic, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(direct_truth, "PIECE_CASES", PIECE_CASES)
        return read_dataset(make_dataset(tiny_harmonic, CASES, tmp_path_factory.mktemp("whole") / "set.nc", seed=SEED))


def run_script(*words, environment):
    return subprocess.Popen([sys.executable, str(SCRIPT), *map(str, words)], env=environment, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def equal(found, expected):
    """The same cases and answers; only the clock and another factorization's rounding may differ."""
    loose = ["solve_seconds", "residual", "displacement"]
    xr.testing.assert_identical(found.drop_vars(loose), expected.drop_vars(loose))
    np.testing.assert_allclose(found["displacement"], expected["displacement"], rtol=0,
                               atol=1e-9 * float(np.abs(expected["displacement"]).max()))


def times(folder):
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("?????.nc")}


def test_answers_are_those_of_the_model(tiny_harmonic, uninterrupted):
    arrays, cases = draw_cases(tiny_harmonic, CASES, seed=SEED)
    _, record = tiny_harmonic.solve(arrays)
    assert record["residual"].max() <= 1e-10
    # case order, whatever the grouping: each answer belongs to its own inputs
    answers = tiny_harmonic.values(uninterrupted)
    for i in range(0, CASES, 5):
        force = tiny_harmonic.force_vectors(arrays.take([i]))[:, 0]
        assert tiny_harmonic.model.residual(answers[i], force, arrays.frequency[i], arrays.loss_factor[i]) <= 1e-9
    xr.testing.assert_identical(cases["frequency"], uninterrupted["frequency"])


def test_no_number_of_workers_changes_a_bit(tiny_harmonic, uninterrupted, tmp_path):
    found = read_dataset(make_dataset(tiny_harmonic, CASES, tmp_path / "set.nc", seed=SEED, workers=2))
    xr.testing.assert_identical(found.drop_vars("solve_seconds"), uninterrupted.drop_vars("solve_seconds"))


def test_pieces_hold_whole_groups_and_every_case_once(tiny_harmonic, static):
    for scene in (tiny_harmonic, static):
        arrays = scene.sample(70, 1)
        pieces = scene.pieces(arrays)
        np.testing.assert_array_equal(np.sort(np.concatenate(pieces)), np.arange(70))
        assert len(pieces) > 3 and max(map(len, pieces)) <= 2 * PIECE_CASES


def test_cases_of_different_widths_join(static):
    joined = static.sample(4, 0).joined(static.sample_beyond(3, 0))
    assert joined.node.shape == joined.force.shape == (7, 5)
    assert (joined.force[:4, 3:] == 0).all()


def test_a_bad_truth_is_not_stored(tiny_harmonic, tmp_path, monkeypatch):
    monkeypatch.setattr(direct_truth, "RESIDUAL_LIMIT", 1e-30)
    with pytest.raises(SolverError, match=r"relative residual .* above 1e-30"):
        make_dataset(tiny_harmonic, 3, tmp_path / "bad.nc")
    assert not (tmp_path / "bad.nc").exists()


def test_nothing_is_left_beside_the_file(tiny_harmonic, tmp_path):
    path = make_dataset(tiny_harmonic, 5, tmp_path / "new folder" / "set.nc")
    assert [found.name for found in path.parent.iterdir()] == ["set.nc"]


def test_a_killed_run_goes_on_where_it_was(tiny_harmonic, uninterrupted, tmp_path, subprocess_environment):
    path = tmp_path / "set.nc"
    folder = tmp_path / "set.nc.pieces"
    process = run_script(path, 30, environment=subprocess_environment)
    try:
        assert process.stdout.readline() == "piece 0\n"  # and now it waits
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    assert process.returncode == -signal.SIGKILL
    finished = times(folder)
    assert not path.exists() and list(finished) == ["00000.nc"]
    leftover = tmp_path / f".set.nc.{process.pid}.partial"
    leftover.write_bytes(b"what a kill in the last step leaves")

    solved = []
    with pytest.MonkeyPatch.context() as patch:
        solve = snapshots.solve_piece
        patch.setattr(snapshots, "solve_piece", lambda scene, cases: solved.append(len(cases)) or solve(scene, cases))
        patch.setattr("rom.datasets.pieces.shutil.rmtree", lambda *_, **__: None)
        make_dataset(tiny_harmonic, CASES, path, seed=SEED)
    assert times(folder)["00000.nc"] == finished["00000.nc"]
    assert sum(solved) == CASES - PIECE_CASES  # the finished piece was not solved again
    equal(read_dataset(path), uninterrupted)
    assert not leftover.exists()


def test_a_living_process_keeps_its_partial_file(tmp_path):
    living, dead = (tmp_path / f".set.nc.{number}.partial" for number in (os.getpid(), 2**30))  # beyond any pid
    for partial in (living, dead):
        partial.touch()
    remove_leftovers(tmp_path / "set.nc")
    assert living.exists() and not dead.exists()


@pytest.mark.parametrize("change", [{"seed": 7}, {"cases": 49}, {"beyond": 8}])
def test_pieces_of_another_recipe_are_refused(tiny_harmonic, tmp_path, monkeypatch, change):
    path = tmp_path / "set.nc"
    monkeypatch.setattr(snapshots, "write_in_blocks", _full)
    with pytest.raises(OSError):
        make_dataset(tiny_harmonic, CASES, path, seed=SEED)
    before = times(tmp_path / "set.nc.pieces")
    arguments = {"cases": CASES, "seed": SEED, "beyond": 0} | change
    with pytest.raises(SchemaError, match=r"set\.nc\.pieces holds pieces of another recipe"):
        make_dataset(tiny_harmonic, arguments["cases"], path, seed=arguments["seed"], beyond=arguments["beyond"])
    assert times(tmp_path / "set.nc.pieces") == before


def _full(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_keeps_the_finished_pieces(tiny_harmonic, uninterrupted, tmp_path, monkeypatch, capsys):
    path = tmp_path / "set.nc"
    monkeypatch.setitem(PRESETS, "metamodel", tiny_harmonic.body.fingertip.density)
    command = ["dataset", "harmonic-point-force", "--cases", str(CASES), "--seed", str(SEED), "--workers", "1",
               "--output", str(path)]
    write, written = xr.Dataset.to_netcdf, []

    def until_full(self, *args, **kwargs):
        if len(written) == 3:
            _full()
        written.append(write(self, *args, **kwargs))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(xr.Dataset, "to_netcdf", until_full)
        assert cli.main(command) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "No space left on device" in error and "Traceback" not in error
    kept = times(tmp_path / "set.nc.pieces")
    assert len(kept) == 3 and not path.exists()
    assert not list(tmp_path.rglob("*.partial"))  # a full disk is not filled further
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rom.datasets.pieces.shutil.rmtree", lambda *_, **__: None)
        assert cli.main(command) == 0  # room again
    assert kept.items() <= times(tmp_path / "set.nc.pieces").items()
    equal(read_dataset(path), uninterrupted)


@pytest.mark.parametrize(("limit", "pieces"), [(20_000, 0), (300_000, CASES // PIECE_CASES)])
def test_a_file_that_cannot_grow_is_one_sentence(tmp_path, subprocess_environment, limit, pieces):
    # a piece of 8 cases x 684 complex numbers has some 90 kB, the whole of 48 x 855 some 700 kB
    path = tmp_path / "set.nc"
    process = run_script(path, 0, limit, environment=subprocess_environment)
    _, error = process.communicate(timeout=120)
    assert process.returncode == 2, error
    assert error.startswith("rom: ") and error.count("\n") == 1 and "Traceback" not in error
    assert "could not be written" in error or "File too large" in error
    assert not path.exists() and not list(tmp_path.rglob("*.partial"))
    assert len(times(tmp_path / "set.nc.pieces")) == pieces


def test_a_folder_is_no_file(tiny_harmonic, tmp_path):
    with pytest.raises(IsADirectoryError, match="is a folder: name a file"):
        make_dataset(tiny_harmonic, 5, tmp_path)
    assert not list(tmp_path.parent.glob(tmp_path.name + ".pieces"))


def test_recipes_name_everything(tiny_harmonic, tmp_path, monkeypatch):
    monkeypatch.setattr(snapshots, "write_in_blocks", _full)
    with pytest.raises(OSError):
        make_dataset(tiny_harmonic, 5, tmp_path / "set.nc", seed=2)
    recipe = json.loads((tmp_path / "set.nc.pieces" / "recipe.json").read_text())
    assert recipe["cases"] == 5 and recipe["seed"] == 2 and recipe["beyond"] == 0
    assert recipe["scene"] == json.loads(tiny_harmonic.to_json()) and recipe["source"]


def test_single_cases_are_a_dataset_too(tiny_harmonic, tmp_path):
    data = read_dataset(make_dataset(tiny_harmonic, 1, tmp_path / "one.nc"))
    arrays = tiny_harmonic.read(data)
    assert isinstance(arrays, CaseArrays) and len(arrays) == 1


def test_a_finished_dataset_is_not_made_again(tiny_harmonic, tmp_path, monkeypatch):
    path = make_dataset(tiny_harmonic, 5, tmp_path / "set.nc", seed=2)
    before = path.stat().st_mtime_ns
    monkeypatch.setattr(snapshots, "solve_piece", None)  # a call would fail
    assert make_dataset(tiny_harmonic, 5, path, seed=2) == path
    assert path.stat().st_mtime_ns == before


@pytest.mark.parametrize("content", [None, b"someone's notes"])
def test_no_file_of_another_kind_is_overwritten(tiny_harmonic, tmp_path, content):
    path = tmp_path / "set.nc"
    if content is None:
        make_dataset(tiny_harmonic, 5, path, seed=1)
    else:
        path.write_bytes(content)
    before = path.read_bytes()
    with pytest.raises(FileExistsError, match="was not made from this recipe"):
        make_dataset(tiny_harmonic, 5, path, seed=2)
    assert path.read_bytes() == before


def test_given_cases_go_on_where_a_killed_run_was(tiny_harmonic, uninterrupted, tmp_path, monkeypatch):
    arrays = tiny_harmonic.sample(CASES, SEED)
    solved, solve = [], snapshots.solve_piece

    def stop_in_the_third(scene, block):
        if len(solved) == 2:
            raise KeyboardInterrupt
        solved.append(len(block))
        return solve(scene, block)

    with monkeypatch.context() as patch:
        patch.setattr(snapshots, "solve_piece", stop_in_the_third)
        with pytest.raises(KeyboardInterrupt):
            solve_dataset(tiny_harmonic, arrays, tmp_path / "set.nc")
    kept = times(tmp_path / "set.nc.pieces")
    assert len(kept) == 2
    path = solve_dataset(tiny_harmonic, arrays, tmp_path / "set.nc")
    found = read_dataset(path)
    names = ["split_published", "split_hard", "hard_region"]
    assert not set(names) & set(found)  # given cases are not split
    equal(found.drop_attrs(deep=False), uninterrupted.drop_vars(names).drop_attrs(deep=False))


def test_given_cases_are_found_again_in_the_cache(tiny_harmonic, monkeypatch):
    arrays = tiny_harmonic.sample(9, 1)
    path = solve_dataset(tiny_harmonic, arrays)
    with monkeypatch.context() as patch:
        patch.setattr(snapshots, "solve_piece", None)  # nothing is solved twice
        assert solve_dataset(tiny_harmonic, arrays) == path
    louder = CaseArrays(arrays.node, 2 * arrays.force, arrays.frequency, arrays.loss_factor)
    assert solve_dataset(tiny_harmonic, louder) != path
