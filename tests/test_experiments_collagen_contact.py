"""What the experiment on a finger on glass says of the committed results, and how it judges invented ones."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import collagen_contact_claims as claims
import collagen_contact_findings as found
from collagen_contact_figures import draw
from collagen_contact_paths import ASSUMPTIONS, finger_of, runs

from rom.datasets.storage import read_netcdf

RESULTS = Path(__file__).parents[1] / "reports" / "collagen-contact" / "results.nc"


@pytest.fixture(scope="module")
def results():
    return read_netcdf(RESULTS)


def test_every_claim_has_its_verdict_and_its_numbers(results):
    sentences = found.findings(results)
    met = results["claim_met"].sel(mesh=results.attrs["reference"])
    assert sentences[0].startswith(f"{int(met.sum())} of {met.size} published claims hold")
    for name, ok in zip(results["claim"].values, met.values, strict=True):
        line = next(s for s in sentences if s.startswith(f"{name}: "))
        assert ("not met" in line) == (not ok)


def test_friction_energy_and_fibres_of_the_committed_paths(results):
    worst = found.checks(results)
    assert worst["friction"] <= 1 + 1e-6  # Coulomb's limit, friction 1
    assert worst["balance"] < 0.01
    assert worst["fibre"] <= 0.9  # the cap of the exponential


def test_figures_and_tables_can_be_drawn(results, tmp_path):
    figures = draw(results)
    assert len(figures) == 6
    figures[0].write(tmp_path)
    assert (tmp_path / "figure-3.png").stat().st_size > 10_000
    assert len(found.tables(results)) >= 2


def test_published_claims_are_judged_by_their_numbers():
    radial = claims.Measures(0.8, 45.0, 8.0, 1.2, 4.0, 2.0, 0.5, 2.0, 1.5, 0.6, 1.0)
    around = replace(radial, approach=0.76, area=30.0, peak=12.0, flatness=1.5, slip=np.nan, shift=1.0, suddenness=0.3,
                     rolling=4.0)
    random = replace(around, slip=5.0, rolling=1.3)
    three = {"radial": radial, "circumferential": around, "random": random}
    assert all(claim.met for claim in claims.judge(three))
    for change, name in (({"approach": 1.0}, "meet"), ({"area": 20.0}, "largest"), ({"peak": 13.0}, "lowest peak"),
                         ({"flatness": 1.4}, "flattened"), ({"shift": 0.1}, "trailing"),
                         ({"suddenness": 0.1}, "suddenly"), ({"rolling": 3.0}, "rolls"),
                         ({"slip": 2.6}, "radial slips")):
        judged = claims.judge(three | {"radial": replace(radial, **change)})
        assert [claim.name for claim in judged if not claim.met] == [c.name for c in judged if name in c.name]


def test_crossings_are_found_between_positions():
    x = np.array([0.0, 1.0, 2.0])
    assert claims.crossing(x, np.array([0.0, 0.5, 1.0]), 0.75) == 1.5
    assert np.isnan(claims.crossing(x, np.zeros(3), 0.5))


def test_every_assumption_changes_the_finger():
    base = finger_of("radial", 40, 4)
    for levels in ASSUMPTIONS.values():
        for _, changes in levels:
            assert finger_of("radial", 40, 4, changes=changes) != base
    assert finger_of("radial", 40, 4, changes={"section.scale": 2.0}).section.width == 36.0


def test_recipes_tell_paths_apart():
    recipes = [str(sorted(run.recipe.items())) for run in runs(quick=True)]
    assert len(set(recipes)) > 0.9 * len(recipes)  # a viscosity of zero from the start repeats nothing else
