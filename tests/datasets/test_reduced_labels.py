"""A reduced set says the same in any order and units; shapes that are missing or cannot be are refused."""

import numpy as np
import pytest
import xarray as xr

from rom.datasets import make_whole_dataset, open_dataset, read_dataset
from rom.errors import SchemaError
from rom.fingertip import Fingertip, MeshDensity
from rom.scenes import get_scene

SOME = np.array([0, 5, 2699, 2700, 12345, 33333])


@pytest.fixture(scope="module")
def scene():
    return get_scene("harmonic-point-force", Fingertip(density=MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))))


@pytest.fixture(scope="module")
def file(scene, tmp_path_factory):
    return make_whole_dataset(scene, tmp_path_factory.mktemp("whole") / "whole.nc", modes=60, vectors=10, confirm=8)


@pytest.fixture(scope="module")
def values(scene, file):
    return scene.values(read_dataset(file, SOME))


@pytest.fixture
def raw(file):
    with xr.open_dataset(file) as data:
        yield data


def test_answers_are_those_of_direct_solves(scene, file, values):
    truth = scene.solve(scene.read(read_dataset(file, SOME)))[0]["displacement"]
    np.testing.assert_allclose(values, truth, rtol=0, atol=1e-6 * np.abs(truth).max())  # the limit of a stored case


def test_any_order_and_unit_says_the_same(scene, values, raw, tmp_path):
    rng = np.random.default_rng(0)
    order = {dim: rng.permutation(raw.sizes[dim]) for dim in ("node", "component", "mode", "load", "vector", "dof")}
    changed = raw.isel(order).transpose(*reversed(list(raw.dims)))
    changed["force_amplitude"] = (changed["force_amplitude"] * 1e3).assign_attrs(units="mN")
    changed["frequency"] = (changed["frequency"] / 1e3).assign_attrs(units="kHz")
    changed["load_node"].encoding["_FillValue"] = np.int32(-1)
    changed.isel(case=SOME[::-1]).to_netcdf(tmp_path / "changed.nc")
    found = read_dataset(tmp_path / "changed.nc")
    np.testing.assert_allclose(scene.values(found)[::-1], values, rtol=0, atol=1e-13 * np.abs(values).max())
    with open_dataset(tmp_path / "changed.nc", chunks=None) as lazy:
        np.testing.assert_array_equal(lazy["displacement"], found["displacement"])


@pytest.mark.parametrize("change, words", [
    (lambda raw: raw.isel(mode=slice(50)), "50 modes of the 60"),
    (lambda raw: raw.isel(load=slice(3)), "3 loads of the"),
    (lambda raw: raw.isel(vector=slice(1, None)), "9 vectors of the 10"),
    (lambda raw: raw.isel(dof=slice(1, None)), "dofs of the"),
    (lambda raw: raw.isel(node=slice(9)), "lacks node 9 and"),
    (lambda raw: raw.isel(component=[0, 1, 1]), "lacks component 'z'|component 'y' twice"),
    (lambda raw: raw.isel(node=[0, *range(raw.sizes["node"])]), "node 0 twice"),
    (lambda raw: raw.assign(eigenvalue=np.nan * raw["eigenvalue"]), "a value of eigenvalue that cannot be"),
    (lambda raw: raw.assign(eigenvalue=-raw["eigenvalue"]), "a value of eigenvalue that cannot be"),
    (lambda raw: raw.assign(participation=raw["participation"].where(raw["participation"] > 0)), "participation"),
    (lambda raw: raw.assign(node_of_load=raw["node_of_load"] + 1), "cannot carry load"),
    (lambda raw: raw.assign(node_of_dof=xr.full_like(raw["node_of_dof"], 9)), "a degree of freedom twice"),
    (lambda raw: raw.assign(load_node=xr.full_like(raw["load_node"], -1)), "no load_node|without one force each"),
    (lambda raw: raw.assign(force_amplitude=raw["force_amplitude"].assign_attrs(units="kg")), "'kg'"),
    (lambda raw: raw.drop_vars("own_share"), "lacks own_share")])
def test_what_does_not_fit_together_is_refused(raw, tmp_path, change, words):
    change(raw).to_netcdf(tmp_path / "changed.nc")
    with pytest.raises(SchemaError, match=words) as caught:
        read_dataset(tmp_path / "changed.nc", [0])
    assert "changed.nc" in str(caught.value) and "\n" not in str(caught.value)
