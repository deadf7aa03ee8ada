"""Sums of poles against the equations that they solve."""

import numpy as np
import scipy.linalg as sla

from rom.fullorder.poles import Poles, operating_points


def test_operating_points_are_columns():
    stiffness, inertia = operating_points(np.array([1.0, 2.0]), 0.1)
    np.testing.assert_array_equal(stiffness, [[1 + 0.1j]])
    np.testing.assert_array_equal(inertia, [[(2 * np.pi) ** 2], [(4 * np.pi) ** 2]])


def test_modes_and_vectors_solve_the_diagonal_equation(rng):
    # all shapes of a pencil are its exact solution, mass- or stiffness-orthonormal alike
    root = rng.standard_normal((6, 6))
    k, m, f = root @ root.T + np.eye(6), np.diag(rng.uniform(1, 2, 6)), rng.standard_normal(6)
    point = operating_points(np.array([0.1, 0.3]), np.array([0.2, 0.05]))
    eigenvalue, shape = sla.eigh(k, m)
    theta, vector = sla.eigh(m, k)
    expected = [np.linalg.solve(c * k - w * m, f) for (c,), (w,) in zip(*point, strict=True)]
    np.testing.assert_allclose(Poles.of_modes(eigenvalue).at(f @ shape, *point) @ shape.T, expected, rtol=1e-10)
    np.testing.assert_allclose(Poles.of_vectors(theta).at(f @ vector, *point) @ vector.T, expected, rtol=1e-10)
    many = Poles.of_vectors(np.stack([theta, 2 * theta]))
    np.testing.assert_array_equal(many[1].at(1.0, *point), Poles.of_vectors(2 * theta).at(1.0, *point))
