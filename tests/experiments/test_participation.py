"""Shares of modes against the orthogonality that makes them shares, and against dense algebra."""

import numpy as np
import pytest
from analysis.participation import coordinates, energy_shares, participation, static_shares

from rom.metamodels import create
from rom.scenes import CaseArrays, get_scene

ETA = 0.1


@pytest.fixture(scope="module")
def scene(tiny_tip):
    return get_scene("harmonic-patch-forces", tiny_tip)


@pytest.fixture(scope="module")
def modes(scene):
    return scene.model.natural_modes(count=10)


@pytest.fixture(scope="module")
def answers(scene):
    cases = CaseArrays(np.tile(np.arange(3), 2)[:, None], np.ones((6, 1)), np.repeat([80.0, 210.0], 3), np.full(6, ETA))
    return create("direct", scene).fit().evaluate(cases)


def test_a_mode_carries_all_of_itself(scene, modes):
    shares = energy_shares(scene.model, modes, modes.shape.T * (1 + 2j))
    np.testing.assert_allclose(shares.strain, np.eye(10), atol=1e-8)  # orthonormality in K and M
    np.testing.assert_allclose(shares.kinetic, np.eye(10), atol=1e-8)
    np.testing.assert_allclose(shares.strain_residual, 0.0, atol=1e-8)


def test_all_modes_together_leave_nothing(scene):
    # 684 free dofs: the dense eigenproblem gives every mode, and the shares sum to one
    from scipy.linalg import eigh

    model = scene.model
    value, shape = eigh(model.stiffness.toarray(), model.mass.toarray())
    load = scene.unit_loads
    energy = ((shape.T @ load) ** 2 / value[:, None]).T
    energy /= energy.sum(axis=1, keepdims=True)
    share, residual = static_shares(model, model.natural_modes(count=10), load)
    np.testing.assert_allclose(share, energy[:, :10], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(residual, energy[:, 10:].sum(axis=1), rtol=1e-6)


def test_static_shares_are_those_of_the_static_field(scene, modes):
    field = scene.model.solve_static(scene.unit_loads).T
    shares = energy_shares(scene.model, modes, field)
    share, residual = static_shares(scene.model, modes, scene.unit_loads)
    np.testing.assert_allclose(shares.strain, share, atol=1e-9)
    np.testing.assert_allclose(shares.strain_residual, residual, atol=1e-9)


def test_coordinates_are_projections_of_the_direct_answer(scene, modes, answers):
    # phi_k^T M Z^-1 f = phi_k^T f / (lambda_k (1 + i eta) - omega^2), exact for structural damping
    found = coordinates(modes, scene.unit_loads, [80.0, 210.0], ETA).transpose(1, 0, 2).reshape(6, -1)
    expected = answers @ (scene.model.mass @ modes.shape)
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_the_residual_is_the_energy_of_what_is_left(scene, modes, answers):
    model = scene.model
    shares = energy_shares(model, modes, answers)
    left = answers - (answers @ (model.mass @ modes.shape)) @ modes.shape.T
    for matrix, residual in ((model.stiffness, shares.strain_residual), (model.mass, shares.kinetic_residual)):
        energy = [np.vdot(u, matrix @ u).real for u in left], [np.vdot(u, matrix @ u).real for u in answers]
        np.testing.assert_allclose(residual, np.divide(*energy), atol=1e-9)
    assert ((shares.strain >= 0) & (shares.strain <= 1)).all() and (shares.strain_residual > 0).all()


def test_mirror_symmetry_decides_which_modes_a_load_can_drive(scene, modes):
    # loads at the mid-plane are symmetric (normal, distal-proximal) or antisymmetric: each mode takes one kind only
    driven = np.abs(participation(modes, scene.unit_loads))
    symmetric, antisymmetric = np.maximum(driven[0], driven[2]), driven[1]
    smaller, larger = np.minimum(symmetric, antisymmetric), np.maximum(symmetric, antisymmetric)
    assert (smaller < 1e-6 * larger.max()).all()


def test_what_does_not_fit_is_refused(scene, modes):
    with pytest.raises(ValueError, match="free dofs alone"):
        energy_shares(scene.model, modes, np.ones((2, 5)))
    with pytest.raises(ValueError, match="case 1 does not move"):
        energy_shares(scene.model, modes, np.stack([modes.shape[:, 0], 0 * modes.shape[:, 0]]))
