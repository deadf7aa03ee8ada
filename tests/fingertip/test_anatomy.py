import json
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rom.errors import AnatomyError
from rom.fingertip import TISSUES, Anatomy, MeshDensity, SurfaceShape, Tissue, build_mesh

TINY = MeshDensity((4, 4), 2, 2, (1, 1, 1, 1))


def test_defaults_are_the_published_tables():
    anatomy = Anatomy()
    # table 1: l_f, w_f, h_f, l_n, t_sc, t_ep, t_de, l_b
    assert (anatomy.fingertip_length, anatomy.fingertip_width, anatomy.fingertip_height) == (28.0, 18.0, 15.0)
    assert (anatomy.nail_length, anatomy.bone_length) == (17.6, 22.5)
    assert (anatomy.stratum_corneum_thickness, anatomy.epidermis_thickness) == (0.4, 0.1)
    assert anatomy.dermis_thickness == 1.5
    # table 2
    assert anatomy.dermis == Tissue(0.080, 0.48, 1.274)
    assert anatomy.nail_plate == Tissue(170.0, 0.30, 1.300)


def test_upper_exponent_gives_the_nail_its_height():
    # derived by hand from h_n = 2.5, w_n = 12.3, w_f = 18, c = 7.5: n = 1.764 satisfies
    # 7.5 (1 - (1 - (12.3/18)^n)^(1/n)) = 2.5
    anatomy = Anatomy().replace_shape(dorsal_fraction=0.5)
    n = anatomy.upper_exponent
    assert n == pytest.approx(1.764, abs=1e-3)
    assert 7.5 * (1 - (1 - (12.3 / 18) ** n) ** (1 / n)) == pytest.approx(2.5, rel=1e-9)


def test_changes_make_copies():
    anatomy = Anatomy()
    changed = anatomy.replace(dermis_thickness=2).replace_tissue("dermis", poisson_ratio=0.495)
    changed = changed.replace_shape(bone_axis_rise=0.8)
    assert (changed.dermis_thickness, changed.dermis.poisson_ratio, changed.shape.bone_axis_rise) == (2.0, 0.495, 0.8)
    assert anatomy == Anatomy()


@settings(max_examples=20, deadline=None)
@given(
    dermis=st.floats(0.5, 2.0),
    nu=st.floats(0.0, 0.4999),
    modulus=st.floats(1e-3, 1e3),
    exponent=st.floats(2.0, 5.0),
)
def test_dictionaries_make_the_same_anatomy_again(dermis, nu, modulus, exponent):
    anatomy = Anatomy(dermis_thickness=dermis, hypodermis=Tissue(modulus, nu, 1.0))
    anatomy = anatomy.replace_shape(lower_exponent=exponent)
    assert Anatomy.from_dict(json.loads(json.dumps(anatomy.to_dict()))) == anatomy


def spoiled(path, value):
    values = Anatomy().to_dict()
    part = values
    for key in path[:-1]:
        part = part[key]
    if value is None:
        del part[path[-1]]
    else:
        part[path[-1]] = value
    return values


@pytest.mark.parametrize(
    "values",
    [
        spoiled(("fingernail",), 1.0),
        spoiled(("bone_length",), None),
        spoiled(("dermis", "colour"), 1.0),
        spoiled(("shape", "tuft_fraction"), None),
        spoiled(("dermis",), 3.0),
    ],
    ids=["unknown", "missing", "unknown in tissue", "missing in shape", "no tissue"],
)
def test_foreign_dictionaries_are_refused(values):
    with pytest.raises(AnatomyError):
        Anatomy.from_dict(values)


IMPOSSIBLE = {
    "nu of one half": lambda: Anatomy().replace_tissue("dermis", poisson_ratio=0.5),
    "nu of minus one": lambda: Tissue(1.0, -1.0, 1.0),
    "no stiffness": lambda: Tissue(0.0, 0.3, 1.0),
    "endless stiffness": lambda: Tissue(float("inf"), 0.3, 1.0),
    "negative density": lambda: Tissue(1.0, 0.3, -1.0),
    "unknown tissue": lambda: Anatomy().replace_tissue("muscle", density=1.0),
    "unknown property": lambda: Anatomy().replace_tissue("dermis", colour=1.0),
    "unknown dimension": lambda: Anatomy().replace(dermis=Tissue(1, 0.3, 1), depth=1.0),
    "nan": lambda: Anatomy(dermis_thickness=float("nan")),
    "text": lambda: Anatomy(dermis_thickness="1.5"),
    "negative length": lambda: Anatomy(bone_length=-22.5),
    "bone through the tip": lambda: Anatomy(bone_length=30.0),
    "bone wider than the finger": lambda: Anatomy(bone_proximal_width=19.0),
    "bone through the palmar skin": lambda: Anatomy(bone_proximal_height=12.5),
    "nail wider than the finger": lambda: Anatomy(nail_width=18.0),
    "nail too high": lambda: Anatomy(nail_height=7.0).upper_exponent,
    "tip before the tuft": lambda: Anatomy(bone_distal_length=23.0),
    "base beyond the neck": lambda: Anatomy().replace_shape(bone_base_length=15.0),
    "tuft beyond the tip": lambda: SurfaceShape(tuft_fraction=1.2),
    "tissue that is a number": lambda: Anatomy(dermis=1.0),
    "layers thicker than the room": lambda: build_mesh(Anatomy(dermis_thickness=6.0), TINY),
    "bone axis through the skin": lambda: build_mesh(Anatomy().replace_shape(bone_axis_rise=8.0), TINY),
    "bone that turns elements over": lambda: build_mesh(Anatomy(bone_distal_length=5.0, bone_distal_width=12.0)),
    "pad off the mesh": lambda: build_mesh(Anatomy().replace_shape(pad_start=0.95, pad_depth=0.95), TINY),
    "odd cap": lambda: MeshDensity(cap=(3, 4)),
    "no rings": lambda: MeshDensity(front_rings=0),
    "half a layer": lambda: MeshDensity(layers=(1, 1, 0.5, 1)),
    "missing layer": lambda: MeshDensity(layers=(1, 1, 1)),
    "negative factor": lambda: MeshDensity().scaled(-1),
}


@pytest.mark.parametrize("make", IMPOSSIBLE.values(), ids=IMPOSSIBLE.keys())
def test_the_impossible_is_refused_in_one_sentence(make):
    with pytest.raises(AnatomyError) as refusal:
        make()
    message = str(refusal.value)
    assert "\n" not in message
    assert 20 < len(message) < 500
    assert ":" in message  # value and rule before the colon, remedy after it


def test_importing_costs_no_finite_element_library():
    code = "import sys, rom.fingertip; sys.exit(any(name.split('.')[0] == 'skfem' for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_every_tissue_is_a_field():
    assert all(isinstance(Anatomy().tissue(name), Tissue) for name in TISSUES)
