"""The experiment scripts run, coarse and quick, and what they find is what theory or the real model says."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import certificate
import krylov_convergence
import locking

from rom.reporting.experiment import write_experiment

SCRIPTS = {"certificate": certificate, "krylov_convergence": krylov_convergence, "locking": locking}


@pytest.fixture(scope="module")
def results():
    return {name: script.main(quick=True) for name, script in SCRIPTS.items()}


def test_each_load_dependent_vector_lowers_the_error(results):
    # moment matching: every further Krylov vector multiplies the error by about (omega^2 / lambda_(m+1))^2 < 1
    error = results["krylov_convergence"]["error_max"].sel(modes=20).values
    assert (np.diff(error) < 0).all()
    assert error[-1] < 1e-2 * error[0]


def test_more_modes_alone_do_little_for_a_point_load(results):
    # the static part of the left-out modes stays: the reason for load-dependent vectors
    assert results["krylov_convergence"]["error_max"].sel(vectors=0, modes=40) > 0.1


def test_no_error_exceeds_its_bound(results):
    found = results["certificate"]
    assert (found["error"] <= found["bound"] + certificate.ROUNDING).all()  # the theorem
    # a bound that is ten times too large would be true and useless
    assert np.median(certificate.effectivity(found, certificate.FAMILY)) < 1.5
    assert np.median(certificate.effectivity(found, certificate.BY_RESIDUAL)) < 5


def test_solve_meets_its_tolerances(results):
    found = results["certificate"]
    assert (found["solve_error"] <= found["solve_tolerance"] + certificate.ROUNDING).all()


def test_b_bar_does_not_lock_and_full_integration_does(results):
    frequency = results["locking"]["first_frequency"]
    rise = frequency.isel(poisson_ratio=-1) / frequency.isel(poisson_ratio=0) - 1
    assert abs(rise.sel(formulation="b-bar")) < 0.02  # incompressible tissue is itself stiffer, by .7 % on a fine mesh
    assert rise.sel(formulation="full") > 0.2


@pytest.mark.parametrize("name", SCRIPTS)
def test_results_become_a_folder_that_a_person_reads(name, results, tmp_path):
    script = SCRIPTS[name]
    figures, sentences = script.draw(results[name]), script.findings(results[name])
    page = write_experiment(tmp_path, name, "Does it?", sentences, figures, attributes={"quick": "1"})
    text = page.read_text(encoding="utf-8")
    assert "not a result" in text  # a quick run says so
    for figure in figures:
        assert (tmp_path / figure.file).stat().st_size > 10_000
        assert f'src="{figure.file}"' in text
