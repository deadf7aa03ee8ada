"""Peaks and poles of sampled responses against oscillators whose peaks and poles are known in closed form."""

import numpy as np
import pytest

from rom.vibration.resonance import fit_resonance, highest_peak, peaks


def oscillator(f, f0, eta, gain=1.0):
    """Receptance of one hysteretic oscillator: gain / (f0^2 (1 + i eta) - f^2)."""
    return gain / (f0**2 * (1 + 1j * eta) - np.asarray(f, dtype=float) ** 2)


def viscous(f, f0, ratio):
    """Receptance of one oscillator with a dashpot: 1 / (f0^2 + 2 i zeta f0 f - f^2)."""
    return 1 / (f0**2 + 2j * ratio * f0 * np.asarray(f, dtype=float) - np.asarray(f, dtype=float) ** 2)


#: Samples by 1 Hz, a few uneven ones, and steps far wider than the resonance.
GRIDS = {"by 1 Hz": np.arange(1.0, 261.0), "few and uneven": np.array([40.0, 90.0, 99.0, 104.0, 170.0]),
         "by 20 Hz": np.arange(20.0, 261.0, 20.0)}

@pytest.mark.parametrize("f", [np.arange(1.0, 261.0), np.array([40.0, 110.0, 118.0, 149.0, 170.0])],
                         ids=["by 1 Hz", "few and uneven"])
def test_a_single_oscillator_is_found_exactly(f):
    # 1 / |X|^2 is a parabola in f^2: any three samples give f0 and 1 / (f0^2 eta)
    peak = highest_peak(f, oscillator(f, 122.4, 0.1))
    assert peak.frequency == pytest.approx(122.4, rel=1e-9)
    assert peak.height == pytest.approx(1 / (122.4**2 * 0.1), rel=1e-9)


@pytest.mark.parametrize("f", GRIDS.values(), ids=GRIDS.keys())
@pytest.mark.parametrize("eta", [1e-4, 1e-3, 4e-3, 1e-2, 0.1, 0.3])
@pytest.mark.parametrize("f0", [100.0, 100.3, 100.5, 100.9])
def test_the_half_power_width_gives_the_loss_factor(f, eta, f0):
    # omega^2 = omega_0^2 (1 -+ eta) at half power, and 1 / |X|^2 is a parabola between any samples; what cancels in it
    # leaves rounding over eta^2
    peak = highest_peak(f, np.abs(oscillator(f, f0, eta)))
    assert peak.lower == pytest.approx(f0 * np.sqrt(1 - eta), rel=1e-9)
    assert peak.upper == pytest.approx(f0 * np.sqrt(1 + eta), rel=1e-9)
    assert peak.loss_factor == pytest.approx(eta, rel=1e-7)


def test_two_oscillators_far_apart_are_two_peaks():
    f = np.arange(1.0, 400.0)
    response = oscillator(f, 100.0, 0.02) + oscillator(f, 300.0, 0.02, gain=3.0)
    first, second = peaks(f, response)
    # the other oscillator adds a background of about eta x 100^2 / 300^2 of the peak
    assert first.frequency == pytest.approx(100.0, rel=1e-2) and second.frequency == pytest.approx(300.0, rel=1e-2)
    assert first.height == pytest.approx(1 / (100**2 * 0.02), rel=2e-2)
    assert highest_peak(f, response) == max(first, second, key=lambda peak: peak.height)
    assert highest_peak(f, response, above=200.0) == second and highest_peak(f, response, above=310.0) is None


def test_what_rises_to_the_end_has_no_peak():
    f = np.arange(1.0, 100.0)
    assert peaks(f, oscillator(f, 150.0, 0.1)) == [] and highest_peak(f, oscillator(f, 150.0, 0.1)) is None


