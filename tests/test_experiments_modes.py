"""The experiments on natural modes and on mesh convergence run, coarse and quick, and report what is there."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import mesh_convergence
import vibration_modes
from analysis import mesh_ladder
from presentation.published_facts import facts

from rom.datasets.storage import read_netcdf, write_netcdf
from rom.reporting.experiment import write_experiment
from rom.vibration.published import published, published_frequencies


@pytest.fixture(scope="module")
def modes(tmp_path_factory):
    """Results as they come back from the file that the page is drawn from."""
    path = tmp_path_factory.mktemp("modes") / "results.nc"
    write_netcdf(vibration_modes.main(quick=True), path)
    return read_netcdf(path)


def test_a_held_rear_raises_every_frequency(modes):
    # theory: a constraint raises each eigenvalue of the same rank (Courant and Fischer)
    free, fixed = (modes["natural_frequency"].sel(rear=rear).values for rear in ("free", "fixed"))
    assert (fixed >= free).all() and (np.diff(free) > 0).all()


def test_every_mode_below_the_bands_end_is_there(modes):
    assert (modes["sturm_count"] == modes["modes_found"]).all()
    assert modes.sizes["mode"] >= 8
    assert modes["orthogonality"].max() < 1e-9 and modes["residual"].max() < 1e-8


def test_pairs_are_a_permutation_of_equal_parity(modes):
    partner = modes["paired_mode"].values
    assert sorted(partner) == list(modes["mode"].values)
    assert ((modes["pair_mac"] >= 0) & (modes["pair_mac"] <= 1 + 1e-12)).all()
    free, fixed = (modes["parity"].sel(rear=rear).values for rear in ("free", "fixed"))
    assert set(free) == {"symmetric", "antisymmetric"}
    assert (free[:7] == fixed[partner[:7] - 1]).all()


def test_the_first_mode_is_torsion_even_on_a_coarse_mesh(modes):
    # section 4.2 of the study
    assert modes["description_met"].sel(rear="free", mode=1, description=1) == 1
    assert modes["parity"].sel(rear="free", mode=1) == "antisymmetric"


def test_published_numbers_stand_beside(modes):
    printed = modes["published_frequency"].values
    assert printed[0] == published()["digitip"]["natural_frequency_hz"]["mode_1"] == published_frequencies()[1]
    assert np.isnan(printed[[2, 4, 5]]).all()
    assert modes.attrs["volume_mm3"] == pytest.approx(4084.8, rel=0.05)  # a coarse mesh of the published body
    assert all("units" in modes[name].attrs and "long_name" in modes[name].attrs for name in modes.variables)


def test_verdicts_follow_from_the_numbers(modes):
    listed = {one.name: one for one in facts(modes)}
    assert len(listed) == modes.sizes["fact"] == 16
    perfect = modes.copy(deep=True)
    perfect.attrs["volume_mm3"] = 4084.8
    for mode, frequency in published_frequencies().items():
        perfect["natural_frequency"].loc[{"rear": "free", "mode": mode}] = frequency
    perfect["parity"].loc[{"rear": "free", "mode": 4}] = "symmetric"
    perfect["description_met"][:] = 0
    for mode in range(1, 8):
        perfect["description_met"].loc[{"mode": mode, "description": mode}] = 1
    perfect["paired_mode"][:] = perfect["mode"].values
    perfect["natural_frequency"].loc[{"rear": "fixed"}] = 2 * perfect["natural_frequency"].sel(rear="free").values
    assert all(one.met for one in facts(perfect))
    for name, change in {"frequency of mode 7": {"mode": 7}, "frequency of mode 1": {"mode": 1}}.items():
        off = perfect.copy(deep=True)
        off["natural_frequency"].loc[{"rear": "free", **change}] *= 1.021  # the bar is 2 %
        assert [one.name for one in facts(off) if not one.met] == [name]
    swapped = perfect.copy(deep=True)
    swapped["paired_mode"][[1, 2]] = [3, 2]
    assert [one.name for one in facts(swapped) if not one.met] == ["a fixed rear keeps the modes' order"]


def test_a_page_comes_of_it(modes, tmp_path):
    read_through(vibration_modes, modes, tmp_path)


def read_through(script, results: xr.Dataset, folder: Path) -> None:
    figures = script.draw(results)
    page = write_experiment(folder, "name", "Does it?", script.findings(results), figures, script.tables(results),
                            attributes={"quick": "1"})
    text = page.read_text(encoding="utf-8")
    assert "not a result" in text and "<table>" in text
    for figure in figures:
        assert (folder / figure.file).stat().st_size > 10_000
        assert f'src="{figure.file}"' in text


def in_this_process(words, **_):
    """What the other process would do; starting six takes long, and tests of the ladder start one."""
    write_netcdf(mesh_ladder._solve(json.loads(words[2])), words[3])
    return subprocess.CompletedProcess(words, 0, "", "")


@pytest.fixture(scope="module")
def convergence(tmp_path_factory):
    path = tmp_path_factory.mktemp("convergence") / "results.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mesh_ladder.subprocess, "run", in_this_process)
        write_netcdf(mesh_convergence.main(quick=True), path)
    return read_netcdf(path)


def test_a_second_run_goes_on_from_what_is_there(convergence, monkeypatch):
    solved = []
    monkeypatch.setattr(mesh_ladder.subprocess, "run", lambda words, **_: solved.append(words))
    again = mesh_convergence.main(quick=True)
    assert not solved
    assert np.array_equal(again["natural_frequency"], convergence["natural_frequency"])


def test_finer_meshes_are_softer(convergence):
    # theory: displacement elements bound eigenvalues from above; on one body refinement lowers them. The body and the
    # layers' meshes differ here from rung to rung, so only the whole way from the coarsest to the finest is asked for.
    full = convergence["natural_frequency"].sel(formulation="full", mode=slice(1, 3))
    assert (full.isel(step=-1) < full.isel(step=0)).all()
    # full integration is stiffer than B-bar on the same mesh
    assert (full > convergence["natural_frequency"].sel(formulation="b-bar", mode=slice(1, 3))).all()


def test_modes_are_followed_by_shape(convergence):
    assert (convergence["mac"].isel(step=convergence.attrs["home"], formulation=0) > 0.999).all()  # with itself
    assert (convergence["mac"].sel(mode=slice(1, 3)) > 0.5).all()


def test_a_page_comes_of_convergence(convergence, tmp_path):
    assert len(mesh_convergence.findings(convergence)) >= 8
    read_through(mesh_convergence, convergence, tmp_path)


@pytest.mark.accuracy
def test_every_published_fact_is_met_on_the_real_mesh():
    # section 4 of the study, as data/published.toml holds it; tolerances are those of presentation.published_facts
    results = vibration_modes.main()
    missed = [f"{fact.name}: {fact.text}" for fact in facts(results) if not fact.met]
    assert not missed
    assert results.sizes["fact"] == 16
    assert (results["sturm_count"] == results["modes_found"]).all()
    assert results["orthogonality"].max() < 1e-9
