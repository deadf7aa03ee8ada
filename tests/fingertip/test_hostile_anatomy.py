"""Hostile values make a valid fingertip or one sentence: anatomy, tissues, surfaces, mesh densities."""


import numpy as np
import pytest
from hostile import EXTREME, HOSTILE, numbers, one_line, refuses_or_makes, things
from hypothesis import given, settings
from hypothesis import strategies as st

from rom.errors import AnatomyError, SolverError
from rom.fingertip import TISSUES, Anatomy, Fingertip, MeshDensity, Tissue
from rom.fingertip.anatomy import DIMENSIONS
from rom.fingertip.shape import SurfaceShape
from rom.fullorder import SecondOrderModel

COARSE = MeshDensity((2, 2), 1, 1, (1, 1, 1, 1))
SHAPE_FIELDS = tuple(SurfaceShape.__dataclass_fields__)


@settings(HOSTILE, max_examples=150)
@given(things, things, things)
def test_a_tissue_is_valid_or_refused(modulus, ratio, density):
    tissue = refuses_or_makes(lambda: Tissue(modulus, ratio, density), AnatomyError)
    if tissue is not None:
        assert 0 < tissue.elastic_modulus < np.inf and 0 < tissue.density < np.inf and -1 < tissue.poisson_ratio < 0.5
        assert all(type(value) is float for value in vars(tissue).values())
        assert 0 < tissue.shear_modulus < np.inf and 0 < tissue.bulk_modulus < np.inf


@settings(HOSTILE, max_examples=150)
@given(st.sampled_from(SHAPE_FIELDS), things)
def test_a_shape_is_valid_or_refused(name, value):
    shape = refuses_or_makes(lambda: SurfaceShape(**{name: value}), AnatomyError)
    if shape is not None:
        assert np.isfinite(getattr(shape, name)) and type(getattr(shape, name)) is float


@settings(HOSTILE, max_examples=200)
@given(st.dictionaries(st.sampled_from(DIMENSIONS), things, min_size=1, max_size=3), st.data())
def test_an_anatomy_is_valid_or_refused(changes, data):
    anatomy = refuses_or_makes(lambda: Anatomy().replace(**changes), AnatomyError)
    if anatomy is not None:
        assert all(0 < getattr(anatomy, name) < np.inf for name in DIMENSIONS)
        refuses_or_makes(lambda: anatomy.upper_exponent, AnatomyError)
    part = {data.draw(st.sampled_from([*TISSUES, "shape"])): data.draw(things)}
    refuses_or_makes(lambda: Anatomy().replace(**part), AnatomyError)


@settings(HOSTILE, max_examples=100)
@given(things)
def test_a_record_is_read_or_refused(value):
    good = Anatomy().to_dict()
    for record in (value, good | {"dermis": value}, good | {"shape": value}, good | {"nail_width": value}):
        refuses_or_makes(lambda record=record: Anatomy.from_dict(record), AnatomyError)
    for record in (value, MeshDensity().to_dict() | {"cap": value}, MeshDensity().to_dict() | {"rear_rings": value}):
        refuses_or_makes(lambda record=record: MeshDensity.from_dict(record), AnatomyError)


@settings(HOSTILE, max_examples=150)
@given(st.one_of(things, st.tuples(things, things)), things, st.one_of(things, st.tuples(*[things] * 4)))
def test_a_density_is_valid_or_refused(cap, rings, layers):
    for make in (lambda: MeshDensity(cap), lambda: MeshDensity(front_rings=rings), lambda: MeshDensity(layers=layers),
                 lambda: MeshDensity().scaled(rings)):
        density = refuses_or_makes(make, AnatomyError)
        if density is not None:
            assert density.nodes_per_shell > 0 and all(type(count) is int for count in (*density.cap, *density.layers))


@settings(HOSTILE, max_examples=100)
@given(things, things, things, things)
def test_a_fingertip_is_made_of_its_parts_or_refused(anatomy, density, formulation, rear):
    for make in (lambda: Fingertip(anatomy=anatomy), lambda: Fingertip(density=density),
                 lambda: Fingertip(formulation=formulation), lambda: Fingertip(rear=rear),
                 lambda: Fingertip.preset(formulation)):
        refuses_or_makes(make, ValueError)


@settings(HOSTILE, max_examples=60)
@given(st.dictionaries(st.sampled_from([*DIMENSIONS, *(f"shape.{name}" for name in SHAPE_FIELDS)]),
                       st.floats(0.02, 50.0), min_size=1, max_size=4))
def test_a_mesh_is_upright_or_refused(changes):
    shape = {name.partition(".")[2]: value for name, value in changes.items() if name.startswith("shape.")}
    sizes = {name: value for name, value in changes.items() if not name.startswith("shape.")}
    anatomy = refuses_or_makes(lambda: Anatomy().replace_shape(**shape).replace(**sizes), AnatomyError)
    if anatomy is not None:
        mesh = refuses_or_makes(lambda: Fingertip(anatomy, COARSE).mesh, AnatomyError)
        if mesh is not None:
            assert np.isfinite(mesh.nodes).all() and (mesh.element_volumes > 0).all()
            assert mesh.quality["min_scaled_jacobian"] > 0 and len(mesh.pad_nodes) > 0


@pytest.mark.filterwarnings("ignore::rom.fullorder.IllConditionedWarning")  # said, and the answer is finite
@settings(HOSTILE, max_examples=40)
@given(st.sampled_from(TISSUES), st.sampled_from(["elastic_modulus", "density", "poisson_ratio"]),
       st.floats(-15.0, 15.0))
def test_a_solution_is_finite_or_refused(tissue, name, exponent):
    # thirty powers of ten, the whole range that a tissue admits
    value = 0.5 - 10.0 ** -abs(exponent) if name == "poisson_ratio" else 10.0**exponent
    anatomy = refuses_or_makes(lambda: Anatomy().replace_tissue(tissue, **{name: value}), AnatomyError)
    if anatomy is not None:
        tip = Fingertip(anatomy, COARSE)
        model = SecondOrderModel(tip.stiffness, tip.mass)
        force = tip.normal_force(0)
        for solve in (lambda: model.solve_static(force), lambda: model.solve_harmonic(force, 100.0, 0.1)):
            answer = refuses_or_makes(solve, ValueError, SolverError)
            assert answer is None or np.isfinite(answer).all()


@settings(HOSTILE, max_examples=100)
@given(things, things)
def test_forces_go_where_they_can(tiny_tip, node, vector):
    tip = tiny_tip
    for make in (lambda: tip.point_force(node, [0.0, 0.0, 1.0]), lambda: tip.point_force(5, vector),
                 lambda: tip.normal_force(node), lambda: tip.patch_force(5, vector), lambda: tip.skin_frame(node)):
        refuses_or_makes(make, ValueError)


@pytest.mark.parametrize("value", EXTREME)
def test_every_refusal_names_what_it_refuses(value):
    with pytest.raises(AnatomyError) as caught:
        Tissue(1.0, value, 1.0) if not -1 < value < 0.5 else Tissue(value if value <= 0 else -1.0, 0.3, 1.0)
    assert any(word in one_line(caught.value) for word in ("poisson_ratio", "elastic_modulus"))


def test_numpy_scalars_are_numbers():
    assert Tissue(np.float32(0.5), np.float64(0.3), np.int64(1)) == Tissue(0.5, 0.3, 1.0)


@settings(HOSTILE, max_examples=30)
@given(numbers)
def test_a_number_is_a_number_or_not(value):
    refuses_or_makes(lambda: Anatomy(fingertip_length=value), AnatomyError)
