"""A dataset says the same in any order, units and file: permuted, transposed, chunked, sorted and stored by xarray."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[1]))

from hostile import one_line
from small_worlds import Glass, Plate

from rom.datasets import make_dataset, open_dataset, read_dataset
from rom.errors import SchemaError
from rom.metamodels import create
from rom.scenes.complex_parts import encode_complex

ROUNDING = 1e-9
"""Sums in another order, through a basis of four vectors whose condition is below 1e3."""
UNITS = {"force_amplitude": [("mN", 1e3), ("kN", 1e-3)], "force_phase": [("degrees", 180 / np.pi)],
         "frequency": [("kHz", 1e-3), ("s-1", 1.0)], "displacement": [("mm", 1e3), ("um", 1e6)],
         "normal_force": [("mN", 1e3)], "c": [("kPa", 1e-3)], "k1": [("MPa", 1e-6), ("N mm-2", 1e-6)],
         "pressure": [("kPa", 1e-3)], "contact_area": [("mm2", 1e6)], "tangential_force": [("mN", 1e3)]}
ANY = settings(deadline=None, max_examples=25, suppress_health_check=[
    HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.data_too_large])


@pytest.fixture(scope="module", params=[Plate, Glass])
def world(request, tmp_path_factory):
    found = request.param(tmp_path_factory.mktemp("world"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found.model = create(found.method, found.scene, **found.options).fit(found.data)
        found.answer = found.model.predict(found.data)
    found.drawn = 0
    found.folder = found.file.parent
    return found


def changed(draw, data, world):
    """The data in other clothes."""
    for name in [name for name in UNITS if name in data and draw(st.booleans())]:
        unit, factor = draw(st.sampled_from(UNITS[name]))
        data[name] = (data[name] * factor).assign_attrs({**data[name].attrs, "units": unit})
    stored = draw(st.booleans())
    if stored or draw(st.booleans()):
        data = encode_complex(data)
    for dim in [dim for dim in data.dims if dim != "corner" and draw(st.booleans())]:
        data = data.isel({dim: draw(st.permutations(range(data.sizes[dim])))})
    if draw(st.booleans()):
        data = data.sortby([name for name in ("case", "component", "node") if name in data.dims],
                           ascending=draw(st.booleans()))
    if draw(st.booleans()):
        data = data.transpose(*draw(st.permutations(list(data.dims))))
    if "load_node" in data and draw(st.booleans()):
        data["load_node"] = draw(st.sampled_from([
            data["load_node"].where(data["load_node"] >= 0), data["load_node"].astype(float),
            data["load_node"].where(data["load_node"] >= 0, 9999).assign_attrs(missing_value=9999)]))
    if draw(st.booleans()):
        data = data.chunk({draw(st.sampled_from(list(data.dims))): draw(st.integers(2, 5)), "case": 5})
    if stored:
        for name in ("load_node",):
            if name in data and data[name].dtype.kind == "i" and "missing_value" not in data[name].attrs:
                data[name].encoding[draw(st.sampled_from(["_FillValue", "missing_value"]))] = data[name].dtype.type(-1)
        world.drawn += 1  # libraries keep open files by their names
        path = world.folder / f"{world.drawn}.nc"
        data.to_netcdf(path, engine="netcdf4")
        read = draw(st.sampled_from([xr.open_dataset, xr.load_dataset, read_dataset, open_dataset,
                                     lambda path: xr.open_dataset(path, chunks={})]))
        with read(path) as opened:
            data = opened.load() if read is xr.open_dataset else opened
    return data


@ANY
@given(data=st.data())
def test_any_order_is_read_alike(world, data):
    found = changed(data.draw, world.data.copy(), world)
    order = np.argsort(found["case"].values)
    cases, expected = world.scene.read(found).take(order), world.scene.read(world.data)
    if hasattr(world.scene, "force_vectors"):
        # the forces of a case have no order, and absent ones no load
        np.testing.assert_allclose(world.scene.force_vectors(cases), world.scene.force_vectors(expected), rtol=1e-12)
        cases, expected = list(cases)[2:], list(expected)[2:]
    for one, other in zip(cases, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)
    values, expected = world.scene.values(found), world.scene.values(world.data)
    if isinstance(values, dict):
        for name in expected:
            np.testing.assert_allclose(values[name][order], expected[name], rtol=1e-12)
    else:
        np.testing.assert_allclose(values[order], expected, rtol=1e-12)


@pytest.mark.filterwarnings("ignore::rom.metamodels.validity.ValidityWarning")
@ANY
@given(data=st.data())
def test_methods_learn_and_answer_alike_in_any_order(world, data):
    train = changed(data.draw, world.data.copy(), world)
    cases = changed(data.draw, world.data.copy(), world)
    answer = create(world.method, world.scene, **world.options).fit(train).predict(cases)
    found = world.scene.values(answer.sortby("case"))
    expected = world.scene.values(world.answer)
    for name in world.scene.quantities:
        one, other = (values[name] if isinstance(values, dict) else values for values in (found, expected))
        np.testing.assert_allclose(one, other, rtol=0, atol=ROUNDING * np.abs(other).max())


@ANY
@given(data=st.data())
def test_what_is_missing_or_double_is_refused(world, data):
    draw = data.draw
    whole = draw(st.sampled_from([world.data, encode_complex(world.data)])).copy()
    dim = draw(st.sampled_from([dim for dim in whole.dims if dim in whole.coords and dim not in ("case",)]))
    kept = draw(st.lists(st.integers(0, whole.sizes[dim] - 1), min_size=1, max_size=whole.sizes[dim] + 2))
    if sorted(kept) == list(range(whole.sizes[dim])):
        return
    for use in (world.scene.values, create(world.method, world.scene, **world.options).fit):
        with pytest.raises(SchemaError) as caught:
            use(whole.isel({dim: kept}))
        assert dim in one_line(caught.value)


def test_foreign_units_are_refused(world):
    name = next(iter(world.scene.quantities))
    wrong = world.data.assign({name: world.data[name].assign_attrs(units="kg")})
    with pytest.raises(SchemaError, match="'kg', which do not convert to m"):
        world.scene.values(wrong)
    with pytest.raises(SchemaError, match="'kg', which do not convert to m"):
        create(world.method, world.scene, **world.options).fit(wrong)


def test_another_scene_is_refused(world):
    for attribute, value in (("scene", "beam"), ("scene_hash", "0" * 64)):
        with pytest.raises(SchemaError):
            world.scene.read(world.data.assign_attrs({attribute: value}))
    world.scene.read(world.data.drop_attrs(deep=False))  # which say nothing


@pytest.mark.filterwarnings("ignore::rom.metamodels.validity.ValidityWarning")
def test_one_case_alone(world):
    answer = world.model.predict(world.data.isel(case=3))
    one, whole = world.scene.values(answer), world.scene.values(world.answer)
    for name in world.scene.quantities:
        found, expected = (values[name] if isinstance(values, dict) else values for values in (one, whole))
        np.testing.assert_allclose(found[0], expected[3], rtol=0, atol=ROUNDING * np.abs(expected).max())


@pytest.mark.filterwarnings("ignore::rom.metamodels.validity.ValidityWarning")
def test_single_precision_raises_no_warning(tmp_path):
    # warnings are errors in tests; 1 / 8 is exact in single precision
    plate = Plate(tmp_path)
    cases = plate.data.assign(force_amplitude=xr.full_like(plate.data["force_amplitude"], 0.125).where(
        plate.data["load_node"] >= 0, 0.0))
    model = create("modal-krylov", plate.scene, modes=4, vectors=2).fit()
    single = model.predict(cases.assign(force_amplitude=cases["force_amplitude"].astype(np.float32)))
    xr.testing.assert_equal(single["displacement"], model.predict(cases)["displacement"])
    make_dataset(plate.scene, 4, tmp_path / "more.nc")
