"""Sensitivity and tissue loss factors, coarse and quick: theory, re-solved models and direct solutions agree."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import script
import sensitivity
import tissue_loss_factors
from sensitivity_figures import off_similarity

from rom.datasets.storage import read_netcdf, write_netcdf
from rom.reporting.experiment import write_experiment

SCRIPTS = {"sensitivity": sensitivity, "tissue-loss-factors": tissue_loss_factors}


@pytest.fixture(scope="module")
def results(small_tip, tmp_path_factory):
    """On a still coarser mesh, with fewer re-solved models; as they come back from their files."""
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(script, "fingertip", lambda *_: small_tip)
        patch.setattr(sensitivity, "ONE_BY_ONE", ("fingertip_height",))
        patch.setattr(sensitivity, "DIRECTIONS_CHECKED", 1)
        for name, experiment in SCRIPTS.items():
            path = tmp_path_factory.mktemp("results") / f"{name}.nc"
            write_netcdf(experiment.main(quick=True), path)
            found[name] = read_netcdf(path)
    return found


def test_derivatives_agree_with_resolved_models(results):
    difference = np.abs(results["sensitivity"]["check_difference"])
    assert np.isfinite(difference).all()
    largest = np.abs(results["sensitivity"]["check_slope"]).max("mode")
    assert (difference.max("mode") < 1e-4 * largest).all()  # what is asked for


def test_derivatives_obey_similarity(results):
    assert max(off_similarity(results["sensitivity"]).values()) < 1e-4  # analytic


def test_reduced_derivatives_of_the_response_agree_with_direct_ones(results):
    assert results["sensitivity"]["direct_difference"].max() < 1e-3  # convergence: KEPT modes, VECTORS vectors


def test_damping_lowers_peaks_and_does_little_far_below_them(results):
    # a single mode at resonance: |h| ~ 1 / eta; at low frequency |h| ~ 1 / |1 + i eta|: -eta^2 / (1 + eta^2)
    loss = results["sensitivity"]["point_by_loss_factor"]
    assert (loss.sel(point="peak") < -0.7).all() and (loss.sel(point="peak") > -1.05).all()
    low = results["sensitivity"]["response_by_loss_factor"].isel(sweep=0)
    np.testing.assert_allclose(low, -0.01 / 1.01, rtol=0.05)


def test_real_modes_err_with_the_contrast_and_galerkin_does_not(results):
    worst = results["tissue-loss-factors"]["error"].max(("frequency", "direction"))
    real, galerkin = (worst.sel(model=name).values for name in ("uncoupled", "galerkin"))
    assert (np.diff(real) > 0).all() and real[-1] > 0.05
    assert real[0] == pytest.approx(galerkin[0], rel=1e-6)  # equal loss factors uncouple
    assert galerkin.max() < 0.02 < real[2]


def test_modal_loss_factors_have_one_mean_at_every_contrast(results):
    mean = results["tissue-loss-factors"]["modal_loss_factor_by_contrast"].mean("mode")
    np.testing.assert_allclose(mean, float(mean[0]), rtol=1e-9)  # how the sets are scaled
    equal = results["tissue-loss-factors"]["modal_loss_factor_by_contrast"].sel(contrast=0.0)
    np.testing.assert_allclose(equal, float(mean[0]), rtol=1e-9)  # by definition


@pytest.mark.parametrize("name", SCRIPTS)
def test_results_become_a_folder_that_a_person_reads(name, results, tmp_path):
    experiment = SCRIPTS[name]
    figures, sentences = experiment.draw(results[name]), experiment.findings(results[name])
    assert not any("nan" in sentence.lower().split() for sentence in sentences)
    page = write_experiment(tmp_path, name, "Does it?", sentences, figures, experiment.tables(results[name]))
    text = page.read_text(encoding="utf-8")
    for figure in figures:
        assert (tmp_path / figure.file).stat().st_size > 10_000
        assert f'src="{figure.file}"' in text
