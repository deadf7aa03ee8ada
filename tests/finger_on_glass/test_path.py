"""Whole paths: friction's limit, energy, fibres, and what happens where a path cannot go on."""

from dataclasses import replace

import numpy as np
import pytest

from rom.finger_on_glass.contact import Glass
from rom.finger_on_glass.observation import contact_edges, last_piece
from rom.finger_on_glass.path import LoadPath, follow
from rom.finger_on_glass.section import Section
from rom.finger_on_glass.tissue import FIBRE_CAP, Tissue


def test_positions_are_met(walked):
    _, answer, steps = walked
    assert answer.complete
    assert answer.reason == ""
    assert [o.normal_force for o in answer.observations] == pytest.approx([0.1, 0.2, 0.3, 0.4] + 6 * [0.5], rel=1e-7)
    assert [o.tangential_displacement for o in answer.observations] == pytest.approx(5 * [0.0] + [0.5, 1, 2, 3, 4])
    assert answer.last is answer.observations[-1] is steps[-1]


def test_nothing_viscous_where_none_is_needed(walked):
    assert {o.viscosity for o in walked[2]} == {0.0}


def test_friction_stays_within_its_limit(walked):
    """At every node of every step, so for the forces too."""
    finger, _, steps = walked
    for o in steps:
        assert (np.abs(o.shear) <= finger.plate.friction * o.pressure * (1 + 1e-9) + 1e-15).all()
        assert abs(o.tangential_force) <= finger.plate.friction * o.normal_force * (1 + 1e-9)
        assert (o.pressure >= 0).all()
        assert 0 <= o.slipping <= o.touching


def test_energy_balance_closes(walked):
    """Work of the plate against what is stored and dissipated: within 1 % at every position."""
    for o in walked[1].observations:
        assert abs(o.work - o.energy - o.dissipated) < 0.01 * o.work
        assert o.dissipated >= -1e-9


def test_fibres_stay_below_the_cap(walked):
    assert max(o.largest_fibre for o in walked[2]) <= FIBRE_CAP


def test_forces_grow_with_pressing_and_sliding(walked):
    pressing, sliding = walked[1].observations[:5], walked[1].observations[4:]
    assert (np.diff([o.normal_displacement for o in pressing]) > 0).all()
    assert (np.diff([o.width for o in pressing]) > 0).all()
    assert (np.diff([o.tangential_force for o in sliding]) > -1e-9).all()


def test_pressure_sums_to_the_force(walked):
    """Tractions over the deformed skin times its length; symmetric variants are pulled nowhere by pressing."""
    from rom.finger_on_glass.finger import tributary

    finger, answer, _ = walked
    o = answer.observations[-1]
    skin = finger.mesh.skin_nodes
    length = tributary(finger.mesh.nodes[skin] + o.state.displacement[skin]) * finger.out_of_plane.effective_length
    assert length @ o.pressure == pytest.approx(o.normal_force, rel=1e-10)
    assert length @ o.shear == pytest.approx(o.tangential_force, rel=1e-10)
    if finger.tissue.variant != "random":
        assert abs(answer.observations[4].tangential_force) < 1e-5


# ---- the end of a path --------------------------------------------------------------------------------------

def ends(answer):
    assert not answer.complete
    assert answer.reason.count("\n") == 0
    assert len(answer.reason) > 40
    return answer.reason


def test_vanishing_matrix_ends_with_the_last_step(coarse):
    """c = 1e-9 MPa: fibres alone do not hold a section up."""
    answer = follow(coarse(tissue=Tissue("radial", c=1e-9)), LoadPath((0.1, 0.3, 0.5)))
    reason = ends(answer)
    assert len(answer.observations) < 3
    assert "stiffer tissue" in reason
    assert answer.last is not None  # whatever was reached, the finger at rest at least
    assert np.isfinite(answer.last.state.displacement).all()
    assert answer.last.normal_force < 0.5


def test_friction_of_five_ends_with_the_last_step(coarse):
    """A plate that hardly ever lets go: the section folds before 12 mm."""
    finger = coarse(plate=Glass(friction=5.0))
    answer = follow(finger, LoadPath((0.2, 0.5), (3.0, 12.0)), viscosities=(0.0,))
    reason = ends(answer)
    assert "mm of travel" in reason
    assert answer.last is not None
    assert answer.last.tangential_displacement < 12
    assert f"ends at {answer.last.tangential_displacement:.4g} mm" in reason
    assert answer.last.largest_fibre <= FIBRE_CAP