def test_a_missing_side_has_no_half_power_frequency():
    f = np.arange(90.0, 200.0)  # 100 sqrt(1 - .3) = 83.7 lies outside
    peak = highest_peak(f, oscillator(f, 100.0, 0.3))
    assert np.isnan(peak.lower) and np.isnan(peak.loss_factor)
    assert peak.upper == pytest.approx(100 * np.sqrt(1.3), rel=1e-9)


def test_samples_too_far_apart_still_give_a_peak_between_them():
    # 1 / |X|^2 of these would be negative at its lowest, and no height would follow
    f = np.array([50.0, 150.0, 250.0])
    (peak,) = peaks(f, [2.7e-4, 6.7e-4, 4.3e-4])
    assert 150.0 < peak.frequency < 250.0 and 6.7e-4 < peak.height < 1e-3


@pytest.mark.parametrize(("f", "x", "say"), [
    ([1, 2, 3], [1, 2], "shape"), ([1, 3, 2], [1, 2, 1], "ascend"), ([1, 2, 3], [1, np.nan, 1], "finite"),
    ([1, 2, 3], [1, 0, 1], "positive")])
def test_impossible_responses_are_refused(f, x, say):
    with pytest.raises(ValueError, match=say):
        peaks(f, x)


@pytest.mark.parametrize("f", GRIDS.values(), ids=GRIDS.keys())
@pytest.mark.parametrize("eta", [1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("kind", ["hysteretic", "viscous"])
def test_a_fit_is_exact_whatever_the_sampling(f, eta, kind):
    h = oscillator(f, 100.3, eta) if kind == "hysteretic" else viscous(f, 100.3, eta / 2)
    # what all other modes add, taken as constant; accelerances are receptances by f^2: a constant and a pole again
    for response in (h, h + (2 - 1j) / 100.3**2, -f**2 * h):
        found = fit_resonance(f, response, damping=kind)
        assert found.frequency == pytest.approx(100.3, rel=1e-9)
        assert found.loss_factor == pytest.approx(eta, rel=1e-8) and found.damping_ratio == found.loss_factor / 2
        assert found.misfit < 1e-9


@pytest.mark.parametrize("kind", ["hysteretic", "viscous"])
def test_overlapping_modes_without_noise_are_told_apart(kind):
    f = np.arange(1.0, 400.0)
    one = oscillator if kind == "hysteretic" else (lambda f, f0, eta: viscous(f, f0, eta / 2))
    response = one(f, 100.0, 0.1) + one(f, 115.0, 0.08) + 0.5 * one(f, 160.0, 0.1) - 0.2 * one(f, 700.0, 0.1)
    for f0, eta in ((100.0, 0.1), (115.0, 0.08), (160.0, 0.1)):
        found = fit_resonance(f, response, near=f0, damping=kind)
        assert found.frequency == pytest.approx(f0, rel=1e-8) and found.loss_factor == pytest.approx(eta, rel=1e-6)


def test_noise_is_borne():
    f, rng = np.arange(1.0, 261.0, 0.25), np.random.default_rng(3)
    h = oscillator(f, 100.3, 0.01)
    noise = 0.003 * np.abs(h).max() * (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)))
    found = fit_resonance(f, h + noise)
    # a standard deviation of .3 % of the peak over some twelve samples near it, half of it along each direction
    assert found.frequency == pytest.approx(100.3, abs=0.01 * 0.01 * 100.3)
    assert found.loss_factor == pytest.approx(0.01, rel=0.01)
    assert 1e-3 < found.misfit < 0.05


def test_impossible_fits_are_refused():
    f = np.arange(1.0, 261.0)
    h = oscillator(f, 100.0, 0.1)
    for response, samples, options, say in (
            (np.abs(h), f, {}, "response is real"), (h[110:], f[110:], {}, "no maximum"),
            (h, f, {"damping": "dry"}, "dry"), (h[98:101], f[98:101], {"damping": "viscous"}, "at least 4")):
        with pytest.raises(ValueError, match=say):
            fit_resonance(samples, response, **options)
