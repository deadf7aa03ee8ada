"""The contract that every registered metamodel must pass, on every small scene that it answers."""

import pytest
from conformance import COARSE_GLASS, GLASS, ROWS, small_scenes

from rom.datasets import make_dataset, read_dataset
from rom.errors import SchemaError
from rom.fingertip import Fingertip, MeshDensity
from rom.metamodels import METHODS, applicable, create, load
from rom.scenes import get_scene
from rom.testing import check_metamodel


@pytest.fixture(scope="module")
def scenes(scene_of):
    return {**small_scenes(), **scene_of}


@pytest.fixture(scope="module")
def train_of(scenes, data_of, glass_file, tmp_path_factory):
    known = {**data_of, GLASS: read_dataset(glass_file)}

    def find(name):
        if name not in known:
            path = tmp_path_factory.mktemp("train") / f"{name}.nc"
            known[name] = read_dataset(make_dataset(scenes[name], 80, path, seed=3))
        return known[name]
    return find


def test_every_method_has_a_row():
    assert {row.method for row in ROWS} == set(METHODS)
    assert {row.scene for row in ROWS} == set(small_scenes())


@pytest.mark.parametrize("row", ROWS, ids=str)
def test_every_promise_is_kept(row, scenes, train_of):
    model = create(row.method, scenes[row.scene], **row.settings)
    cases = scenes[row.scene].sample(2, 9) if row.scene == COARSE_GLASS else None
    check_metamodel(model, train_of(row.scene) if row.learns else None, cases=cases, rounding=row.rounding)


def test_files_of_another_mesh_or_anatomy_are_refused(static, tmp_path):
    path, tip = tmp_path / "model.nc", static.body.fingertip
    create("superposition", static).fit().save(path)
    stiffer = tip.anatomy.to_dict()
    stiffer["dermis"]["elastic_modulus"] *= 1.01
    for other in (Fingertip(density=MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))),
                  Fingertip(type(tip.anatomy).from_dict(stiffer), tip.density)):
        with pytest.raises(SchemaError, match=r"model\.nc belongs to another body or mesh"):
            load(path, get_scene(static.name, other))


@pytest.mark.parametrize("name", METHODS)
def test_unknown_settings_are_refused_by_name(name, scenes):
    scene = next(scene for scene in scenes.values() if applicable(scene)[name] is None)
    with pytest.raises(ValueError, match=f"{name} does not take the settings colour"):
        create(name, scene, colour="blue")
