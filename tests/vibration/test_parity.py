"""Parity against synthetic fields and exactly degenerate pairs."""

from dataclasses import replace

import numpy as np
import pytest

from rom.errors import SolverError
from rom.fullorder import natural_modes
from rom.vibration.parity import parity, pure_parity, reflected, symmetric_share

COUNT = 8


@pytest.fixture(scope="module")
def modes(tiny_tip):
    return natural_modes(tiny_tip.stiffness, tiny_tip.mass, count=COUNT)


@pytest.fixture(scope="module")
def body(tiny_tip):
    return tiny_tip.mesh, tiny_tip.free_dofs


def field(tip, function):
    """A displacement field given by coordinates, on the free dofs."""
    return np.stack(function(*tip.mesh.nodes.T), axis=1).ravel()[tip.free_dofs]


def test_fields_of_known_parity(tiny_tip, body):
    # by hand: y -> -y keeps u_x and u_z of even functions of y, and u_y of odd ones
    even = field(tiny_tip, lambda x, y, z: (x + y**2, y * z, np.cos(y)))
    odd = field(tiny_tip, lambda x, y, z: (y, x * z, np.sin(y) * x))
    both = np.stack([even, odd], axis=1)
    assert np.allclose(reflected(*body, both), both * [1, -1], rtol=1e-12)
    assert np.allclose(symmetric_share(*body, tiny_tip.mass, both), [1, 0], atol=1e-14)


def test_reflection_is_an_involution_that_keeps_energy(tiny_tip, body):
    u = np.random.default_rng(0).standard_normal(len(tiny_tip.free_dofs))
    image = reflected(*body, u)
    assert np.array_equal(reflected(*body, image), u)
    for matrix in (tiny_tip.stiffness, tiny_tip.mass):
        assert image @ (matrix @ image) == pytest.approx(u @ (matrix @ u), rel=1e-12)


def test_modes_of_a_symmetric_body_are_pure(tiny_tip, body, modes):
    share = symmetric_share(*body, tiny_tip.mass, modes.shape)
    assert np.all(np.minimum(share, 1 - share) < 1e-10)  # theory: R commutes with K and M
    assert set(parity(*body, tiny_tip.mass, modes.shape)) == {"symmetric", "antisymmetric"}


def test_a_mixed_pair_comes_apart(tiny_tip, body, modes):
    names = parity(*body, tiny_tip.mass, modes.shape)
    i = int(np.flatnonzero(names[1:] != names[:-1])[0])
    angle = 0.6
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shape = modes.shape.copy()
    shape[:, i : i + 2] = shape[:, i : i + 2] @ turn
    assert list(parity(*body, tiny_tip.mass, shape)[i : i + 2]) == ["mixed", "mixed"]
    mixed = replace(modes, shape=shape)

    pure = pure_parity(mixed, *body, tiny_tip.stiffness, tiny_tip.mass)
    assert list(parity(*body, tiny_tip.mass, pure.shape)) == list(names)
    assert np.allclose(pure.eigenvalue, modes.eigenvalue, rtol=1e-10)  # the modes before they were mixed
    for matrix, expected in ((tiny_tip.mass, np.eye(COUNT)), (tiny_tip.stiffness, np.diag(pure.eigenvalue))):
        gram = pure.shape.T @ (matrix @ pure.shape)
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.max(np.abs(gram - expected) / scale) < 1e-10  # orthogonality survives, up to rounding in K
    assert pure.residual.max() < 1e-8

    half = replace(mixed, eigenvalue=modes.eigenvalue[: i + 1], shape=shape[:, : i + 1])
    with pytest.raises(SolverError, match="one mode more or less"):
        pure_parity(half, *body, tiny_tip.stiffness, tiny_tip.mass)


def test_pure_modes_stay_what_they_are(tiny_tip, body, modes):
    pure = pure_parity(modes, *body, tiny_tip.stiffness, tiny_tip.mass)
    overlap = np.sum(pure.shape * (tiny_tip.mass @ modes.shape), axis=0)
    assert np.allclose(overlap, 1, atol=1e-8)  # sign included
    again = pure_parity(pure, *body, tiny_tip.stiffness, tiny_tip.mass)
    assert np.allclose(again.eigenvalue, pure.eigenvalue, rtol=1e-10)
