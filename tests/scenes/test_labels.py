"""Labelled data are read by what their labels say, or refused in one sentence."""

import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[1]))

from hostile import one_line

from rom.errors import SchemaError
from rom.scenes.cases import NO_FORCE
from rom.scenes.complex_parts import decode_complex, encode_complex, from_parts, join_parts, to_parts
from rom.scenes.labelled_cases import LoadLabels, categories, check_cases, numbers
from rom.scenes.labels import fields, in_order, positions
from rom.scenes.units import factor_to

NODES = {"load_node": np.array([7, 12, 40])}
PATCHES = {"load_node": np.array([7, 7, 12, 12]), "direction": np.array(["normal", "shear", "normal", "shear"])}
WORDS = ("radial", "circumferential", "random")


def cases(node=((7, 12), (40, -1)), force=((0.5, 1.0), (0.25, 0.0)), **more):
    return xr.Dataset({"load_node": (("case", "force"), np.array(node)),
                       "force_amplitude": (("case", "force"), np.array(force), {"units": "N"}), **more})


def loads(data, labels):
    return LoadLabels(labels).forces(data)


def refused(make, *words, kind=ValueError):
    with pytest.raises(kind) as caught:
        make()
    text = one_line(caught.value)
    for word in words:
        assert word in text, text
    return text


# ---- units --------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("found, unit, factor", [
    ("N", "N", 1.0), ("mN", "N", 1e-3), ("kHz", "Hz", 1e3), ("s-1", "Hz", 1.0), ("1/s", "Hz", 1.0),
    ("degrees", "rad", np.pi / 180), ("mm", "m", 1e-3), ("mm2", "m2", 1e-6), ("kPa", "Pa", 1e3), ("N/mm2", "Pa", 1e6),
    ("N m-2", "Pa", 1.0), ("%", "1", 0.01), ("", "1", 1.0), ("-", "1", 1.0), ("1", "1", 1.0), ("µN", "N", 1e-6)])
def test_units_convert(found, unit, factor):
    assert factor_to(unit, {"units": found}, "force") == pytest.approx(factor, rel=1e-15)
    assert factor_to(unit, {}, "force") == 1.0


@pytest.mark.parametrize("found, unit", [
    ("Pa", "N"), ("rad/s", "Hz"), ("rpm", "Hz"), ("degC", "1"), ("dB", "1"), ("furlong parsec", "N"),
    ("9**9**9**9", "N"), ("N" * 10_000, "N"), (3, "N"), (None, "N"), ("N\n", "Pa"), ("1", "N")])
def test_other_units_are_refused(found, unit):
    # rad/s and rpm: a converter that takes an angle for a number would be wrong by 2 pi
    refused(lambda: factor_to(unit, {"units": found}, "force"), "force has the units", f"convert to {unit}",
            kind=SchemaError)


# ---- cases --------------------------------------------------------------------------------------------------

def test_loads_and_amplitudes():
    column, force = loads(cases(), NODES)
    np.testing.assert_array_equal(column, [[0, 1], [2, NO_FORCE]])
    np.testing.assert_array_equal(force, [[0.5, 1.0], [0.25, 0.0]])


@pytest.mark.parametrize("change", [
    lambda c: c.transpose(), lambda c: c.chunk({"case": 1}), lambda c: c.assign(load_node=c["load_node"].astype(float)),
    lambda c: c.assign(load_node=c["load_node"].where(c["load_node"] >= 0)),
    lambda c: c.assign(load_node=c["load_node"].where(c["load_node"] >= 0, 99).assign_attrs(_FillValue=99)),
    lambda c: c.assign(load_node=c["load_node"].where(c["load_node"] >= 0, 99).assign_attrs(missing_value=[98, 99])),
    lambda c: c.assign(force_amplitude=(1e3 * c["force_amplitude"]).assign_attrs(units="mN")),
    lambda c: c.assign(force_amplitude=c["force_amplitude"].where(c["load_node"] >= 0)),
    lambda c: c.assign(force_amplitude=c["force_amplitude"].astype(np.float32)),
    lambda c: c.assign(load_node=c["load_node"].astype(object)), lambda c: c.set_coords("load_node"),
    lambda c: c.drop_attrs()])
def test_loads_say_the_same_in_other_clothes(change):
    column, force = loads(change(cases()), NODES)
    np.testing.assert_array_equal(column, [[0, 1], [2, NO_FORCE]])
    np.testing.assert_array_equal(force, [[0.5, 1.0], [0.25, 0.0]])  # eighths, exact in every type


def test_fill_values_survive_files(tmp_path):
    for name in ("_FillValue", "missing_value"):
        data = cases()
        data["load_node"].encoding[name] = np.int64(-1)
        data.to_netcdf(tmp_path / f"{name}.nc")
        for masked in (True, False):
            with xr.open_dataset(tmp_path / f"{name}.nc", mask_and_scale=masked) as found:
                np.testing.assert_array_equal(loads(found, NODES)[0], [[0, 1], [2, NO_FORCE]])


