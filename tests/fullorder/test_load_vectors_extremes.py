"""Load-dependent vectors where a Krylov space ends, where a load lies in the modes' span, and for loads of any size."""

import numpy as np
import pytest
import scipy.sparse as sp

from rom.fullorder import SecondOrderModel
from rom.fullorder.load_vectors import load_vectors
from tests.fullorder.conftest import Rod


def answers(model, modes, found, loads, frequency, loss_factor):
    """Galerkin on modes and vectors, (n, n_load)."""
    stiffness, inertia = 1 + 1j * loss_factor, (2 * np.pi * frequency) ** 2
    modal = (modes.shape.T @ loads).T / (modes.eigenvalue * stiffness - inertia)
    own = found.first / (stiffness - inertia * found.theta)
    return (modal @ modes.shape.T + np.einsum("lp,lpn->ln", own, found.vectors)).T


@pytest.fixture
def rod_loads():
    body = Rod(60)
    model = SecondOrderModel(body.stiffness, body.mass)
    point = np.eye(60)[3]
    loads = np.column_stack([
        point, np.ones(60), body.mass @ body.shape[:, 0], body.mass @ body.shape[:, -1], 0 * point,
        point + 1e-14 * np.eye(60)[4], 1e-200 * point, 1e160 * point])
    return body, model, loads


@pytest.mark.parametrize(("modes", "vectors"), [(1, 30), (3, 57), (3, 80), (59, 3), (60, 2)])
def test_exhausted_spaces_stay_orthonormal_and_exact(rod_loads, modes, vectors):
    """With as many vectors as dimensions Galerkin is exact; noise must not pass for more of them."""
    body, model, loads = rod_loads
    kept = model.natural_modes(modes)
    found = load_vectors(model, kept, loads, vectors)
    for vector in found.vectors:
        gram = vector @ (body.stiffness @ vector.T)
        np.testing.assert_allclose(gram @ gram, gram, atol=1e-12)  # the identity on what is there, else zero
    assert np.max(np.abs(np.einsum("lpn,nm->lpm", found.vectors, body.mass @ kept.shape))) < 1e-12  # a whole mode: 3e-3
    for frequency, loss_factor in ((1.1 * body.frequency_hz[1], 0.1), ((1 + 1e-5) * body.frequency_hz[0], 1e-6)):
        unit = np.where(loads.any(axis=0), np.abs(loads).max(axis=0), 1.0)
        exact = model.solve_harmonic(loads / unit, frequency, loss_factor)
        error = np.linalg.norm(answers(model, kept, found, loads, frequency, loss_factor) / unit - exact, axis=0)
        # a load in the span of one mode, answered next to another: rounding times the resonance's amplification
        assert np.all(error <= 1e-7 * np.linalg.norm(exact, axis=0))


def test_a_load_in_the_span_of_the_modes_has_no_vectors(rod_loads):
    _, model, loads = rod_loads
    found = load_vectors(model, model.natural_modes(3), loads[:, 2:3], 5)
    assert not found.vectors.any() and not found.first.any() and not found.beta.any()


@pytest.mark.parametrize("gap", [0.0, 1e-14, 1e-8])
@pytest.mark.parametrize("modes", [5, 6])
def test_nearly_equal_modes(tiny_tip, gap, modes):
    """Two bodies whose eigenvalues differ by a factor 1 + gap; five modes cut the third pair."""
    stiffness = sp.block_diag([tiny_tip.stiffness, (1 + gap) * tiny_tip.stiffness], format="csc")
    model = SecondOrderModel(stiffness, sp.block_diag([tiny_tip.mass] * 2, format="csc"))
    force = tiny_tip.normal_force(0)
    loads = np.column_stack([np.concatenate([force, 0.3 * force[::-1]]), np.concatenate([force, -force])])
    kept = model.natural_modes(modes)
    assert kept.sturm_count == 6
    found = load_vectors(model, kept, loads, 20)
    frequency = kept.frequency_hz[2] + 1e-3
    exact = model.solve_harmonic(loads, frequency, 1e-6)
    error = answers(model, kept, found, loads, frequency, 1e-6) - exact
    assert np.all(np.linalg.norm(error, axis=0) < 1e-7 * np.linalg.norm(exact, axis=0))
