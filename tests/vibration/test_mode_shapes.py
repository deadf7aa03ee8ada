"""Measures of mode shapes against fields whose shape is known by construction."""

import numpy as np
import pytest

from rom.vibration.mode_shapes import DESCRIPTIONS, MEASURES, SIGNED, descriptions_met, shape_measures
from rom.vibration.skin_motion import Skin, on_all_nodes, opposition, skin_areas


@pytest.fixture(scope="module")
def skin(small_tip):
    return Skin(small_tip.mesh)


@pytest.fixture(scope="module")
def measured(small_tip):
    """A function: measures of one skin field (n_skin, 3), the inside at rest."""
    def measure(motion):
        full = np.zeros((small_tip.mesh.n_nodes, 3))
        full[small_tip.mesh.skin_nodes] = motion
        values = shape_measures(small_tip.mesh, small_tip.free_dofs, full.ravel()[small_tip.free_dofs][:, None])
        return {name: float(value[0]) for name, value in values.items()}
    return measure


def meets(measures, parity):
    found = descriptions_met({name: np.array([value]) for name, value in measures.items()}, np.array([parity]))
    return [one.mode for one, met in zip(DESCRIPTIONS, found[:, 0], strict=True) if met]


def test_the_skins_area_by_two_rules(small_tip):
    # independent: two triangles a quadrilateral
    corners = small_tip.mesh.nodes[small_tip.mesh.skin_quads]
    halves = [np.cross(corners[:, i] - corners[:, 0], corners[:, i + 1] - corners[:, 0]) for i in (1, 2)]
    triangles = sum(np.linalg.norm(half, axis=1).sum() / 2 for half in halves)
    assert skin_areas(small_tip.mesh).sum() == pytest.approx(triangles, rel=0.02)


def test_the_bones_axis(small_tip, skin):
    point, direction = skin.bone_axis
    anatomy = small_tip.anatomy
    slope = anatomy.shape.bone_axis_rise / anatomy.bone_length
    assert point[2] == pytest.approx(anatomy.bone_axis_height * 1e-3, abs=1e-5)
    assert direction[2] / direction[0] == pytest.approx(slope, abs=1e-3)


def test_rigid_rotation_about_the_bone_is_torsion(skin, measured):
    found = measured(skin.torsion())
    assert found["torsion"] == pytest.approx(1)
    assert found["distal_torsion"] == pytest.approx(1) and found["proximal_torsion"] == pytest.approx(1)
    assert found["lateral_rotation"] == pytest.approx(0, abs=1e-20)
    assert meets(found, "antisymmetric") == [1] and 1 not in meets(found, "symmetric")


def test_the_axis_of_a_lateral_rotation_is_found(skin):
    # by hand: rotation about the line x = 12 mm, z = 9 mm
    motion = np.cross([0.0, 1.0, 0.0], skin.position - [0.012, 0.0, 0.009])
    share, axis = skin.lateral_axis(motion[:, :, None])
    assert share[0] == pytest.approx(1)
    assert np.allclose(axis[:, 0], [0.012, 0.009])


def test_rotation_far_above_the_pad_slides_it(skin, measured):
    found = measured(np.cross([0.0, 1.0, 0.0], skin.position - [0.012, 0.0, 0.02]))
    assert found["lateral_rotation"] == pytest.approx(1)
    assert meets(found, "symmetric") == [2]
    through_the_pad = measured(np.cross([0.0, 1.0, 0.0], skin.position - [0.014, 0.0, -0.005]))
    assert through_the_pad["lateral_rotation"] == pytest.approx(1)
    assert 2 not in meets(through_the_pad, "symmetric")


def test_sideways_in_front_and_torsion_behind(skin, measured):
    distal = skin.distal[:, None]
    found = measured(np.where(distal, skin.translation(1), skin.torsion() * 100))
    assert found["distal_lateral"] == pytest.approx(1) and found["proximal_torsion"] == pytest.approx(1)
    assert 3 in meets(found, "antisymmetric")
    other_way = measured(np.where(distal, skin.torsion() * 100, skin.translation(1)))
    assert 3 not in meets(other_way, "antisymmetric")


def test_contraction_and_expansion(skin, measured):
    aside, down = np.abs(skin.normal[:, 1]), np.maximum(-skin.normal[:, 2], 0)
    breathing = (down**2 - aside**2)[:, None] * skin.normal
    found = measured(breathing)
    assert found["contraction"] > 0 and meets(found, "symmetric") == [4]
    assert 4 not in meets(measured(skin.normal), "symmetric")  # all outward: in phase
    assert measured(skin.normal)["contraction"] < 0


def test_left_and_right_in_phase_along_the_finger_or_not(skin, measured):
    left = np.sign(skin.position[:, 1])[:, None] * (np.abs(skin.position[:, 1]) > 1e-9)[:, None]
    along = np.where(skin.distal, 1.0, -1.0)[:, None]
    whole, diagonal = measured(left * skin.normal), measured(left * along * skin.normal)
    assert whole["lower_normal"] == pytest.approx(1)
    assert whole["lower_diagonal"] == pytest.approx(-1) and whole["side_diagonal"] == pytest.approx(-1)
    assert diagonal["lower_diagonal"] == pytest.approx(1) and diagonal["side_diagonal"] == pytest.approx(1)
    assert meets(whole, "antisymmetric") == [5]
    assert meets(diagonal, "antisymmetric") == [7]


def test_distal_section_up_and_proximal_section_down(skin, measured):
    found = measured(np.where(skin.distal, 1.0, -1.0)[:, None] * skin.translation(2))
    assert found["vertical_antiphase"] == pytest.approx(1)
    assert 6 in meets(found, "symmetric")
    assert 6 not in meets(measured(skin.translation(2)), "symmetric")


def test_scale_and_sign_of_a_shape_do_not_matter(small_tip):
    rng = np.random.default_rng(4)
    shape = rng.standard_normal((len(small_tip.free_dofs), 3))
    one, other = (shape_measures(small_tip.mesh, small_tip.free_dofs, factor * shape) for factor in (1.0, -1e4))
    assert set(one) == set(MEASURES)
    for name, values in one.items():
        assert np.allclose(values, other[name], rtol=1e-10)
        assert np.all(values <= 1 + 1e-12) and np.all(values >= (-1 if name in SIGNED else 0))


def test_rest_is_no_motion(small_tip):
    values = shape_measures(small_tip.mesh, small_tip.free_dofs, np.zeros((len(small_tip.free_dofs), 1)))
    assert all(value[0] == 0 for value in values.values())


def test_opposition():
    a, b = np.array([1.0, 1.0, 2.0, 1e-12]), np.array([-1.0, 1.0, 0.0, 1e-12])
    assert np.array_equal(opposition(a, b, np.ones(4)), [1, -1, 0, 0])


def test_held_nodes_stand_still(small_tip):
    field = on_all_nodes(small_tip.mesh, small_tip.free_dofs, np.ones((len(small_tip.free_dofs), 1)))
    assert not field[small_tip.mesh.bone_nodes].any()
    assert field[small_tip.mesh.skin_nodes].all()