def test_one_case_is_a_case():
    one = cases(frequency=("case", [10.0, 20.0])).isel(case=1)
    np.testing.assert_array_equal(loads(one, NODES)[0], [[2, NO_FORCE]])
    assert numbers(one, "frequency", ("case",), "Hz") == [20.0]
    several = cases(frequency=((), 0.01, {"units": "kHz"}))
    np.testing.assert_array_equal(numbers(several, "frequency", ("case",), "Hz"), [10.0, 10.0])
    np.testing.assert_array_equal(numbers(several, "loss_factor", ("case",), "1", 0.1), [0.1, 0.1])
    single = several.isel(force=0)
    np.testing.assert_array_equal(loads(single, NODES)[0], [[0], [2]])


def test_labels_of_several_variables():
    data = cases(((7, 12), (12, -1)), direction=(("case", "force"), [["shear", "normal"], ["shear", "none"]]))
    np.testing.assert_array_equal(loads(data, PATCHES)[0], [[1, 2], [3, NO_FORCE]])
    codes = data.assign(direction=(("case", "force"), [[1, 0], [1, -1]]))  # positions in order of appearance
    np.testing.assert_array_equal(loads(codes, PATCHES)[0], [[1, 2], [3, NO_FORCE]])
    flags = {"flag_values": np.array([1, 0]), "flag_meanings": "normal shear"}  # the data's own, the other way round
    turned = data.assign(direction=(("case", "force"), [[0, 1], [0, -1]], flags))
    np.testing.assert_array_equal(loads(turned, PATCHES)[0], [[1, 2], [3, NO_FORCE]])
    few = {name: values[:3] for name, values in PATCHES.items()}  # nothing shears node 12
    refused(lambda: loads(data, few), "force 0 of case 1", "load_node, direction")
    refused(lambda: loads(data.assign(direction=data["direction"].astype("S7")), {"load_node": PATCHES["load_node"]} | {
        "direction": np.array(["normal", "twist"] * 2)}), "'shear'", "choose from normal, twist")


@pytest.mark.parametrize("data, words", [
    (cases(((7, 13), (40, -1))), ["load_node 13 cannot carry load", "7, 12, 40"]),
    (cases(((7, -1), (40, -1))), ["force 1 of case 0", "amplitude 1 N", "no load_node"]),
    (cases(((7.5, 12), (40, -1))), ["7.5", "no whole number"]),
    (cases(((7, np.inf), (40, -1))), ["beyond"]), (cases(((7, 2**60), (40, -1))), ["beyond"]),
    (cases(((True, False), (True, True))), ["type bool"]), (cases(force=((1j, 1), (1, 0))), ["type complex128"]),
    (cases((("x", "y"), ("z", ""))), ["'x' cannot carry load"]),
    (cases().rename(force="forces"), ["dimensions", "batch it along ('case',) or ('case', 'force')"]),
    (cases().assign(force_amplitude=("case", [1.0, 2.0])), ["one value for each of the 2 forces"]),
    (cases().assign(force_amplitude=cases()["force_amplitude"].assign_attrs(units="kg")), ["'kg'", "convert to N"])])
def test_wrong_loads_are_refused(data, words):
    refused(lambda: loads(data, NODES), *words)


@pytest.mark.parametrize("values", [["random", "radial"], [2, 0], np.array(["random", "radial"], "S6"),
                                    np.array(["random", "radial"], object), np.array([2, 0], np.int8), [2.0, 0.0]])
def test_categories(values):
    data = xr.Dataset({"variant": ("case", values)})
    np.testing.assert_array_equal(categories(data, "variant", ("case",), WORDS), [2, 0])


def test_categories_go_by_the_flags_of_the_data():
    flags = {"flag_values": np.array([0, 1, 2], np.int8), "flag_meanings": "random radial circumferential"}
    data = xr.Dataset({"variant": ("case", np.array([0, 1], np.int8), flags)})
    np.testing.assert_array_equal(categories(data, "variant", ("case",), WORDS), [2, 0])
    refused(lambda: categories(data + 2, "variant", ("case",), WORDS), "holds 3", "stands for nothing")
    foreign = data.assign(variant=data["variant"].assign_attrs(flag_meanings="woven radial spun"))
    refused(lambda: categories(foreign, "variant", ("case",), WORDS), "'woven'", "choose from radial")


def check(data, required=("load_node", "force_amplitude"), optional=("loss_factor",)):
    check_cases(data, "plate", required, optional)


