"""Ellipses, standing and travelling motion, against motions sampled over a cycle."""

import numpy as np
import pytest
from analysis.motion import at_largest_motion, ellipse_axes, travelling_index

TIME = np.exp(2j * np.pi * np.arange(3600) / 3600)


def test_the_axes_are_the_extremes_of_a_sampled_cycle():
    rng = np.random.default_rng(0)
    u = rng.normal(size=(20, 3)) + 1j * rng.normal(size=(20, 3))
    distance = np.linalg.norm((u[:, None] * TIME[:, None]).real, axis=2)
    major, minor = ellipse_axes(u)
    # extremes over 3,600 instants; between two of them the distance changes by 1e-6 of itself
    np.testing.assert_allclose(major, distance.max(axis=1), rtol=2e-6)
    np.testing.assert_allclose(minor, distance.min(axis=1), rtol=1e-3)


def test_a_circle_and_a_line():
    major, minor = ellipse_axes(np.array([[1.0, 1j, 0.0], [3.0, 4.0, 0.0]]))
    np.testing.assert_allclose(major, [1.0, 5.0])  # by hand
    np.testing.assert_allclose(minor, [1.0, 0.0], atol=1e-15)


def test_waves():
    x = np.arange(64) * 2 * np.pi / 64
    standing, travelling = np.cos(x) * np.exp(0.4j), np.exp(-1j * x)
    np.testing.assert_allclose(travelling_index(np.stack([standing, travelling, 0 * x])), [0.0, 1.0, 0.0], atol=1e-7)
    # a wave e^(-ix) and its echo a e^(ix): the ratio is (1 - a) / (1 + a), the inverse of the standing-wave ratio
    echo = travelling[None] + np.array([[0.2], [0.5]]) * np.exp(1j * x)
    np.testing.assert_allclose(travelling_index(echo), [0.8 / 1.2, 0.5 / 1.5], rtol=1e-12)


@pytest.mark.parametrize("phase", [0.3, 2.0, -1.1])
def test_nothing_depends_on_where_time_starts(phase):
    rng = np.random.default_rng(1)
    field = rng.normal(size=(4, 5, 3)) + 1j * rng.normal(size=(4, 5, 3))
    turned = field * np.exp(1j * phase)
    np.testing.assert_allclose(travelling_index(turned.reshape(4, -1)), travelling_index(field.reshape(4, -1)))
    for found, expected in zip(ellipse_axes(turned), ellipse_axes(field), strict=True):
        np.testing.assert_allclose(found, expected)
    # the instant of largest motion is the same up to half a cycle
    ratio = at_largest_motion(turned) / at_largest_motion(field)
    np.testing.assert_allclose(np.abs(ratio), 1.0)
    norm = np.linalg.norm((field[..., None] * TIME).real.reshape(4, -1, len(TIME)), axis=1).max(axis=1)
    np.testing.assert_allclose(np.linalg.norm(at_largest_motion(field).reshape(4, -1), axis=1), norm, rtol=2e-6)
