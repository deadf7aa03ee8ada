"""Frequency response, forced shapes, several forces, participation: quick runs against theory and published facts."""

import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import forced_shapes
import frequency_response
import modal_participation
import several_forces

from rom.datasets.storage import read_netcdf, write_netcdf
from rom.reporting.experiment import write_experiment

SCRIPTS = {"frequency_response": frequency_response, "forced_shapes": forced_shapes,
           "several_forces": several_forces, "modal_participation": modal_participation}


@pytest.fixture(scope="module")
def results():
    return {name: script.main(quick=True) for name, script in SCRIPTS.items()}


def test_the_chosen_method_meets_its_bars_on_a_coarse_mesh_too(results):
    found = results["frequency_response"].sel({"method": "modal-krylov"})
    assert found["error_max"] < 1e-4 and found["node_error_max"] < 1e-4  # the bar of the study
    others = results["frequency_response"]["error_max"]
    assert others.sel({"method": "modal"}) > others.sel({"method": "modal-static"}) > found["error_max"]


def test_each_direction_has_the_resonance_of_its_mode(results):
    # published: torsion answers radial-ulnar, rotation distal-proximal force, below the contraction's normal peak
    found = results["frequency_response"].sel({"method": "direct-reused"}).sel(measure="whole")["peak_frequency"]
    lateral, axial, normal = (float(found.sel(direction=name)) for name in (
        "radial-ulnar", "distal-proximal", "normal"))
    assert lateral < axial < normal
    natural = results["frequency_response"]["natural_frequency"].values
    # at loss factor 0.1 and a lone resonance the peak of a receptance lies at its natural frequency
    assert lateral == pytest.approx(natural[0], rel=0.02)
    assert np.abs(natural - axial).min() < 0.03 * axial


def test_tangential_amplification_exceeds_normal(results):
    gain = results["frequency_response"].sel({"method": "direct-reused"}).sel(measure="excitation")["amplification"]
    assert gain.sel(direction="normal") < min(gain.sel(direction=name) for name in ("radial-ulnar", "distal-proximal"))


def test_damping_limits_amplification(results):
    # one mode alone amplifies by 1 / eta = 10; its share of the static answer is below one
    gain = results["frequency_response"].sel({"method": "direct-reused"}).sel(measure="excitation")["amplification"]
    assert gain.max() < 10.1


def test_methods_are_timed_and_billed(results):
    found = results["frequency_response"]
    assert (found["offline_seconds"] > 0).all() and (found["sweep_seconds"] > 0).all()
    assert (found["speedup"] >= found["speedup_offline"])[1:].all()  # nothing gains by counting its offline stage
    assert found["speedup"].sel({"method": "direct-reused"}) == 1


def test_forced_shapes_answer_the_published_statement(results):
    found = results["forced_shapes"]
    assert int(found["published_away"].sum()) == 4  # four cases away from the load
    assert found["error"].max() < 1e-4
    # at rest nothing amplifies but the load itself
    assert (found["far_over_near"].sel(frequency=0.0) < 1).all()
    static = found["largest_displacement"].sel(frequency=0.0)
    assert (found["largest_displacement"].max("frequency") > static).all()


def test_the_phase_moves_power_as_reciprocity_says(results):
    found = results["several_forces"]
    total, alone = found["dissipated_power"], found["alone_power"].sum("force")
    # P = P1 + P2 - omega F^2 Im(H12) cos(phase): a cosine about the sum of both alone
    cosine = np.cos(np.radians(found["phase"]))
    expected = alone + (total.sel(phase=0.0) - alone) * cosine
    np.testing.assert_allclose(total.transpose(*expected.dims), expected, rtol=1e-5)
    # what one force gives beyond its half of the total, the other takes: omega F^2 Re(H12) sin(phase) / 2
    given = found["input_power"]
    np.testing.assert_allclose(given.sum("force"), total, rtol=1e-5)
    moved = (given.isel(force=1) - found["alone_power"].isel(force=1)) - (
        given.isel(force=0) - found["alone_power"].isel(force=0))
    sine = np.sin(np.radians(found["phase"]))
    np.testing.assert_allclose(moved, moved.sel(phase=90.0) * sine, atol=1e-5 * float(np.abs(moved).max()))


def test_crossed_forces_on_the_mid_plane_do_not_feel_each_other(results):
    # one drives antisymmetric, the other symmetric modes alone: H12 = 0
    found = results["several_forces"].sel(layout="crossed at one patch")
    ratio = found["dissipated_power"] / found["alone_power"].sum("force")
    np.testing.assert_allclose(ratio, 1.0, rtol=1e-6)
    assert results["several_forces"]["error"].max() < 1e-4


def test_shares_of_energy_sum_to_one(results):
    found = results["modal_participation"]
    for name in ("static_share", "strain_share", "kinetic_share"):
        np.testing.assert_allclose(found[name].sum("carrier"), 1.0, atol=1e-9)
        assert (found[name] > -1e-9).all()
    # statics are the low end of vibration
    low = found["strain_share"].isel(frequency=0)
    np.testing.assert_allclose(low, found["static_share"], atol=0.02)
    assert found["energy_error_bound"] < 1e-4
    # radial-ulnar force drives antisymmetric modes alone, as the mirror symmetry demands
    driven = np.abs(found["participation"])
    other = found["parity"].values == "symmetric"
    assert float(driven.sel(direction="radial-ulnar")[other].max()) < 1e-5 * float(driven.max())


@pytest.mark.parametrize("name", SCRIPTS)
def test_results_are_kept_and_become_a_page(name, results, tmp_path, monkeypatch):
    monkeypatch.setattr("rom.reporting.figure.DPI", 40)  # sooner drawn
    script = SCRIPTS[name]
    write_netcdf(results[name], tmp_path / "results.nc")
    again = read_netcdf(tmp_path / "results.nc")  # figures and findings come from the file alone
    assert all("units" in v.attrs or v.dtype.kind in "OUS" for v in again.data_vars.values())
    assert all("long_name" in v.attrs for v in again.data_vars.values())
    sentences = script.findings(again)
    assert sentences == script.findings(results[name])
    page = write_experiment(tmp_path, name, "What?", sentences, script.draw(again), script.tables(again),
                            attributes={**again.attrs, "quick": "1"})
    text = page.read_text(encoding="utf-8")
    assert text.count("<figure") >= 2 and "<table" in text
    assert "nan" not in " ".join(sentences).split()
    assert all(path.stat().st_size > 5_000 for path in tmp_path.glob("*.png"))


def test_a_measure_that_fails_is_said_to_fail(results):
    found = results["frequency_response"].copy(deep=True)
    found["error_max"][:] = 0.5
    assert "not met" in frequency_response.findings(found)[0]
    shapes: xr.Dataset = results["forced_shapes"].copy(deep=True)
    shapes["published_away"][:] = 1 - shapes["published_away"]
    agree = forced_shapes.findings(results["forced_shapes"])[0].split(" in ")[1].split()[0]
    other = forced_shapes.findings(shapes)[0].split(" in ")[1].split()[0]
    assert int(agree) + int(other) == 18
