"""`rom slide`: the table, the files, and what happens where a path cannot go on."""

import numpy as np
import pytest

from rom import cli
from rom.datasets.storage import read_netcdf
from rom.finger_on_glass.finger import Finger
from rom.finger_on_glass.path import LoadPath, follow
from rom.finger_on_glass.tissue import Tissue

COARSE = ("--rays", 24, "--layers", 3)


def call(*words):
    try:
        return cli.main(["slide", *map(str, words)])
    except SystemExit as end:
        return end.code


def test_table_file_and_figure_say_what_the_model_says(capsys, tmp_path):
    path, figure = tmp_path / "path.nc", tmp_path / "path.png"
    code = call(*COARSE, "--variant", "random", "--seed", 2, "--force", 0.3, "--travel", 1, "--friction", 0.8,
                "--section", "width=17", "--output", path, "--figure", figure)
    assert code == 0
    printed = capsys.readouterr().out
    data = read_netcdf(path)
    assert (data.attrs["complete"], data.attrs["reason"]) == (1, "")
    assert (data.attrs["section.width"], data.attrs["plate.friction"], data.attrs["tissue.seed"]) == (17.0, 0.8, 2)
    assert data["normal_force"].values == pytest.approx([0.06, 0.12, 0.18, 0.24, 0.3, 0.3, 0.3], rel=1e-6)
    assert data["tangential_displacement"].values == pytest.approx([0] * 5 + [5e-4, 1e-3])
    assert (data["tangential_force"] <= 0.8 * data["normal_force"] * (1 + 1e-9)).all()
    lines = printed.splitlines()
    assert f"{1e3 * float(data['normal_displacement'][-1]):.4f}" in lines[7]
    assert f"{1e-3 * float(data['peak_pressure'][-1]):.2f}" in lines[7]
    assert f"{int(data['slipping'][-1])} of {int(data['touching'][-1])}" in lines[7]
    assert figure.read_bytes()[:4] == b"\x89PNG"
    assert {path.name, figure.name} == {file.name for file in tmp_path.iterdir()}


def test_stiffnesses_are_given_in_kilopascal(capsys, tmp_path):
    path = tmp_path / "path.nc"
    assert call(*COARSE, "--c", 4, "--k1", 100, "--travel", 0, "--output", path) == 0
    data = read_netcdf(path)
    assert (data.attrs["tissue.c"], data.attrs["tissue.k1"]) == pytest.approx((0.004, 0.1))
    finger = Finger(tissue=Tissue("radial", 0.004, 0.1), rays=24, layers=3)
    answer = follow(finger, LoadPath((0.1, 0.2, 0.3, 0.4, 0.5)))
    assert np.allclose(data["displacement"][-1], 1e-3 * answer.last.state.displacement, atol=1e-12)


def test_a_path_that_ends_early_leaves_what_it_reached(capsys, tmp_path):
    path = tmp_path / "path.nc"
    code = call("--rays", 40, "--layers", 4, "--friction", 5, "--travel", 8, "--output", path, "--figure",
                tmp_path / "path.png")
    assert code == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    data = read_netcdf(path)
    assert data.attrs["complete"] == 0
    assert error == f"rom: {data.attrs['reason']}"
    assert "last converged step is kept" in error
    assert data.sizes["position"] > 0
    assert np.isfinite(data["displacement"]).all()


def test_a_path_that_never_begins_leaves_the_finger_at_rest(capsys, tmp_path):
    path = tmp_path / "path.nc"
    assert call(*COARSE, "--c", 1e-9, "--output", path) == 2
    assert "stiffer tissue" in capsys.readouterr().err
    data = read_netcdf(path)
    assert data.attrs["complete"] == 0
    assert data["normal_force"].values == [0.0]


@pytest.mark.parametrize(("words", "told"), [
    (("--variant", "spiral"), "choose one of radial"), (("--c", 0), "above zero"), (("--k1", "nan"), "above zero"),
    (("--friction", -1), "finite number from 0"), (("--force", 0), "above zero"), (("--travel", -1), "zero or more"),
    (("--travel", "inf"), "zero or more"), (("--section", "width"), "NAME=VALUE"),
    (("--section", "depth=3"), "choose among width"), (("--section", "width=wide"), "needs a length"),
    (("--section", "width=17", "--section", "width=18"), "twice"), (("--section", "bone_offset=6"), "reaches out"),
    (("--rays", 3), "whole number from 16"), (("--seed", -1), "whole number from 0 up"),
    (("--axial-stiffness", -5), "stiffness"),
    (("--effective-length", 0), "length"), (("--output", "path.txt"), "end in .nc"), (("--friction", "much"), "float")])
def test_what_cannot_be_is_refused_in_one_sentence(capsys, words, told):
    assert call(*words) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
