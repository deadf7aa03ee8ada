"""A body that a user brings: two matrices, named degrees of freedom, no nodes. Everything that applies answers."""

import numpy as np
import pytest
import scipy.sparse as sp
import xarray as xr

import rom
from rom.datasets import read_dataset, select
from rom.metamodels import applicable
from rom.scenes import scene_from_json


def chain(n: int = 60) -> rom.Body:
    """A rod of springs and masses, held at the root: f_k = sqrt(k / m) / pi * sin((2 k - 1) pi / (4 n + 2))."""
    stiffness = sp.diags_array([np.r_[np.full(n - 1, 2.0), 1.0], np.full(n - 1, -1.0), np.full(n - 1, -1.0)],
                               offsets=[0, 1, -1]).tocsr() * 4e4
    return rom.Body(stiffness, sp.diags_array(np.full(n, 1e-3)).tocsr(),
                    dof_names=[f"mass {i}" for i in range(n)], name="rod")


@pytest.fixture(scope="module")
def scene():
    columns = np.zeros((60, 3))
    columns[[59, 29, 9], [0, 1, 2]] = 1.0
    return rom.LinearScene(chain(), rom.Loads.named(columns, ["tip", "middle", "root"]), frequency=(1.0, 300.0),
                           part=["mass 59", "mass 0"])


def test_names_survive_from_the_matrices_to_the_answer(scene):
    cases = xr.Dataset({"load": ("case", ["tip", "root"]), "force_amplitude": ("case", [1.0, 2.0]),
                        "frequency": ("case", [20.0, 200.0]), "loss_factor": ("case", [0.1, 0.3])})
    answer = rom.create("direct", scene).fit().predict(cases)
    assert answer.displacement.dims == ("case", "dof")
    k, m = scene.model.stiffness.toarray(), scene.model.mass.toarray()
    z = k * (1 + 0.3j) - (2 * np.pi * 200.0) ** 2 * m
    truth = np.linalg.solve(z, 2.0 * np.eye(60)[9])
    np.testing.assert_allclose(answer.displacement.sel(dof="mass 33").values[1], truth[33], rtol=1e-12)


def test_a_load_that_does_not_exist_is_refused_with_those_that_do(scene):
    cases = xr.Dataset({"load": ("case", ["tipp"]), "force_amplitude": ("case", [1.0]), "frequency": ("case", [20.0]),
                        "loss_factor": ("case", [0.1])})
    with pytest.raises(ValueError, match="load holds 'tipp': choose from tip, middle, root"):
        scene.read(cases)


def test_every_method_answers_or_says_why_not(scene, tmp_path):
    data = read_dataset(rom.make_dataset(scene, 80, tmp_path / "rod.nc", beyond=8, seed=1))
    assert set(np.unique(data.hard_region)) <= {0, 1, 2, 3} and len(select(data, "published", "test")) == 16
    reasons = applicable(scene)
    assert {name for name, reason in reasons.items() if reason is None} == {
        "direct", "direct-reused", "modal", "modal-static", "modal-krylov", "lookup-table", "pod-galerkin"}
    assert reasons["coarse-fem"] == "the body has no other mesh"
    cases, truth = scene.read(data), scene.values(data)
    # 40 of 60 modes and 6 vectors a load; POD modes down to 1e-6 of the largest singular value
    for name, bar in (("modal-krylov", 1e-8), ("pod-galerkin", 1e-5)):
        model = rom.create(name, scene).fit(data if name == "pod-galerkin" else None)
        error = scene.errors(cases, model.evaluate(cases, "field"), truth)["displacement"]
        assert error.max() < bar, name
        part = model.evaluate(cases, "part")
        np.testing.assert_allclose(part, model.evaluate(cases, "field")[:, [59, 0]], rtol=1e-9)


def test_static_scene_of_a_body_without_mass():
    body = rom.Body(chain().model.stiffness, name="spring")
    scene = rom.LinearScene(body, rom.Loads.named(np.eye(60)[:, [59]], ["end"]))
    cases = xr.Dataset({"load": ("case", ["end"]), "force_amplitude": ("case", [3.0])})
    answer = rom.solve(scene, cases, tolerance=1e-9)
    # 60 springs of 4e4 N/m in series
    assert answer.displacement.sel(dof=59).item() == pytest.approx(60 * 3.0 / 4e4, rel=1e-12)


def test_a_scene_of_ones_own_body_is_not_built_from_its_name(scene):
    with pytest.raises(ValueError, match="stands on a body that is not registered here: give the scene itself"):
        scene_from_json(scene.to_json())


def test_content_hash_follows_matrices_names_and_loads():
    base = chain()
    assert base.content_hash == chain().content_hash
    heavier = rom.Body(base.model.stiffness, base.model.mass * 1.0000001, dof_names=base.dof_names)
    renamed = rom.Body(base.model.stiffness, base.model.mass, dof_names=[f"dof {i}" for i in range(60)])
    assert len({base.content_hash, heavier.content_hash, renamed.content_hash}) == 3


def test_names_must_be_one_for_each_degree_of_freedom():
    stiffness = chain().model.stiffness
    with pytest.raises(ValueError, match="60 names, 1 of them different, were given for 60 degrees of freedom"):
        rom.Body(stiffness, dof_names=["a"] * 60)
