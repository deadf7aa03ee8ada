"""Whatever is typed, the command line ends with exit code 0 or 2 and one sentence, never with a traceback."""

from pathlib import Path

import pytest
from hostile import HOSTILE, refuses_or_makes, words
from hypothesis import given, settings
from hypothesis import strategies as st

from rom import cli
from rom.datasets import read_dataset
from rom.datasets.storage import read_netcdf, write_netcdf
from rom.errors import RomError
from rom.fingertip import MeshDensity
from rom.fingertip.fingertip import PRESETS
from rom.metamodels import METHODS, create, load
from rom.scenes import SCENES, scene_from_json

COARSE = MeshDensity((2, 2), 1, 1, (1, 1, 1, 1))
SIZES = ["nan", "inf", "-inf", "-1", "0", "1", "2.5", "1e308", "1e-320", "5e-324", "99999999999999999999", "x", ""]
FILES = ["missing/x", "folder", "file/x", "", "\0", "n" * 300, "/dev/null/x", "/proc/x", "file"]
COMMANDS = ("scenes", "dataset", "compare", "report", "explain", "frf", "modes")
SETS = ["dermis_thickness", "dermis.elastic_modulus", "shape.pad_start", "nail_width", "hypodermis.poisson_ratio",
        "colour"]


@pytest.fixture(autouse=True)
def _somewhere(monkeypatch, tmp_path):
    """A folder of its own with a file and a folder in it, and meshes of 75 nodes."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("not a folder")
    (tmp_path / "folder").mkdir()
    for name in PRESETS:
        monkeypatch.setitem(PRESETS, name, COARSE)


def ends_well(capsys, *given_words):
    """Run a command; exit code 0, or 2 with one sentence on standard error."""
    capsys.readouterr()
    try:
        code = cli.main(list(given_words))
    except SystemExit as end:
        code = end.code
    error = capsys.readouterr().err
    assert code in (0, 2), (given_words, code)
    assert "Traceback" not in error
    if code == 2:
        lines = [line for line in error.splitlines() if not line.startswith("rom: warning: ")]
        assert len(lines) == 1 and lines[0].startswith("rom: "), (given_words, error)
    return code


@settings(HOSTILE, max_examples=60)
@given(command=st.sampled_from([*COMMANDS, "stability", ""]), rest=st.lists(words, max_size=4))
def test_any_words(capsys, command, rest):
    if command in ("report", "stability", "modes", "frf") and set(rest) <= {"--"}:
        return  # nothing wrong: that would run, for long
    ends_well(capsys, *([command] if command else []), *rest)


@settings(HOSTILE, max_examples=30)
@given(data=st.data())
def test_dataset(capsys, data):
    draw = data.draw
    ends_well(capsys, "dataset", draw(st.one_of(st.sampled_from([*SCENES]), words)), "--cases",
              draw(st.sampled_from(SIZES)), "--beyond", draw(st.sampled_from(SIZES)), "--output",
              draw(st.sampled_from(FILES)), *draw(st.sampled_from([[], ["--seed", "9" * 30], ["--preset", "x\ny"],
                                                                  ["--formulation", "\0"], ["--compress"]])))


@settings(HOSTILE, max_examples=25)
@given(data=st.data())
def test_compare_and_report(capsys, data):
    draw = data.draw
    output = draw(st.sampled_from([name for name in FILES if name not in ("missing/x", "folder", "", "n" * 300)]))
    seed = draw(st.sampled_from([[], ["--seed", "-1"], ["--seed", "9" * 30], ["--seed", "٣"]]))
    methods = draw(st.one_of(st.sampled_from([*METHODS, ",", "direct,direct", "modal,,"]), words))
    ends_well(capsys, "compare", draw(st.sampled_from([*SCENES, "x"])), "--methods", methods, "--quick", "--cases",
              draw(st.sampled_from([size for size in SIZES if not size.startswith("9")])), "--output", output, *seed)
    ends_well(capsys, "report", "--quick", "--output", output, *seed)


@settings(HOSTILE, max_examples=25)
@given(data=st.data())
def test_explain(capsys, data):
    draw = data.draw
    change = f"{draw(st.sampled_from(SETS))}={draw(st.sampled_from(SIZES))}"
    ends_well(capsys, "explain", draw(st.sampled_from([*SCENES])), *draw(st.sampled_from([[], ["--set", change]])),
              *draw(st.sampled_from([[], ["--outputs", "pad"], ["--outputs", "nail"], ["--rear", "fixed"]])),
              "--method", draw(st.one_of(st.sampled_from([*METHODS]), words)))


@pytest.mark.filterwarnings("ignore::rom.metamodels.validity.ValidityWarning")
@pytest.mark.filterwarnings("ignore::rom.fullorder.IllConditionedWarning")
@settings(HOSTILE, max_examples=25)
@given(data=st.data())
def test_frf(capsys, data):
    draw = data.draw
    sized = draw(st.dictionaries(st.sampled_from(["--to", "--from", "--step", "--loss-factor", "--amplitude", "--node",
                                                  "--at"]), st.sampled_from(SIZES), min_size=1, max_size=3))
    options = {"--from": "10", "--to": "11", "--directions": "normal", "--method": draw(st.sampled_from(
        ["modal-krylov", "modal", "modal-static", "direct", "direct-reused", "coarse-fem", "superposition"]))} | sized
    if draw(st.booleans()):
        options[draw(st.sampled_from(["--output", "--vtu", "--set", "--directions"]))] = draw(st.one_of(
            st.sampled_from([*FILES, "x.nc", "x.vtu", "folder/x.nc", "dermis.density=1e15", "hypodermis.elastic_modulus"
                             "=1e-12"]), words))
    ends_well(capsys, "frf", *(word for pair in options.items() for word in (f"{pair[0]}={pair[1]}",)))


@pytest.mark.filterwarnings("ignore::rom.fullorder.IllConditionedWarning")
@settings(HOSTILE, max_examples=15)
@given(data=st.data())
def test_modes(capsys, data):
    draw = data.draw
    how = draw(st.sampled_from(["--count", "--below"]))
    change = f"{draw(st.sampled_from(SETS))}={draw(st.sampled_from(SIZES))}"
    ends_well(capsys, "modes", f"{how}={draw(st.sampled_from(SIZES))}", *draw(st.sampled_from(
        [[], ["--set", change], ["--output", draw(st.sampled_from(FILES)) + ".nc"], ["--rear", "fixed"],
         ["--vtu", "folder"], ["--formulation", "x"]])))


# ---- files that are read ------------------------------------------------------------------------------------

class _Files(dict):
    """Shown short where an example fails."""

    def __repr__(self):
        return "files"


@pytest.fixture(scope="module")
def files(static, static_file, tmp_path_factory):
    """A dataset and a metamodel, as they should be."""
    path = tmp_path_factory.mktemp("models") / "model.nc"
    create("superposition", static).fit().save(path)
    return _Files({"content": read_netcdf(path), "dataset": Path(static_file).read_bytes(), "model": path.read_bytes(),
            "text": b"four words of nonsense", "empty": b"", "zeros": bytes(2000)})


@settings(HOSTILE, max_examples=25)
@given(kind=st.sampled_from(["dataset", "model", "text", "empty", "zeros"]), share=st.floats(0.0, 1.0),
       ending=st.sampled_from([".nc", ".safetensors", ""]))
def test_cut_and_foreign_files(files, static, tmp_path, kind, share, ending):
    path = tmp_path / f"some{ending}"
    whole = files[kind]
    path.write_bytes(whole[:int(share * len(whole))])
    for read in (read_dataset, read_netcdf, lambda file: load(file, static)):
        refuses_or_makes(lambda read=read: read(path), RomError, ValueError, OSError)


@settings(HOSTILE, max_examples=20)
@given(name=st.sampled_from(["model_version", "method", "settings", "scene_parameters", "scene_hash", "mesh_hash",
                             "offline_seconds"]),
       value=st.one_of(st.text(alphabet="abc{}[]\":0", max_size=8), st.integers(-9, 9), st.just(float("nan"))))
def test_files_of_other_contents(static, files, tmp_path, name, value):
    content = files["content"].copy(deep=True)
    path = tmp_path / f"{len(list(tmp_path.iterdir()))}.nc"  # libraries keep open files by their names
    content.attrs[name] = value
    write_netcdf(content, path)
    refuses_or_makes(lambda: load(path, static), RomError, ValueError)
    refuses_or_makes(lambda: load(path), RomError, ValueError)
    refuses_or_makes(lambda: read_dataset(path), RomError, ValueError)
    refuses_or_makes(lambda: scene_from_json(content.attrs["scene_parameters"]), ValueError)


@pytest.mark.parametrize("command", COMMANDS)
def test_an_interrupt_is_said(capsys, monkeypatch, command):
    def stop(*_):
        raise KeyboardInterrupt

    parser = cli._parser()
    monkeypatch.setattr(cli, "_parser", lambda: parser)
    monkeypatch.setattr(parser, "parse_args", lambda _: type("", (), {"run": staticmethod(stop)})())
    assert cli.main([command]) == 130
    assert capsys.readouterr().err.startswith("rom: interrupted")


def test_too_little_memory_is_said(capsys, monkeypatch):
    def starve(*_):
        raise MemoryError

    monkeypatch.setattr("rom.commands.scenes.run", starve)
    assert ends_well(capsys, "scenes") == 2


def test_a_warning_is_one_line(capsys, monkeypatch):
    import warnings

    def doubt(*_):
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.warn("two\nlines", UserWarning, stacklevel=2)

    monkeypatch.setattr("rom.commands.scenes.run", doubt)
    assert cli.main(["scenes"]) == 0
    assert capsys.readouterr().err == "rom: warning: two lines\n"