def test_what_are_cases_of_the_scene():
    noted = cases(loss_factor=("case", [0.1, 0.2]), note=("case", ["a", "b"]), residual=("case", [0.0, 0.0]))
    check(noted)
    check(noted.drop_vars(["loss_factor", "note"]))
    check(noted.drop_vars("loss_factor").set_coords("note"))


@pytest.mark.parametrize("data, words", [
    (cases(lossfactor=("case", [0.1, 0.2])), ["'lossfactor'", "did you mean 'loss_factor'?"]),
    (cases(Loss_Factor=("case", [0.1, 0.2])), ["'Loss_Factor'", "did you mean 'loss_factor'?"]),
    (cases().rename(load_node="loadnode"), ["'loadnode'", "did you mean 'load_node'?"]),
    (cases(eta=("case", [0.1, 0.2])), ["'eta'", "no loss_factor", "rename"]),
    (cases().drop_vars("load_node"), ["lack the variable 'load_node'", "load_node, force_amplitude"]),
    (cases().isel(case=slice(0)), ["holds no case"]), (cases().isel(force=slice(0)), ["holds no case"]),
    (None, ["NoneType"]), ("cases", ["str"]), (cases()["load_node"], ["DataArray"])])
def test_what_are_none_is_refused(data, words):
    refused(lambda: check(data), *words)


# ---- fields -------------------------------------------------------------------------------------------------

NODE, COMPONENT = np.array([10, 11, 13, 17]), np.array(["x", "y"])
LABELS = {"case": None, "node": NODE, "component": COMPONENT}
TRUTH = np.arange(24.0).reshape(3, 4, 2) + 1j * np.arange(24.0)[::-1].reshape(3, 4, 2)


def answer(values=TRUTH):
    return xr.Dataset({"u": (("case", "node", "component"), values, {"units": "m"})},
                      coords={"case": [4, 5, 6], "node": NODE, "component": COMPONENT})


def test_a_field_in_order_is_a_view():
    data = answer()
    assert np.shares_memory(fields(data, "u", LABELS, "m"), data["u"].values)
    assert np.shares_memory(fields(data.transpose(), "u", LABELS, "m"), data["u"].values)


@pytest.mark.parametrize("change", [
    lambda a: a.isel(node=[3, 0, 2, 1]), lambda a: a.sortby("component", ascending=False), lambda a: a.transpose(),
    lambda a: a.chunk({"node": 2}), lambda a: a.assign_coords(node=NODE.astype(float)), lambda a: a.drop_vars("node"),
    lambda a: a.assign_coords(component=np.array(["x", "y"], "S1")),
    lambda a: a.assign_coords(component=np.array(["x", "y"], object)),
    lambda a: a.pad(node=(1, 0), constant_values=0).assign_coords(node=[9, *NODE]),  # more than is asked for
    lambda a: xr.Dataset({"u": (1e3 * a["u"]).assign_attrs(units="mm")}),
    lambda a: encode_complex(a), lambda a: encode_complex(a).isel(part=[1, 0], node=[2, 3, 1, 0]),
    lambda a: encode_complex(a).chunk().sortby("part").transpose("part", ...)])
def test_fields_are_put_in_order(change):
    np.testing.assert_allclose(fields(change(answer()), "u", LABELS, "m"), TRUTH, rtol=1e-15)


def test_cases_are_put_in_order():
    labels = LABELS | {"case": [6, 4]}
    np.testing.assert_array_equal(fields(answer(), "u", labels), TRUTH[[2, 0]])
    np.testing.assert_array_equal(fields(answer().isel(case=1), "u", LABELS), TRUTH[[1]])
    doubled = answer().assign_coords(case=[4, 4, 6])
    np.testing.assert_array_equal(fields(doubled, "u", LABELS | {"case": [4, 4, 6]}), TRUTH)  # as they stand
    refused(lambda: fields(doubled, "u", labels), "has case 4 twice", kind=SchemaError)


@pytest.mark.parametrize("data, words", [
    (answer().isel(node=[0, 1, 2]), ["lacks node 17:"]), (answer().isel(node=[0, 0, 1, 2, 3]), ["node 10 twice"]),
    (answer().isel(component=[0]), ["lacks component 'y'"]), (answer().isel(component=0), ["dimensions case, node:"]),
    (answer().assign_coords(node=[1, 2, 3, 4]), ["lacks node 10 and 3 more"]),
    (answer().assign_coords(node=list("abcd")), ["lacks node 10 and 3 more"]),
    (answer().drop_vars("node").isel(node=slice(3)), ["3 places along node without labels", "4 are asked for"]),
    (answer().drop_vars("u"), ["lacks u"]), (answer().rename(node="nodes"), ["dimensions case, nodes, component"]),
    (answer().assign(u=answer()["u"].assign_attrs(units="N")), ["'N'", "convert to m"]),
    (answer().astype(str), ["type"]), (encode_complex(answer()).isel(part=[0]), ["parts ['real']"]),
    (encode_complex(answer()).isel(part=[0, 0]), ["parts ['real', 'real']"]),
    (encode_complex(answer()).isel(part=[0, 1, 1]), ["parts ['real', 'imag', 'imag']"]),
    (encode_complex(answer()).drop_vars("part"), ["parts []"])])
