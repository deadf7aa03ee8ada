"""Peaks of sampled responses against oscillators whose peaks are known in closed form."""

import numpy as np
import pytest

from rom.vibration.resonance import highest_peak, peaks


def oscillator(f, f0, eta, gain=1.0):
    """Receptance of one hysteretic oscillator: gain / (f0^2 (1 + i eta) - f^2)."""
    return gain / (f0**2 * (1 + 1j * eta) - np.asarray(f, dtype=float) ** 2)


@pytest.mark.parametrize("f", [np.arange(1.0, 261.0), np.array([40.0, 110.0, 118.0, 149.0, 170.0])],
                         ids=["by 1 Hz", "few and uneven"])
def test_a_single_oscillator_is_found_exactly(f):
    # 1 / |X|^2 is a parabola in f^2: any three samples give f0 and 1 / (f0^2 eta)
    peak = highest_peak(f, oscillator(f, 122.4, 0.1))
    assert peak.frequency == pytest.approx(122.4, rel=1e-9)
    assert peak.height == pytest.approx(1 / (122.4**2 * 0.1), rel=1e-9)


@pytest.mark.parametrize("eta", [0.05, 0.1, 0.3])
def test_the_half_power_width_gives_the_loss_factor(eta):
    f = np.arange(1.0, 261.0)
    peak = highest_peak(f, np.abs(oscillator(f, 163.7, eta)))
    # omega^2 = omega_0^2 (1 -+ eta) at half power; linear interpolation between samples 1 Hz apart costs below 1 %
    assert peak.lower == pytest.approx(163.7 * np.sqrt(1 - eta), rel=1e-3)
    assert peak.upper == pytest.approx(163.7 * np.sqrt(1 + eta), rel=1e-3)
    assert peak.loss_factor == pytest.approx(eta, rel=1e-2)


def test_two_oscillators_far_apart_are_two_peaks():
    f = np.arange(1.0, 400.0)
    response = oscillator(f, 100.0, 0.02) + oscillator(f, 300.0, 0.02, gain=3.0)
    first, second = peaks(f, response)
    # the other oscillator adds a background of about eta x 100^2 / 300^2 of the peak
    assert first.frequency == pytest.approx(100.0, rel=1e-2) and second.frequency == pytest.approx(300.0, rel=1e-2)
    assert first.height == pytest.approx(1 / (100**2 * 0.02), rel=2e-2)
    assert highest_peak(f, response) == max(first, second, key=lambda peak: peak.height)


def test_what_rises_to_the_end_has_no_peak():
    f = np.arange(1.0, 100.0)
    assert peaks(f, oscillator(f, 150.0, 0.1)) == [] and highest_peak(f, oscillator(f, 150.0, 0.1)) is None


def test_a_missing_side_has_no_half_power_frequency():
    f = np.arange(90.0, 200.0)  # 100 sqrt(1 - .3) = 83.7 lies outside
    peak = highest_peak(f, oscillator(f, 100.0, 0.3))
    assert np.isnan(peak.lower) and np.isnan(peak.loss_factor)
    assert peak.upper == pytest.approx(100 * np.sqrt(1.3), rel=1e-3)


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
