"""`rom train`: weights from a whole dataset, refusals in one sentence."""

from __future__ import annotations

import json

import pytest

from rom.cli import main
from rom.datasets import make_dataset, make_whole_dataset
from rom.datasets.tensors import read_attributes
from rom.metamodels import create, load
from rom.metamodels.networks.sizes import SIZES, settings_of_size


@pytest.fixture(scope="module")
def whole(tiny_harmonic, tmp_path_factory):
    path = tmp_path_factory.mktemp("set") / "whole.nc"
    return make_whole_dataset(tiny_harmonic, path, confirm=8)


def test_weights_say_where_they_come_from(whole, tiny_harmonic, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(SIZES["pole-network"], "small", {"rank": 20, "poles": 5, "steps": 2})
    path = tmp_path / "weights.safetensors"
    assert main(["train", "pole-network", str(whole), "--output", str(path), "--size", "small", "--seed", "3",
                 "--split", "hard"]) == 0
    assert "of the hard split" in capsys.readouterr().out
    attributes = read_attributes(path)
    assert attributes["mesh_hash"] == tiny_harmonic.body.fingertip.mesh.mesh_hash
    origin = attributes["learned_from"]
    assert (origin["split"], origin["split_seed"]) == ("hard", 0) and origin["cases"] > 1000
    assert attributes["history"]["step"][0] == 0
    assert json.loads(attributes["settings"])["seed"] == 3
    assert load(path).settings["storage"] == "float16"
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(("method", "output", "options", "reason"), [
    ("transformer", "a.safetensors", [], "transformer does not apply to harmonic-point-force"),
    ("modal", "a.safetensors", [], "'modal' is no network"),
    ("mlp", "a.safetensors", ["--cases", "1"], "1 training cases cannot be drawn"),
    ("mlp", "a.nc", [], "let it end in .safetensors"),
    ("mlp", "a.safetensors", ["--size", "huge"], "no size of mlp"),
    ("mlp", "a.safetensors", ["--split", "none"], "is no split")])
def test_refusals(whole, tmp_path, capsys, method, output, options, reason):
    assert main(["train", method, str(whole), "--output", str(tmp_path / output), *options]) == 2
    assert reason in capsys.readouterr().err


def test_load_paths_are_refused(glass_file, tmp_path, capsys):
    paths = glass_file
    assert main(["train", "mlp", str(paths), "--output", str(tmp_path / "a.safetensors")]) == 2
    assert "holds load paths of finger-on-glass" in capsys.readouterr().err


def test_static_cases_train_the_transformer(static, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(SIZES["transformer"], "small", {"width": 16, "heads": 2, "steps": 20})
    data, path = make_dataset(static, 90, tmp_path / "static.nc", seed=4), tmp_path / "weights.safetensors"
    assert main(["train", "transformer", str(data), "--output", str(path), "--size", "small", "--cases", "60"]) == 0
    found = load(path)
    assert found.learned_from["cases"] == 60 and found.learned_from["split_seed"] == 4
    assert "60 cases of the published split" in capsys.readouterr().out


def test_every_network_has_three_sizes(static, harmonic):
    for method, sizes in SIZES.items():
        scene = static if method == "transformer" else harmonic
        made = [create(method, scene, **settings_of_size(method, size)).settings for size in sizes]
        assert len(made) == 3
        assert all(made[i] != made[j] for i in range(3) for j in range(i))
