"""`train_networks` runs, coarse and quick: the grid is verified, more cases help, the page says so."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import train_networks
import train_networks_figures

from rom.metamodels.networks.sizes import SIZES
from rom.reporting.experiment import write_experiment


@pytest.fixture(scope="module")
def results():
    return train_networks.main(quick=True)


def test_the_grid_is_verified_and_read_back(results):
    assert results["grid_residual"] < 1e-8 and results["grid_confirmed"] < 1e-6
    assert results.attrs["n_confirmed"] >= 300
    assert np.median(results["grid_read_seconds"]) < 0.05


def test_more_cases_lower_the_error(results):
    error = results["error_max"].sel({"method": ["mlp-residual", "transformer"]}).values
    assert (error[:, -1] < error[:, 0]).all()
    # every pad node has been loaded: attention gives back what it has seen, rounded to half precision
    assert error[1, -1] < 1e-3


def test_every_network_and_size_that_is_committed_is_trained_here():
    assert {method for method, *_ in train_networks.WEIGHTS} == set(SIZES)
    assert set(train_networks.SIZE) == set(SIZES)


def test_results_become_a_page(results, tmp_path):
    figures, sentences = train_networks_figures.draw(results), train_networks_figures.findings(results)
    page = write_experiment(tmp_path, "networks", "How much?", sentences, figures,
                            train_networks_figures.tables(results), attributes={"quick": "1"})
    assert "direct solves differ" in page.read_text(encoding="utf-8")
    assert (tmp_path / figures[0].file).stat().st_size > 10_000
