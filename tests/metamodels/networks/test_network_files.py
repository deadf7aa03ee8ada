"""Networks on disk: the same answers after loading, and refusals by name."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from safetensors.numpy import save_file

from rom.datasets.tensors import REQUIRED, read_attributes, read_weights, write_weights
from rom.errors import SchemaError
from rom.fingertip import Fingertip, MeshDensity
from rom.metamodels import load
from rom.metamodels.registry import metamodel_classes
from rom.scenes import get_scene


@pytest.fixture
def saved(fitted, tmp_path):
    snapshots, model = fitted
    path = tmp_path / "model.safetensors"
    model.save(path)
    return snapshots, model, path


def test_loaded_network_answers_the_same(saved):
    snapshots, model, path = saved
    for again in (load(path), type(model).load(path, snapshots.scene)):
        assert type(again) is type(model)
        assert again.settings == model.settings
        assert again.offline_seconds == model.offline_seconds
        assert again.model_bytes == model.model_bytes
        assert np.array_equal(again.evaluate(snapshots.arrays), model.evaluate(snapshots.arrays))
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_attributes_are_read_without_torch(saved):
    _, model, path = saved
    code = ("import sys; from rom.datasets.tensors import read_attributes; "
            f"assert read_attributes({str(path)!r})['method'] == {model.name!r}; sys.exit('torch' in sys.modules)")
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_damaged_files_are_refused(saved):
    _, model, path = saved
    whole = path.read_bytes()
    for damaged in (b"", whole[:5], whole[:200], whole[:-1], b"CDF\x01" + bytes(1000)):
        path.write_bytes(damaged)
        for read in (read_attributes, load, type(model).load):
            with pytest.raises(SchemaError, match=r"model\.safetensors is truncated or no safetensors file"):
                read(path)
    path.unlink()
    with pytest.raises(SchemaError, match="does not exist"):
        read_attributes(path)


def test_foreign_files_are_refused(saved, tmp_path):
    snapshots, model, path = saved
    foreign = tmp_path / "foreign.safetensors"
    save_file({"a": np.zeros(3, dtype=np.float32)}, foreign)
    with pytest.raises(SchemaError, match=r"foreign\.safetensors holds no network of this toolkit"):
        load(foreign)
    attributes, arrays = read_weights(path)
    save_file(arrays, foreign, dict.fromkeys(attributes, "{"))
    with pytest.raises(SchemaError, match=r"foreign\.safetensors has a header that cannot be read"):
        read_attributes(foreign)
    other = metamodel_classes("mlp" if model.name == "transformer" else "transformer")[0]
    with pytest.raises(SchemaError, match="load it with its own class"):
        other.load(path)
    write_weights(foreign, arrays, {**attributes, "model_version": "0.1"})
    with pytest.raises(SchemaError, match=r"model version 0\.1"):
        type(model).load(foreign, snapshots.scene)


def test_missing_or_misshapen_weights_are_refused(saved, tmp_path):
    snapshots, model, path = saved
    attributes, arrays = read_weights(path)
    name = next(name for name in arrays if name.startswith("weight.") and arrays[name].ndim)
    changed = [{k: v for k, v in arrays.items() if k != name}, {**arrays, name: arrays[name][..., :-1]},
               {k: v for k, v in arrays.items() if k != "basis"}]
    for tensors in changed:
        write_weights(tmp_path / "changed.safetensors", tensors, attributes)
        with pytest.raises(SchemaError, match=r"changed\.safetensors is incomplete or damaged"):
            type(model).load(tmp_path / "changed.safetensors", snapshots.scene)


def test_other_mesh_is_refused(saved):
    snapshots, model, path = saved
    scene = get_scene(snapshots.scene.name, Fingertip(density=MeshDensity((4, 6), 2, 2, (1, 1, 1, 2))))
    with pytest.raises(SchemaError, match="another body or mesh"):
        type(model).load(path, scene)


def test_transposed_arrays_survive(tmp_path):
    array = np.arange(6.0).reshape(2, 3).T
    attributes = dict.fromkeys(("model_version", "method", "settings", "scene_parameters", "scene_hash", "mesh_hash",
                                "offline_seconds"), "x")
    write_weights(tmp_path / "a.safetensors", {"array": array}, attributes)
    read, arrays = read_weights(tmp_path / "a.safetensors")
    assert np.array_equal(arrays["array"], array)
    assert read == json.loads(json.dumps(attributes))


def test_every_changed_byte_is_noticed(tmp_path):
    path = tmp_path / "a.safetensors"
    write_weights(path, {"b": np.arange(40.0), "a": np.float32(3.0)}, dict.fromkeys(REQUIRED, "some text"))
    whole, read = path.read_bytes(), read_weights(path)
    assert np.array_equal(read[1]["b"], np.arange(40.0))
    for place in range(len(whole)):
        for bit in (0, 5):
            content = bytearray(whole)
            content[place] ^= 1 << bit
            path.write_bytes(content)
            try:
                attributes, arrays = read_weights(path)
            except SchemaError as error:
                assert "\n" not in str(error)
            else:  # the name of the digest itself is another, and nothing else
                attributes = {name: value for name, value in attributes.items() if not name.endswith("digest")}
                assert b'content_digest"' not in content and (attributes, arrays.keys()) == (read[0], read[1].keys())


def test_files_without_a_digest_say_so(tmp_path, caplog):
    save_file({"a": np.zeros(3)}, tmp_path / "a.safetensors", dict.fromkeys(REQUIRED, "1"))
    with caplog.at_level("INFO"):
        read_weights(tmp_path / "a.safetensors")
    assert "a.safetensors carries no digest" in caplog.text
