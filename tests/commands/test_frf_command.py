"""`rom frf`: the table, the files, and one sentence for what is refused."""

import numpy as np
import pytest

from rom import cli
from rom.datasets.storage import read_netcdf
from rom.fingertip import DIRECTIONS, Fingertip, MeshDensity
from rom.fingertip.fingertip import PRESETS
from rom.metamodels import create
from rom.scenes import get_scene
from rom.vibration.frequency_response import frequency_response, magnitudes, sweep_cases

SMALL = MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))


@pytest.fixture(autouse=True)
def _small_meshes(monkeypatch):
    monkeypatch.setitem(PRESETS, "study", SMALL)


def call(*words):
    try:
        return cli.main(["frf", *map(str, words)])
    except SystemExit as end:
        return end.code


def rows(text):
    """Frequency to the numbers of its line."""
    found = {}
    for line in text.splitlines():
        try:
            first, *others = map(float, line.split())
        except ValueError:
            continue
        found[first] = others
    return found


def test_the_table_shows_what_a_direct_solve_says(capsys):
    assert call("--from", 50, "--to", 250, "--step", 100, "--loss-factor", 0.2, "--amplitude", 3) == 0
    text = capsys.readouterr().out
    lines = rows(text)
    scene = get_scene("harmonic-patch-forces", Fingertip.preset("study"))
    truth = frequency_response(create("direct", scene).fit(), [50.0, 150.0, 250.0], loss_factor=0.2)
    assert sorted(lines) == [50.0, 150.0, 250.0]
    for f, numbers in lines.items():
        for i, direction in enumerate(DIRECTIONS):
            one = truth.sel(direction=direction, frequency=f)
            phase = np.degrees(np.angle(one["driving_point_receptance"].item()))
            expected = [*1e6 * abs(one["receptance"].values), phase]
            # printed to two decimals, the phase to one; the method's own error is below 1e-6
            np.testing.assert_allclose(numbers[3 * i:3 * i + 3], expected, rtol=1e-5, atol=0.051)
    assert "certified: at most" in text and "modal-krylov modes=12" in text


def test_peaks_are_listed_and_long_sweeps_are_thinned(capsys):
    assert call("--directions", "radial-ulnar", "--formulation", "full", "--method", "modal-static") == 0
    text = capsys.readouterr().out
    assert len(rows(text)) <= 40 and "--output keeps all" in text
    scene = get_scene("harmonic-patch-forces", Fingertip.preset("study", formulation="full"))
    first = scene.model.natural_modes(count=1).frequency_hz[0]
    line = next(line for line in text.splitlines() if line.startswith("peaks, radial-ulnar, loaded"))
    peak = float(line.split(": ")[1].split(" Hz")[0])
    # the first mode is the torsion that a radial-ulnar force drives; its neighbours draw the peak by a little
    assert peak == pytest.approx(first, rel=0.03)
    assert "normal" not in text


def test_files(capsys, tmp_path):
    import meshio

    files = {"--output": tmp_path / "frf.nc", "--figure": tmp_path / "frf.png", "--vtu": tmp_path / "field.vtu"}
    words = [word for pair in files.items() for word in pair]
    assert call("--from", 100, "--to", 140, "--step", 10, "--at", 120, *words) == 0
    out = capsys.readouterr().out
    assert all(str(path) in out and path.exists() for path in files.values())
    data = read_netcdf(files["--output"])
    assert data["driving_point_receptance"].dtype == complex and data["receptance"].dims == (
        "direction", "frequency", "measure")
    assert files["--figure"].stat().st_size > 10_000
    scene = get_scene("harmonic-patch-forces", Fingertip.preset("study"))
    truth = create("direct", scene).fit().evaluate(sweep_cases(scene, [120.0]))
    field = meshio.read(files["--vtu"]).point_data
    for direction, values in zip(DIRECTIONS, truth, strict=True):
        name = f"displacement_{direction}_120_Hz_m_magnitude"
        moving = field[name][scene.body.fingertip.free_dofs[::3] // 3]
        np.testing.assert_allclose(moving, magnitudes(values[None])[0], rtol=1e-5)


@pytest.mark.parametrize(("words", "say"), [
    (["--directions", "up"], "direction holds 'up'"), (["--directions", "normal,normal"], "at most once"),
    (["--method", "pod-galerkin"], "--method got 'pod-galerkin': choose one of"), (["--step", 0], "--step is 0 Hz"),
    (["--from", "nan"], "--from is nan Hz"), (["--to", -5], "--to is -5 Hz"), (["--from", 50, "--to", 20], "swap them"),
    (["--step", 1e-9], "raise --step"), (["--loss-factor", -1], "the loss factor -1"),
    (["--amplitude", 0], "moves nothing"), (["--amplitude", "inf"], "the force amplitude inf"),
    (["--node", 10**6], "site 1000000 is not on the pad"), (["--at", 50], "--vtu and --at belong together"),
    (["--vtu", "field.vtu"], "--vtu and --at belong together"), (["--output", "frf.txt"], "must end in .nc"),
    (["--figure", "nowhere/frf.png"], "does not exist"), (["--preset", "elbow"], "There is no preset 'elbow'"),
    (["--from", "low"], "invalid float value: 'low'"), (["--rear", "glued"], "glued")])
def test_impossible_words_are_one_sentence(capsys, words, say):
    assert call(*words) == 2
    out, error = capsys.readouterr()
    assert out == "" and error.startswith("rom: ") and error.count("\n") == 1
    assert say in error