def test_bone_outside_the_skin_is_refused():
    with pytest.raises(ValueError, match=r"reaches out of a skin .* make it smaller or move it inwards"):
        Section(bone_offset=5.6)


def test_too_small_a_first_force_is_named(coarse):
    answer = follow(coarse(), LoadPath((1e-12,)))
    assert "give a larger first force" in ends(answer)
    assert answer.observations == []
    assert answer.last is not None
    assert (answer.last.steps, answer.last.normal_force, answer.last.touching) == (0, 0.0, 0)


def test_viscosity_is_raised_only_where_asked(coarse):
    """Used from the start where the first one is not zero, and told by every observation."""
    seen = []
    answer = follow(coarse(), LoadPath((0.2,), (0.2, 0.4)), viscosities=(1e-5,), on_step=seen.append)
    assert answer.complete
    assert [o.viscosity for o in seen if o.tangential_displacement > 0] == pytest.approx(
        [1e-5] * sum(o.tangential_displacement > 0 for o in seen))


def test_viscous_dissipation_closes_the_balance(coarse):
    """With the largest resistance that paths take to."""
    answer = follow(coarse(), LoadPath((0.2, 0.4), (0.5, 1.0, 1.5)), viscosities=(1e-4,))
    o = answer.observations[-1]
    assert abs(o.work - o.energy - o.dissipated) < 0.01 * o.work


@pytest.mark.parametrize("bad", [{"normal_force": ()}, {"normal_force": (0.2, 0.1)}, {"normal_force": (0.0,)},
                                 {"normal_force": "0.5"}, {"travel": (1.0, 1.0)}, {"travel": (float("nan"),)},
                                 {"travel": 3.0}, {"travel": (2e3,)}])
def test_impossible_paths_are_refused(bad):
    with pytest.raises(ValueError, match=r"path|list of positions|cannot be: give a finite number above 0"):
        LoadPath(**bad)


# ---- observations -------------------------------------------------------------------------------------------

def test_edges_of_a_hertzian_profile():
    """p ~ sqrt(a^2 - x^2), gap by Johnson, Contact Mechanics (1985), section 4.2: within 8 % of a node's spacing."""
    for a in (2.93, 3.02, 3.17):
        x = np.arange(-5, 5.01, 0.25)
        pressure = np.sqrt(np.maximum(a * a - x * x, 0))
        far = np.maximum(np.abs(x) / a, 1.0)
        gap = 0.01 * (far * np.sqrt(far**2 - 1) - np.log(far + np.sqrt(far**2 - 1)))
        left, right = contact_edges(x, gap, pressure)
        assert -left == pytest.approx(right)
        assert right == pytest.approx(a, abs=0.02)


def test_edges_without_contact_and_with_one_node():
    x, flat = np.arange(5.0), np.zeros(5)
    assert np.isnan(contact_edges(x, flat, np.zeros(5))).all()
    assert contact_edges(x, flat, np.array([0, 0, 1.0, 0, 0])) == (1.5, 2.5)
    left, right = contact_edges(x, flat, np.ones(5))
    assert left == 0.0
    assert right == 4.0


def test_work_of_a_parabola_is_exact():
    x = np.array([0.2, 0.5, 1.1])
    y = 3 * x**2 - x + 2
    exact = (1.1**3 - 0.5**3) - 0.5 * (1.1**2 - 0.5**2) + 2 * 0.6
    assert last_piece(x, y) == pytest.approx(exact, rel=1e-12)
    assert last_piece(x[1:], y[1:]) == pytest.approx(0.3 * (y[1] + y[2]))
    assert last_piece(np.array([0.6, 0.5, 1.1]), y) == pytest.approx(0.3 * (y[1] + y[2]))  # it turned round


def test_a_rolling_contact_is_seen_whole(coarse):
    """The half of the skin that is looked at follows the pressure."""
    from rom.finger_on_glass.observation import along_plate

    pressure = np.zeros(40)
    pressure[[9, 10, 11]] = 1.0
    assert {9, 10, 11} <= set(along_plate(pressure).tolist())
    assert np.array_equal(along_plate(np.zeros(40)), np.arange(-10, 11) % 40)


def test_finger_without_plate_contact_has_no_width(coarse):
    finger = coarse()
    rest = finger.at_rest()
    assert finger.lowest == pytest.approx(-7.5)
    assert rest.contact.gap.min() == 0
    assert replace(rest, plate_x=1.0).displacement is rest.displacement
