"""Pairs of modes: a shuffled set finds itself, other meshes and boundaries find the same shapes."""

from dataclasses import replace

import numpy as np
import pytest
from analysis.mode_pairing import on_common_dofs, on_mesh, pair_modes

from rom.fingertip import MeshDensity
from rom.fullorder import natural_modes
from rom.vibration.parity import parity


@pytest.fixture(scope="module")
def free(small_tip):
    return natural_modes(small_tip.stiffness, small_tip.mass, count=8).shape


def test_a_shuffled_set_finds_itself(small_tip, free):
    order = np.array([3, 0, 7, 5, 1, 6, 2, 4])
    pairing = pair_modes(free, -2 * free[:, order], small_tip.mass)
    assert np.array_equal(order[pairing.partner], np.arange(8))
    assert np.allclose(pairing.mac, 1) and np.allclose(pairing.table[0, 1], 1)


def test_the_assignment_is_the_best_of_all():
    # by hand: taking the largest MAC first (.9) would leave 0; the best sum is .8 + .8
    target = np.sqrt(np.array([[0.9, 0.8], [0.8, 0.0]]))
    other = np.vstack([target, np.sqrt(1 - (target**2).sum(axis=0).clip(max=1))])
    pairing = pair_modes(np.eye(3)[:, :2], other / np.linalg.norm(other, axis=0), None)
    assert list(pairing.partner) == [1, 0]
    greedy = pair_modes(np.eye(3)[:, :2], other / np.linalg.norm(other, axis=0), None, first=1)
    assert list(greedy.partner) == list(np.argsort(-greedy.table[0]))


def test_parity_keeps_modes_apart(small_tip, free):
    names = parity(small_tip.mesh, small_tip.free_dofs, small_tip.mass, free)
    noisy = free + 0.3 * np.random.default_rng(0).standard_normal(free.shape) * np.abs(free).max()
    pairing = pair_modes(free, noisy, small_tip.mass, parity=names, other_parity=names)
    assert np.array_equal(names[pairing.partner], names)


def test_too_few_to_choose_from(small_tip, free):
    with pytest.raises(ValueError, match="at least 8"):
        pair_modes(free, free[:, :5], small_tip.mass)


def test_rear_held_or_not(small_tip, free):
    held = replace(small_tip, rear="fixed")
    fixed = natural_modes(held.stiffness, held.mass, count=8)
    pairing = pair_modes(on_common_dofs(small_tip, free, held), fixed.shape, held.mass)
    assert pairing.partner[0] == 0 and pairing.mac[0] > 0.5
    with pytest.raises(ValueError, match="exchange"):
        on_common_dofs(held, fixed.shape, small_tip)


@pytest.mark.parametrize("factor", [1.5, 0.5])
def test_another_density_finds_the_first_modes(small_tip, free, factor):
    density = MeshDensity((6, 6), 3, 3, (1, 1, 1, 2)) if factor > 1 else MeshDensity((2, 2), 2, 2, (1, 1, 1, 1))
    other = replace(small_tip, density=density)
    shape = natural_modes(other.stiffness, other.mass, count=8).shape
    pairing = pair_modes(on_mesh(other.mesh, other.free_dofs, shape, small_tip)[:, :3], free, small_tip.mass)
    assert pairing.partner[0] == 0 and pairing.mac[0] > 0.8


def test_interpolation_on_the_same_mesh_changes_nothing(small_tip, free):
    assert np.allclose(on_mesh(small_tip.mesh, small_tip.free_dofs, free, small_tip), free)
