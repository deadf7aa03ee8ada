"""Stretches and strains of states that are known by hand; profiles of a walked path."""

from dataclasses import replace

import numpy as np
import pytest
from analysis.contact_outputs import receptor_strain, smoothed, stretches

from rom.finger_on_glass.observation import along_plate

GRADIENT = np.array([[1.1, 0.2], [-0.1, 0.95]])


def affine(finger):
    """F the same everywhere."""
    rest = finger.at_rest()
    return replace(rest, displacement=finger.mesh.nodes @ (GRADIENT - np.eye(2)).T)


def test_stretches_of_an_affine_state(coarse):
    finger = coarse()
    radial, around = stretches(finger, affine(finger))
    middle = finger.mesh.nodes[finger.mesh.quads].mean(axis=1)
    e_r = finger.section.radial_directions(middle)
    e_t = np.column_stack([-e_r[:, 1], e_r[:, 0]])
    assert radial == pytest.approx(np.linalg.norm(e_r @ GRADIENT.T, axis=1), rel=1e-10)
    assert around == pytest.approx(np.linalg.norm(e_t @ GRADIENT.T, axis=1), rel=1e-10)


def test_strain_at_the_receptors_of_an_affine_state(coarse):
    finger = coarse()
    found = receptor_strain(finger, affine(finger), depth=0.5)
    green = 0.5 * (GRADIENT.T @ GRADIENT - np.eye(2))
    e_r = finger.section.radial_directions(found.points)
    e_t = np.column_stack([-e_r[:, 1], e_r[:, 0]])
    assert found.radial == pytest.approx(np.einsum("ni,ij,nj->n", e_r, green, e_r), abs=1e-10)
    assert found.circumferential == pytest.approx(np.einsum("ni,ij,nj->n", e_t, green, e_t), abs=1e-10)
    assert found.shear == pytest.approx(np.einsum("ni,ij,nj->n", e_r, green, e_t), abs=1e-10)
    assert found.lambda_r == pytest.approx(np.sqrt(1 + 2 * found.radial))


@pytest.mark.parametrize("depth", [0.0, 0.5, 1.9])
def test_receptors_lie_at_their_depth(coarse, depth):
    """Distance to the skin, half way between two mesh lines."""
    finger = coarse()
    found = receptor_strain(finger, finger.at_rest(), depth)
    skin = finger.mesh.nodes[finger.mesh.skin_nodes]
    middle = 0.5 * (skin + np.roll(skin, -1, axis=0))
    below = np.linalg.norm(found.points - np.roll(middle, 20, axis=0), axis=1)
    assert below == pytest.approx(np.full(40, depth), abs=1e-9)
    assert (np.diff(found.position) > 0).all()
    assert abs(found.position[19] + found.position[20]) < 1e-6  # the pad's middle lies between two of them
    assert found.points[19, 0] < 0 < found.points[20, 0]
    assert np.abs(found.radial).max() < 1e-14


@pytest.mark.parametrize("depth", [-0.1, 5.0, float("nan"), "0.5", True])
def test_impossible_depths_are_refused(coarse, depth):
    finger = coarse()
    with pytest.raises(ValueError, match="between skin and bone"):
        receptor_strain(finger, finger.at_rest(), depth)


def profile(finger, seen):
    """Position [mm], pressure and shear [MPa] of the skin nodes over the half that faces the plate."""
    order = along_plate(seen.pressure)
    skin = finger.mesh.skin_nodes[order]
    return finger.mesh.nodes[skin, 0] + seen.state.displacement[skin, 0], seen.pressure[order], seen.shear[order]


def test_profiles_hold_the_contact(walked):
    finger, answer, _ = walked
    for o in answer.observations[4:]:
        x, pressure, shear = profile(finger, o)
        assert (pressure > 0).sum() == o.touching
        touching = pressure > 0
        # the edges are fitted: within half an interval of the last nodes that touch, or between them and the next
        half = 0.5 * np.diff(x).max()
        assert x[touching].min() - 3 * half <= o.edges[0] <= x[touching].min() + half
        assert x[touching].max() - half <= o.edges[1] <= x[touching].max() + 3 * half
        assert np.abs(shear[~touching]).max() == 0


def test_pressing_is_symmetric_and_its_shear_skew(walked):
    finger, answer, _ = walked
    if finger.tissue.variant == "random":
        return
    x, pressure, shear = profile(finger, answer.observations[4])
    assert np.abs(x + x[::-1]).max() < 1e-4
    assert np.abs(pressure - pressure[::-1]).max() < 1e-3 * pressure.max()
    assert np.abs(shear + shear[::-1]).max() < 1e-3 * pressure.max()


def test_fibres_hinder_the_stretch_along_them(walked):
    """As published for figure 5: tissue is stretched less along its fibres than across them."""
    finger, answer, _ = walked
    radial, around = stretches(finger, answer.last.state)
    if finger.tissue.variant == "radial":
        assert radial.max() < around.max()
    elif finger.tissue.variant == "circumferential":
        assert around.max() < radial.max()


def test_smoothing_averages_and_keeps_the_sum():
    x = np.array([-1.0, 0.0, 1.0])
    at = np.linspace(-3, 3, 241)
    found = smoothed(x, np.array([0.0, 1.0, 0.0]), at, 0.5)
    assert np.trapezoid(found, at) == pytest.approx(1.0, abs=1e-3)
    assert found.max() == pytest.approx(1 - 0.125, abs=2e-3)  # mean of a hat over half a unit about its tip
