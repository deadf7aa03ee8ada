"""The kernel against finite differences, rotations, its own energy and its uncompiled self."""

import numpy as np
import pytest

from rom.finger_on_glass.element import element_response, shape_gradients
from rom.finger_on_glass.tissue import FIBRE_CAP

CORNERS = np.array([[[0.0, 0.0], [1.1, 0.1], [1.2, 1.0], [-0.1, 0.9]]])
C, K1, K2 = 0.003, 0.15, 15.0
PRESSURE = -0.02


def evaluate(displacement, stretch_z, fibres, kernel=element_response):
    gradients, weights = shape_gradients(CORNERS)
    room = [np.empty((1, 9, 9)), np.empty((1, 9)), np.empty((1, 9)), np.empty(1), np.empty(1), np.empty(1)]
    usable = kernel(gradients, weights, fibres, displacement, stretch_z, np.array([PRESSURE]), C, K1, K2, *room)
    return usable, *room


def families(n, seed=1):
    angle = np.random.default_rng(seed).uniform(0, np.pi, (1, 4, n))
    return np.ascontiguousarray(np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def total_energy(x, fibres):
    _, _, _, _, dilatation, energy, _ = evaluate(x[None, :8], x[8], fibres)
    return energy[0] + PRESSURE * dilatation[0] * shape_gradients(CORNERS)[1].sum()


def forces(x, fibres):
    _, _, force, volume, _, _, _ = evaluate(x[None, :8], x[8], fibres)
    return force[0] + PRESSURE * volume[0]


@pytest.mark.parametrize("n_families", [1, 3])
@pytest.mark.parametrize(("size", "stretched"), [(0.05, 0.0), (0.15, 0.0), (0.05, 0.8)])
def test_force_and_tangent_are_derivatives(n_families, size, stretched):
    """Central differences; a stretch of 1.8 takes fibres beyond the cap, where the energy goes on quadratically."""
    moved = CORNERS[0] * [stretched, 0.0] + size * np.random.default_rng(2).standard_normal((4, 2))
    x = np.append(moved.ravel(), 1.0 + 0.2 * size)
    fibres = families(n_families)
    usable, tangent, *_, largest = evaluate(x[None, :8], x[8], fibres)
    assert usable
    assert (largest[0] > FIBRE_CAP) == (stretched > 0)
    h = 1e-6
    force, stiffness = forces(x, fibres), np.empty((9, 9))
    slope = np.empty(9)
    for i, step in enumerate(h * np.eye(9)):
        slope[i] = (total_energy(x + step, fibres) - total_energy(x - step, fibres)) / (2 * h)
        stiffness[:, i] = (forces(x + step, fibres) - forces(x - step, fibres)) / (2 * h)
    assert np.abs(slope - force).max() < 1e-6 * np.abs(force).max()
    assert np.abs(stiffness - tangent[0]).max() < 1e-6 * np.abs(tangent).max()
    assert np.array_equal(tangent[0], tangent[0].T)


def test_volume_force_is_the_derivative_of_the_volume():
    x = np.append(0.2 * np.random.default_rng(5).standard_normal(8), 1.05)
    fibres, h = families(1), 1e-6
    volume = shape_gradients(CORNERS)[1].sum()
    _, _, _, exact, *_ = evaluate(x[None, :8], x[8], fibres)
    for i, step in enumerate(h * np.eye(9)):
        ahead, behind = (evaluate(y[None, :8], y[8], fibres)[4][0] for y in (x + step, x - step))
        assert volume * (ahead - behind) / (2 * h) == pytest.approx(exact[0, i], abs=1e-8)


def test_rotated_states_answer_with_rotated_forces():
    """Objectivity: x -> Q x leaves the energy and turns the forces."""
    x = np.append(0.08 * np.random.default_rng(6).standard_normal(8), 1.1)
    fibres = families(3)
    for angle in (0.3, 1.7, np.pi):
        q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turned = ((CORNERS[0] + x[:8].reshape(4, 2)) @ q.T - CORNERS[0]).ravel()
        y = np.append(turned, x[8])
        assert total_energy(y, fibres) == pytest.approx(total_energy(x, fibres), rel=1e-12)
        expected = np.append((forces(x, fibres)[:8].reshape(4, 2) @ q.T).ravel(), forces(x, fibres)[8])
        assert np.abs(forces(y, fibres) - expected).max() < 1e-12 * np.abs(expected).max()


def test_rigid_motion_costs_nothing():
    fibres = families(3)
    q = np.array([[0.0, -1.0], [1.0, 0.0]])
    moved = (CORNERS[0] @ q.T + [3.0, -2.0] - CORNERS[0]).reshape(1, 8)
    _, _, force, _, dilatation, energy, largest = evaluate(moved, 1.0, fibres)
    assert abs(energy[0]) < 1e-16
    assert abs(dilatation[0]) < 1e-14
    assert abs(largest[0]) < 1e-14
    assert np.abs(force).max() < 1e-16


def test_energy_of_a_homogeneous_state():
    """By hand: F = diag(a, b), lambda_z = s, one family along x; W times the area."""
    a, b, s = 1.2, 0.9, 0.95
    j = a * b * s
    i1, i4 = j ** (-2 / 3) * (a * a + b * b + s * s), j ** (-2 / 3) * a * a
    w = C * (i1 - 3) + K1 / (2 * K2) * (np.exp(K2 * (i4 - 1) ** 2) - 1)
    fibres = np.zeros((1, 4, 1, 2))
    fibres[..., 0] = 1
    moved = (CORNERS[0] * [a - 1, b - 1]).reshape(1, 8)
    _, _, _, _, dilatation, energy, largest = evaluate(moved, s, fibres)
    assert energy[0] == pytest.approx(w * shape_gradients(CORNERS)[1].sum(), rel=1e-12)
    assert dilatation[0] == pytest.approx(j - 1, rel=1e-12)
    assert largest[0] == pytest.approx(i4 - 1, rel=1e-12)


def test_fibres_carry_no_compression():
    fibres = np.zeros((1, 4, 1, 2))
    fibres[..., 0] = 1
    moved = (CORNERS[0] * [-0.1, 0.0]).reshape(1, 8)
    with_fibres = evaluate(moved, 1 / 0.9, fibres)
    without = evaluate(moved, 1 / 0.9, fibres[:, :, :0])
    assert np.array_equal(with_fibres[1], without[1])
    assert np.array_equal(with_fibres[2], without[2])


def test_inverted_points_are_unusable():
    assert not evaluate((CORNERS[0] * [-1.5, 0.0]).reshape(1, 8), 1.0, families(1))[0]


def test_compiled_kernel_is_the_written_one():
    """The same numbers with and without the compiler, up to the order of its sums."""
    x = np.append(0.2 * np.random.default_rng(7).standard_normal(8), 1.1)
    compiled = evaluate(x[None, :8], x[8], families(3))
    written = evaluate(x[None, :8], x[8], families(3), element_response.py_func)
    assert element_response.signatures
    for one, other in zip(compiled[1:], written[1:], strict=True):
        assert np.allclose(one, other, rtol=1e-12, atol=1e-15)
