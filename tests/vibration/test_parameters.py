"""Parameters by name: all of both tables, none that only chooses nodes, each with its unit."""

import pytest

from rom.errors import AnatomyError
from rom.fingertip.anatomy import DIMENSIONS, TISSUES
from rom.vibration.parameters import NODE_CHOICES, parameters, with_parameter


def test_both_tables_and_the_declared_shape_are_listed(tiny_tip):
    found = {one.name: one for one in parameters(tiny_tip)}
    assert set(DIMENSIONS) <= set(found)
    properties = ("elastic_modulus", "poisson_ratio", "density")
    assert {f"{tissue}.{item}" for tissue in TISSUES for item in properties} <= set(found)
    assert "shape.lower_exponent" in found and not {f"shape.{name}" for name in NODE_CHOICES} & set(found)
    assert {found[name].unit for name in DIMENSIONS} == {"mm"}
    assert [found[f"dermis.{item}"].unit for item in properties] == ["MPa", "-", "g/cm3"]
    assert found["fingertip_width"].value == tiny_tip.anatomy.fingertip_width
    assert found["dermis.poisson_ratio"].label == "dermis: Poisson's ratio"
    assert [one.kind for one in found.values()] == sorted(
        (one.kind for one in found.values()), key=["dimension", "assumption", "property"].index)


def test_every_parameter_can_be_changed_and_nothing_else_changes(tiny_tip):
    for one in parameters(tiny_tip):
        value = one.value + 1e-3 * one.scale
        other = {p.name: p.value for p in parameters(with_parameter(tiny_tip, one.name, value))}
        same = {p.name: p.value for p in parameters(tiny_tip)} | {one.name: value}
        assert other == same


def test_a_parameter_of_zero_has_one_unit_as_its_scale(tiny_tip):
    tip = with_parameter(tiny_tip, "shape.bone_axis_rise", 0.0)
    assert parameters(tip, ["shape.bone_axis_rise"])[0].scale == 1.0


def test_refusals(tiny_tip):
    with pytest.raises(ValueError, match=r"no parameter 'dermis.colour'.*choose among"):
        parameters(tiny_tip, ["dermis.colour"])
    with pytest.raises(ValueError, match=r"no parameter 'shape\.pad_depth'"):
        with_parameter(tiny_tip, "shape.pad_depth", 0.3)
    with pytest.raises(AnatomyError, match=r"density=-1\.0 cannot be"):
        with_parameter(tiny_tip, "dermis.density", -1.0)
