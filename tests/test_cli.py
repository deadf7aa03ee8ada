"""The command line: one sentence and exit code 2 for bad input, files and pages for good input."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from rom import cli
from rom.datasets import read_dataset
from rom.datasets.storage import read_netcdf
from rom.fingertip import MeshDensity
from rom.fingertip.fingertip import PRESETS
from rom.metamodels import METHODS, applicable
from rom.scenes import SCENES, get_scene

SMALL = MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))
STATIC, HARMONIC = "static-point-forces", "harmonic-point-force"


@pytest.fixture(autouse=True)
def _small_meshes(monkeypatch):
    """The commands run as they are, on a small mesh."""
    monkeypatch.setitem(PRESETS, "metamodel", SMALL)
    monkeypatch.setitem(PRESETS, "quick", SMALL)


def call(*words):
    """Exit code of a command, whether returned or raised by the parser."""
    try:
        return cli.main([str(word) for word in words])
    except SystemExit as end:
        return end.code


def refused(capsys, *words):
    """The sentence with which a command is refused."""
    assert call(*words) == 2
    out, error = capsys.readouterr()
    assert error.startswith("rom: ") and error.endswith("\n") and error.count("\n") == 1, error
    assert "Traceback" not in error and out == ""
    return error


@pytest.mark.parametrize("words", [["four words of nonsense"], ["four", "words", "of", "nonsense"]])
@pytest.mark.parametrize("command", ["dataset", "compare"])
def test_nonsense_for_a_scene(capsys, tmp_path, command, words):
    cases = ["--cases", 5] if command == "dataset" else []
    output = tmp_path / "out"
    error = refused(capsys, command, *words, *cases, "--output", output)
    assert "nonsense" in error
    if len(words) == 1:
        assert all(name in error for name in SCENES)  # the remedy
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("words", "say"), [
    (["compare", STATIC, "--methods", "magic"], "'magic' is no method"),
    (["compare", STATIC, "--methods", "superposition,modal"], "modal does not apply to static-point-forces"),
    (["compare", HARMONIC, "--methods", "transformer"], "transformer does not apply"),
    (["compare", STATIC, "--quick", "--cases", "0"], "0 cases are too few"),
    (["compare", STATIC, "--cases", "many"], "invalid int value: 'many'"),
    (["dataset", STATIC, "--cases", "0"], "0 cases"),
    (["dataset", STATIC, "--cases", "-4"], "-4 cases"),
    (["dataset", STATIC, "--cases", "5", "--beyond", "-1"], "-1 beyond"),
    (["dataset", HARMONIC, "--cases", "99999999"], "99999999 cases are more than"),
    (["dataset", STATIC, "--cases", "5", "--preset", "elbow"], "There is no preset 'elbow'"),
    (["dataset", STATIC, "--cases", "nan"], "invalid int value: 'nan'"),
    (["dataset", STATIC, "--cases", "5", "--seed", "-1"], "'-1' is no seed")])
def test_impossible_words(capsys, tmp_path, words, say):
    assert say in refused(capsys, *words, "--output", tmp_path / "out")
    assert not (tmp_path / "out").is_file()


@pytest.mark.parametrize("words", [
    [], ["dance"], ["dataset"], ["dataset", STATIC], ["compare", STATIC, "--output", "x", "--colour", "x"]])
def test_incomplete_or_unknown_commands(capsys, words):
    assert "--help" in refused(capsys, *words)


@pytest.mark.parametrize("command", ["dataset", "compare", "report"])
def test_outputs_that_cannot_be(capsys, tmp_path, command):
    (tmp_path / "file").write_text("not a folder")
    target = tmp_path / "file" / "below"
    words = {"dataset": [STATIC, "--cases", 5], "compare": [STATIC, "--quick"], "report": ["--quick"]}[command]
    assert "file" in refused(capsys, command, *words, "--output", target)
    assert (tmp_path / "file").read_text() == "not a folder"


def test_a_folder_for_a_dataset(capsys, tmp_path):
    assert "is a folder" in refused(capsys, "dataset", STATIC, "--cases", 5, "--output", tmp_path)


def test_an_output_without_permission(capsys, tmp_path, monkeypatch):
    # a folder's mode does not bind every user that tests run as, so the refusal of the system is put in its place
    def forbidden(self, *_, **__):
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "mkdir", forbidden)
    error = refused(capsys, "dataset", STATIC, "--cases", 5, "--output", tmp_path / "locked" / "set.nc")
    assert "Permission denied" in error


@pytest.fixture
def finished_pieces(tmp_path, monkeypatch):
    """A dataset whose pieces are made and whose last step failed."""
    snapshots = importlib.import_module("rom.datasets.snapshots")

    def full(*_):
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(snapshots, "write_in_blocks", full)
        assert call("dataset", STATIC, "--cases", 5, "--output", tmp_path / "set.nc") == 2
    return tmp_path / "set.nc.pieces" / "00000.nc"


def test_a_full_disk(capsys, finished_pieces):
    assert capsys.readouterr().err == "rom: [Errno 28] No space left on device\n"
    assert finished_pieces.exists()


@pytest.mark.parametrize("content", [b"", b"four words of nonsense", None], ids=["empty", "text", "cut"])
def test_a_damaged_piece(capsys, finished_pieces, content):
    capsys.readouterr()
    finished_pieces.write_bytes(finished_pieces.read_bytes()[:3000] if content is None else content)
    error = refused(capsys, "dataset", STATIC, "--cases", 5, "--output", finished_pieces.parents[1] / "set.nc")
    assert "00000.nc is truncated or no netCDF file" in error


@pytest.mark.parametrize("damage", ["truncated", "older schema", "nan"])
def test_a_damaged_dataset_under_a_comparison(capsys, tmp_path, monkeypatch, damage):
    monkeypatch.setenv("ROM_CACHE", str(tmp_path / "cache"))
    module = importlib.import_module("rom.comparison.side_by_side")
    words = ["compare", STATIC, "--quick", "--cases", "30", "--methods", "pod-regression", "--output", tmp_path / "out"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "fit_entries", lambda *_: (_ for _ in ()).throw(ValueError("enough for now")))
        assert call(*words) == 2
    capsys.readouterr()
    (path,) = (tmp_path / "cache" / "datasets").glob("*.nc")
    if damage == "truncated":
        path.write_bytes(path.read_bytes()[:20_000])
    else:
        with netCDF4.Dataset(path, "a") as raw:
            if damage == "nan":
                raw["force_amplitude"][:, 0] = np.nan
            else:
                raw.schema_version = "0.9"
    assert call(*words) == 2
    error = capsys.readouterr().err
    sentence = error.splitlines()[-1]
    assert sentence.startswith("rom: ") and "Traceback" not in error
    assert {"truncated": "truncated", "older schema": "schema version 0.9", "nan": "nan"}[damage] in sentence
    assert not (tmp_path / "out" / "results.nc").exists()


def test_an_interruption_says_that_pieces_are_kept(capsys, monkeypatch, tmp_path):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("rom.datasets.make_dataset", stop)
    assert call("dataset", STATIC, "--cases", 5, "--output", tmp_path / "set.nc") == 130
    assert "finished pieces are kept" in capsys.readouterr().err


# ---- good input ---------------------------------------------------------------------------------------------

def test_scenes_print_what_they_need_and_leave_out(capsys):
    assert call("scenes") == 0
    out, error = capsys.readouterr()
    assert error == ""
    blocks = dict(zip(SCENES, re.split(r"\n\n", out.strip()), strict=True))
    for name, block in blocks.items():
        scene = get_scene(name)
        assert block.startswith(f"{name}: {scene.title}")
        for entries in (scene.needs, scene.leaves_out, {one.name: one.text for one in scene.inputs}):
            for key, text in entries.items():
                assert f"{key}: {text}" in block
        methods = next(line for line in block.splitlines() if line.strip().startswith("methods"))
        reasons = applicable(scene)
        assert set(reasons) == set(METHODS)
        assert methods.split(maxsplit=1)[1].split(", ") == [method for method, why in reasons.items() if why is None]
        for method, why in reasons.items():
            assert why is None or f"{method}: {why}" in block


@pytest.mark.parametrize("name", [name for name in SCENES if name != "finger-on-glass"])
def test_dataset_makes_a_readable_file(capsys, tmp_path, name):
    path = tmp_path / "made" / "set.nc"
    assert call("dataset", name, "--cases", 12, "--beyond", 4, "--seed", 5, "--workers", 1, "--compress", "--output", path) == 0
    assert capsys.readouterr().out == f"{path}\n"
    data = read_dataset(path)
    assert data.sizes["case"] == 16 and data.attrs["scene"] == name
    assert np.linalg.norm(data["displacement"].values.reshape(16, -1), axis=1).min() > 0
    assert data["displacement"].dtype == (np.float64 if name == STATIC else np.complex128)


def test_the_command_is_installed(subprocess_environment):
    done = subprocess.run([sys.executable, "-m", "rom.cli", "scenes"], env=subprocess_environment, capture_output=True,
                          text=True, timeout=120)
    assert done.returncode == 0 and STATIC in done.stdout
    done = subprocess.run([sys.executable, "-m", "rom.cli", "dataset", "four words of nonsense", "--cases", "3",
                           "--output", "nowhere.nc"], env=subprocess_environment, capture_output=True, text=True,
                          timeout=120)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "Traceback" not in done.stderr


def test_compare_writes_results_page_and_figures(capsys, tmp_path):
    folder = tmp_path / "reports" / HARMONIC
    words = ["compare", HARMONIC, "--quick", "--cases", "60", "--seed", "4", "--output", folder,
             "--methods", "modal-krylov,pod-galerkin"]
    assert call(*words) == 0
    assert str(folder / "index.html") in capsys.readouterr().out
    results = read_netcdf(folder / "results.nc")
    assert set(results["method"].values) == {"direct", "modal-krylov", "pod-galerkin"}
    assert results.attrs["seed"] == 4 and results.attrs["quick"] == 1
    for variable, dims in {"error_max": ("entry", "split"), "error_p95": ("entry", "split"),
                           "error_median": ("entry", "split"), "online_seconds": ("entry", "repeat"),
                           "batch_seconds": ("entry",), "output_seconds": ("entry",), "offline_seconds": ("entry",),
                           "model_bytes": ("entry",), "speedup": ("entry",), "call_seconds": ("entry",),
                           "break_even_cases": ("entry",)}.items():
        assert results[variable].dims == dims
    page = (folder / "index.html").read_text(encoding="utf-8")
    figures = sorted(path.name for path in folder.glob("*.png"))
    assert "work-precision.png" in figures
    for figure in figures:
        assert figure in page
        assert (folder / figure).read_bytes().startswith(b"\x89PNG\r\n")


def test_a_reader_that_stops_reading_is_no_error():
    command = f"{sys.executable} -m rom.cli scenes | head -1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.startswith("static-point-forces") and done.stderr == ""
