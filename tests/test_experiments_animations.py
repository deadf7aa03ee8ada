"""The animations' experiment, coarse and quick: what it says of phases is what waves do."""

import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import animations

from rom.reporting.experiment import write_experiment


@pytest.fixture(scope="module")
def results(small_tip):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(animations.script, "fingertip", lambda *_: small_tip)
        patch.setattr(animations, "FREQUENCY", (50.0, 250.0))
        return animations.main(quick=True)


def test_a_standing_wave_is_in_phase_and_a_travelling_one_half_out_of_it():
    x = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    u = np.zeros((400, 3), dtype=complex)
    u[:, 2] = np.cos(x) * np.exp(0.3j)
    assert animations.out_of_phase(u) == pytest.approx(0, abs=1e-12)
    u[:, 2] = np.exp(-1j * x)  # Re(exp(i (omega t - x))): every phase equally often
    assert animations.out_of_phase(u) == pytest.approx(0.5)


def test_modes_lie_below_the_limit_in_order(results):
    frequency = results["natural_frequency"].values
    assert (np.diff(frequency) > 0).all() and frequency[0] > 0 and frequency[-1] < animations.BELOW_HZ


def test_motion_far_below_resonance_is_in_phase(results):
    # quasi-statics: u = K^-1 f / (1 + i eta) to within (f / f1)^2, one phase for all nodes
    share = results["out_of_phase"]
    assert (share.sel(frequency=50.0) < 1e-3).all()
    assert (share >= 0).all() and (share <= 0.5).all()


def test_the_folder_holds_animations_and_a_scene(results, tmp_path):
    files = animations.extra(results, tmp_path)
    figures = animations.draw(results)
    page = write_experiment(tmp_path, "animations", "How?", animations.findings(results), figures, (), files,
                            {"quick": "1"})
    text = page.read_text(encoding="utf-8")
    for file in ("free-modes.gif", "forced-vibrations.gif", "half-a-cycle.png", animations.SCENE_FILE):
        assert f'"{file}"' in text
        assert 10_000 < (tmp_path / file).stat().st_size < 6e6
    with Image.open(tmp_path / "forced-vibrations.gif") as image:
        assert image.n_frames == 20
