"""Strain measures against eigenvalues, textbook cases, and cycles that are sampled densely."""

import numpy as np
import pytest

from rom.fingertip import strain_measures as measures

MU, KAPPA = 27e3, 650e3


def strains(count, seed=0, parts=2):
    rng = np.random.default_rng(seed)
    values = rng.standard_normal((parts, count, 6))
    return values[0] + 1j * values[1] if parts == 2 else values[0]


def cycle(values, samples=3600):
    """The real strain at instants of one cycle: (samples, n, 6)."""
    return (values * np.exp(2j * np.pi * np.arange(samples) / samples)[:, None, None]).real


def test_principal_strains_are_the_eigenvalues():
    values = strains(2000, parts=1)
    expected = np.linalg.eigvalsh(measures.tensor(values))[:, ::-1]
    np.testing.assert_allclose(measures.principal_strains(values), expected, atol=1e-12)


@pytest.mark.parametrize("given", [[0, 0, 0, 0, 0, 0], [2, 2, 2, 0, 0, 0], [1, 1, -2, 0, 0, 0], [2, -1, -1, 0, 0, 0],
                                   [1e-9, 0, 0, 3e-9, 0, 0], [5e20, 0, 0, 0, 0, 0]])
def test_principal_strains_of_special_tensors(given):
    # equal ones, where the formula loses half of its digits; tiny and huge ones
    expected = np.linalg.eigvalsh(measures.tensor(given))[::-1]
    np.testing.assert_allclose(measures.principal_strains(given), expected, atol=3e-8 * np.abs(given).max())


def test_engineering_shear_is_twice_the_tensor_component():
    # simple shear gamma: principal strains gamma / 2, 0, -gamma / 2
    np.testing.assert_allclose(measures.principal_strains([0, 0, 0, 0, 0.2, 0]), [0.1, 0, -0.1], atol=1e-12)


def test_energy_and_equivalent_strain_of_the_uniaxial_test():
    # stress E eps along x alone: density E eps^2 / 2; von Mises strain 2/3 (1 + nu) eps
    young, ratio, strain = 8e4, 0.45, 0.03
    mu, kappa = young / (2 * (1 + ratio)), young / (3 * (1 - 2 * ratio))
    values = strain * np.array([1, -ratio, -ratio, 0, 0, 0])
    assert measures.energy_density(values, mu, kappa) == pytest.approx(young * strain**2 / 2)
    assert measures.equivalent_strain(values) == pytest.approx(2 / 3 * (1 + ratio) * strain)


def test_peaks_over_the_cycle_are_those_of_a_sampled_cycle():
    values = strains(300)
    instants = cycle(values)
    energy = measures.energy_density(instants, MU, KAPPA)
    np.testing.assert_allclose(measures.energy_density(values, MU, KAPPA), energy.max(axis=0), rtol=2e-6)
    np.testing.assert_allclose(measures.mean_energy_density(values, MU, KAPPA), energy.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(measures.equivalent_strain(values),
                               measures.equivalent_strain(instants).max(axis=0), rtol=2e-6)


def test_the_instant_of_peak_energy_has_that_energy_and_the_larger_tension():
    values = strains(300)
    snapshot = measures.strain_at_peak(values, MU, KAPPA)
    np.testing.assert_allclose(measures.energy_density(snapshot, MU, KAPPA),
                               measures.energy_density(values, MU, KAPPA), rtol=1e-12)
    principal = measures.principal_strains(snapshot)
    assert (principal[:, 0] >= -principal[:, 2]).all()
    # it is an instant of the cycle: no phase but its own gives it
    gap = np.abs(cycle(values) - snapshot).max(axis=2).min(axis=0)
    assert gap.max() < 2 * np.pi / 3600 * np.abs(values).max()


def test_components_in_phase_have_their_largest_principal_strain_at_that_instant():
    line = strains(200, parts=1) * np.exp(0.7j)
    at_peak = measures.principal_strains(measures.strain_at_peak(line, MU, KAPPA))[:, 0]
    np.testing.assert_allclose(at_peak, measures.principal_strains(cycle(line))[..., 0].max(axis=0), rtol=2e-6)


def test_the_largest_principal_strain_of_the_cycle_is_bounded_as_said():
    values = strains(200)
    exact = measures.principal_strains(cycle(values))[..., 0].max(axis=0)
    for samples in (5, 90):
        found = measures.largest_principal_over_cycle(values, samples)
        assert (found <= exact * (1 + 1e-6)).all()
        assert (found >= exact * np.cos(np.pi / (2 * samples))).all()
    at_peak = measures.principal_strains(measures.strain_at_peak(values, MU, KAPPA))[:, 0]
    assert (at_peak <= exact * (1 + 1e-6)).all()


def test_moduli_differ_by_point_and_batches_broadcast():
    values = strains(12).reshape(3, 4, 6)
    mu, kappa = np.array([1.0, 2.0, 3.0, 4.0]), np.array([5.0, 6.0, 7.0, 8.0])
    for measure in (measures.energy_density, measures.mean_energy_density):
        one = [[measure(values[i, j], mu[j], kappa[j]) for j in range(4)] for i in range(3)]
        np.testing.assert_allclose(measure(values, mu, kappa), one)
    assert measures.strain_at_peak(values, mu, kappa).shape == (3, 4, 6)


def test_bad_strains_are_refused():
    with pytest.raises(ValueError, match="belong to one instant"):
        measures.principal_strains(strains(2))
    with pytest.raises(ValueError, match="six components"):
        measures.energy_density(np.zeros((3, 3)), MU, KAPPA)
