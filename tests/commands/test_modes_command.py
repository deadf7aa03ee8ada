"""`rom modes`: the table, the files, and one sentence for what is refused."""

import numpy as np
import pytest

from rom import cli
from rom.datasets.storage import read_netcdf
from rom.fingertip import Fingertip, MeshDensity
from rom.fingertip.fingertip import PRESETS
from rom.fullorder import natural_modes

SMALL = MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))


@pytest.fixture(autouse=True)
def _small_meshes(monkeypatch):
    monkeypatch.setitem(PRESETS, "study", SMALL)


def call(*words):
    try:
        return cli.main(["modes", *map(str, words)])
    except SystemExit as end:
        return end.code


def rows(text):
    """Mode number to the words of its line."""
    return {int(line.split()[0]): line.split() for line in text.splitlines() if line.split()[0].isdecimal()}


def test_the_table_shows_what_the_library_computes(capsys):
    assert call("--count", 3, "--formulation", "full", "--rear", "fixed", "--set", "dermis_thickness=1.2") == 0
    lines = rows(capsys.readouterr().out)
    tip = Fingertip.preset("study", formulation="full", rear="fixed")
    tip = Fingertip(tip.anatomy.replace(dermis_thickness=1.2), SMALL, "full", "fixed")
    expected = natural_modes(tip.stiffness, tip.mass, count=3).frequency_hz
    assert [float(lines[k][1]) for k in (1, 2, 3)] == pytest.approx(expected, abs=0.006)
    assert all(words[2] == "-" for words in lines.values())  # the study prints frequencies for a free rear only


def test_published_frequencies_stand_beside_a_free_rear(capsys):
    assert call("--count", 2) == 0
    lines = rows(capsys.readouterr().out)
    assert (lines[1][2], lines[2][2]) == ("122.4", "163.7")  # data/published.toml
    assert lines[1][3] == "antisymmetric"


def test_all_modes_below_a_frequency(capsys):
    assert call("--below", 300) == 0
    found = rows(capsys.readouterr().out)
    tip = Fingertip.preset("study")
    frequency = natural_modes(tip.stiffness, tip.mass, count=len(found) + 1).frequency_hz
    assert frequency[-2] < 300 < frequency[-1]


def test_files(capsys, tmp_path):
    files = {"--output": tmp_path / "modes.nc", "--figure": tmp_path / "modes.png", "--vtu": tmp_path / "modes.vtu"}
    assert call("--count", 3, *(word for pair in files.items() for word in pair)) == 0
    assert all(str(path) in capsys.readouterr().out for path in [tmp_path]) and all(p.exists() for p in files.values())
    data = read_netcdf(files["--output"])
    shape = data["mode_shape"]
    assert dict(shape.sizes) == {"mode": 3, "node": Fingertip.preset("study").mesh.n_nodes, "component": 3}
    assert np.sqrt((shape**2).sum("component")).max("node").values == pytest.approx(1)
    assert all("units" in data[name].attrs and "long_name" in data[name].attrs for name in data.variables)
    import meshio

    fields = meshio.read(files["--vtu"]).point_data
    assert len(fields) == 3 and np.allclose(next(iter(fields.values())), shape.values[0])


@pytest.mark.parametrize(("words", "expected"), [
    (["--count", 0], "give a whole number from 1 up"),
    (["--count", 10**6], "number of dofs"),
    (["--count", "many"], "invalid int value"),
    (["--count", 3, "--below", 100], "not allowed with"),
    (["--below", 1], "raise --below"),
    (["--below", -5], "greater than zero"),
    (["--below", "nan"], "greater than zero"),
    (["--below", "inf"], "finite"),
    (["--preset", "huge"], "choose one of"),
    (["--set", "dermis_thickness=no"], "finite number"),
    (["--set", "dermis_thickness=9"], "make layers or bone thinner"),
    (["--output", "modes.txt"], "must end in .nc"),
    (["--figure", "/no/such/folder/modes.png"], "does not exist"),
    (["four words of nonsense"], "unrecognized arguments")])
def test_what_is_refused(capsys, words, expected):
    assert call(*words) == 2
    out, error = capsys.readouterr()
    assert out == "" and expected in error
    assert error.startswith("rom: ") and error.count("\n") == 1 and "Traceback" not in error
