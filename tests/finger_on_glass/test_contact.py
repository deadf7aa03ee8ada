"""Tractions at single nodes: laws by hand, derivatives by finite differences."""

import numpy as np
import pytest

from rom.finger_on_glass.contact import ContactHistory, Glass, contact_response

PLATE = Glass(friction=0.8, normal_stiffness=20.0, tangential_stiffness=5.0)


def history():
    """Open, touching before and sticking, slipping, far away."""
    return ContactHistory(gap=np.array([0.03, 0.0, 0.0, 1.0]), shear=np.array([0.0, 0.01, -0.16, 0.0]),
                          relative=np.array([0.0, 0.1, -0.2, 0.0]), closed=np.array([False, True, True, False]),
                          slipping=np.array([False, False, True, False]))


GAP = np.array([-0.02, -0.01, -0.01, 0.5])
RELATIVE = np.array([0.004, 0.11, -0.35, 0.2])


def test_laws_by_hand():
    found = contact_response(PLATE, history(), GAP, RELATIVE)
    assert found.pressure == pytest.approx([0.4, 0.2, 0.2, 0.0])
    # touched after 3/5 of the step, sticks since: 5 * (2/5) * 0.004; sticks: .01 + 5 * .01; slips: -mu p
    assert found.shear == pytest.approx([5 * 0.4 * 0.004, 0.06, -0.16, 0.0])
    assert found.slipping.tolist() == [False, False, True, False]
    assert (np.abs(found.shear) <= PLATE.friction * found.pressure + 1e-15).all()


@pytest.mark.parametrize("shift", [0.0, 0.5])
@pytest.mark.parametrize("predict", [False, True])
def test_derivatives(shift, predict):
    """Sticking, slipping (``shift`` pushes every closed node over) and newly touching nodes, central differences."""
    h, relative = 1e-7, RELATIVE + shift
    at = contact_response(PLATE, history(), GAP, relative, predict)
    if shift and not predict:
        assert at.slipping[:3].all()

    def ahead(gap_step, x_step):
        found = contact_response(PLATE, history(), GAP + gap_step, relative + x_step, predict)
        return np.stack([found.pressure, found.shear])

    by_gap = (ahead(h, 0) - ahead(-h, 0)) / (2 * h)
    by_x = (ahead(0, h) - ahead(0, -h)) / (2 * h)
    scale = PLATE.normal_stiffness
    assert np.abs(by_gap[0] - at.pressure_by_gap).max() < 1e-6 * scale
    assert np.abs(by_gap[1] - at.shear_by_gap).max() < 1e-6 * scale
    assert np.abs(by_x[1] - at.shear_by_x).max() < 1e-6 * scale
    assert np.abs(by_x[0]).max() == 0


def test_predictor_keeps_who_slipped():
    found = contact_response(PLATE, history(), GAP, RELATIVE + 10, predict=True)
    assert found.slipping.tolist() == [False, False, True, False]


def test_history_of_open_nodes_is_clean():
    kept = contact_response(PLATE, history(), GAP, RELATIVE).history()
    assert kept.gap.tolist() == [0, 0, 0, 0.5]
    assert kept.shear[3] == 0


@pytest.mark.parametrize("changes", [{"friction": -0.1}, {"normal_stiffness": 0.0}, {"tangential_stiffness": np.inf},
                                     {"friction": "1"}, {"friction": True}])
def test_impossible_plates_are_refused(changes):
    with pytest.raises(ValueError, match="give a finite number from"):
        Glass(**changes)