def test_fields_without_their_labels_are_refused(data, words):
    refused(lambda: fields(data, "u", LABELS, "m", "the file"), "the file" if "parts" not in words[0] else "u", *words,
            kind=SchemaError)


@pytest.mark.parametrize("change", [
    lambda a: a.isel(node=[3, 0, 2, 1]).sortby("component", ascending=False).transpose(),
    lambda a: encode_complex(a).isel(part=[1, 0], node=[2, 3, 1, 0]).chunk({"case": 1}),
    lambda a: a.assign(u=(1e3 * a["u"]).assign_attrs(units="mm", long_name="displacement"))])
def test_whole_datasets_are_put_in_order(change):
    data = answer().assign(weight=("node", [1.0, 2.0, 3.0, 4.0]))
    labels = {"node": NODE, "component": COMPONENT, "skin": NODE}
    quantities = {"u": (("case", "node", "component"), "m"), "p": (("case",), "Pa")}
    assert in_order(data, labels, quantities) is data
    found = in_order(change(data), labels, quantities)
    xr.testing.assert_allclose(found, data, rtol=1e-15)  # exact but for the rounding of 1e3 times 1e-3
    assert found["u"].dims == data["u"].dims and found["u"].attrs["units"] == "m"


def test_positions():
    assert positions(NODE, NODE.astype(float), "node") is None
    np.testing.assert_array_equal(positions(NODE, NODE[[2, 0]], "node"), [2, 0])


# ---- complex numbers ----------------------------------------------------------------------------------------

def test_parts_are_the_complex_numbers():
    values = np.array([[1 + 2j, -3.5j], [0.25, -1e-300 + 4j]])
    np.testing.assert_array_equal(from_parts(to_parts(values)), values)
    np.testing.assert_array_equal(to_parts(values.T)[..., 1], values.T.imag)  # not contiguous
    assert from_parts(to_parts(values.astype(np.complex64))).dtype == np.complex64
    assert to_parts(np.array(1 + 2j)).tolist() == [1.0, 2.0]


def test_scalars_and_coordinates_are_taken_apart(tmp_path):
    data = answer().assign(gain=2 - 1j, real=("case", [1.0, 2.0, 3.0])).assign_coords(
        pole=("node", [1j, 2.0, 3 - 1j, 0.0], {"units": "rad s-1"}), shift=0.5j)
    encoded = encode_complex(data)
    assert set(encoded.coords) == {*data.coords, "part"}
    assert encoded["gain"].dims == ("part",) and encoded["pole"].dims == ("node", "part")
    xr.testing.assert_identical(decode_complex(encoded), data)
    encoded.to_netcdf(tmp_path / "complex.nc")
    with xr.open_dataset(tmp_path / "complex.nc") as found:
        xr.testing.assert_identical(decode_complex(found.load()), data)
    xr.testing.assert_identical(decode_complex(encoded.chunk()).compute(), data)
    assert decode_complex(encoded.chunk())["u"].chunks is not None
    refused(lambda: encode_complex(data.assign_coords(node=[1j, 2, 3, 4])), "'node' is complex")


def test_parts_that_are_no_numbers_are_refused():
    words = xr.DataArray(["a", "b"], dims="part", coords={"part": ["real", "imag"]}, name="u")
    refused(lambda: join_parts(words), "u is of type", kind=SchemaError)
    whole = join_parts(xr.DataArray([1, 2], dims="part", coords={"part": ["imag", "real"]}, name="u"))
    assert whole.item() == 2 + 1j


# ---- any order ----------------------------------------------------------------------------------------------

@settings(deadline=None)
@given(st.data())
def test_any_order_says_the_same(data):
    draw = data.draw
    node, component, case = (draw(st.permutations(range(n))) for n in (4, 2, 3))
    changed = encode_complex(answer()) if draw(st.booleans()) else answer()
    changed = changed.isel(node=node, component=component, case=case)
    if "part" in changed.dims:
        changed = changed.isel(part=draw(st.permutations(range(2))))
    changed = changed.transpose(*draw(st.permutations(list(changed.dims))))
    if draw(st.booleans()):
        changed = changed.chunk({dim: draw(st.integers(1, 4)) for dim in ("case", "node")})
    if draw(st.booleans()):
        changed = changed.assign_coords(node=changed["node"].astype(draw(st.sampled_from(["f4", "f8", "i2", "u1"]))))
    found = fields(changed, "u", LABELS | {"case": [4, 5, 6]}, "m")
    np.testing.assert_array_equal(found, TRUTH)
