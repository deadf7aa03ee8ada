"""A whole comparison on a tiny mesh: what results.nc promises, and a cache that is never stale."""

import dataclasses
import json

import numpy as np
import pytest
import xarray as xr

from rom.comparison import compare, write_results
from rom.comparison import side_by_side as module
from rom.comparison.entries import Truth
from rom.datasets import read_dataset
from rom.datasets.storage import read_netcdf
from rom.metamodels import metamodel_class
from rom.metamodels.metamodel import Metamodel

METHODS = {
    "static-point-forces": ["direct-reused", "superposition", "pod-galerkin", "pod-regression"],
    "harmonic-point-force": ["coarse-fem", "modal", "modal-static", "modal-krylov", "pod-galerkin"],
}
PROMISED = {
    "error_max": ("entry", "split"), "error_p95": ("entry", "split"), "error_median": ("entry", "split"),
    "online_seconds": ("entry", "repeat"), "batch_seconds": ("entry",), "output_seconds": ("entry",),
    "offline_seconds": ("entry",), "model_bytes": ("entry",), "speedup": ("entry",), "call_seconds": ("entry",),
    "break_even_cases": ("entry",)}


def run(name, tip, methods=None, **options):
    return compare(name, methods=methods or METHODS[name], cases=60, quick=True, fingertip=tip, **options)


@pytest.fixture(scope="module", autouse=True)
def _cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROM_CACHE", str(tmp_path_factory.mktemp("compare")))
        patch.setattr(module, "QUICK_BATCH", 70)  # longer than a block
        yield


@pytest.fixture(scope="module", params=METHODS)
def name(request):
    return request.param


@pytest.fixture(scope="module")
def results(name, tiny_tip):
    return run(name, tiny_tip)


def fits(monkeypatch):
    """Names of the methods that are fitted from now on; what cannot be fitted does not count."""
    made, fit = [], Metamodel.fit

    def counted(self, train=None):
        model = fit(self, train)
        made.append(self.name)
        return model

    monkeypatch.setattr(Metamodel, "fit", counted)
    return made


def test_results_have_the_promised_dimensions(results):
    for variable, dims in PROMISED.items():
        assert results[variable].dims == dims, variable
        assert results[variable].attrs["units"] and results[variable].attrs["long_name"]
    assert list(results["split"].values) == ["published", "hard"]
    for coordinate in ("method", "setting", "headline"):
        assert results[coordinate].dims == ("entry",)
    for attribute in ("machine", "threads", "software_versions", "commit", "seed", "scene", "residual_max"):
        assert attribute in results.attrs
    assert results.attrs["residual_max"] <= 1e-10


def test_exactly_one_headline_a_method(name, results):
    headline = results["headline"].values
    for method in np.unique(results["method"]):
        assert headline[results["method"].values == method].sum() == 1
    # 15 pad nodes give 15 static POD modes, so a setting of rank 25 cannot be; it is named, with the reason
    omitted = json.loads(results.attrs["omitted"])
    assert all("rank" in reason for reason in omitted)
    assert set(results["method"].values) | {text.split()[0] for text in omitted} == {"direct", *METHODS[name]}


def test_numbers_are_numbers(results):
    for variable in ("error_max", "online_seconds", "batch_seconds", "output_seconds", "offline_seconds", "speedup",
                     "call_seconds", "model_bytes"):
        assert np.isfinite(results[variable]).all(), variable
    assert (results["error_median"] <= results["error_p95"]).all()
    assert (results["error_p95"] <= results["error_max"]).all()
    assert results.sizes["repeat"] == module.QUICK_REPEATS


def test_speedup_is_the_ratio_of_medians(results):
    median = results["online_seconds"].median("repeat")
    direct = median.values[results["method"].values == "direct"][0]
    np.testing.assert_allclose(results["speedup"], direct / median)
    gain = direct - median.values
    expected = np.where(gain > 0, results["offline_seconds"] / np.where(gain > 0, gain, 1), np.inf)
    np.testing.assert_allclose(results["break_even_cases"], expected)


def test_errors_are_those_of_the_methods(name, results):
    error = results["error_max"].sel(split="published")
    names = results["method"].values
    by_method = {method: float(error[names == method].min()) for method in set(names)}
    assert by_method["direct"] <= 1e-9  # the truth itself, solved again
    if name == "static-point-forces":
        assert by_method["superposition"] <= 1e-9
    else:
        assert by_method["modal-krylov"] < by_method["modal-static"] < by_method["modal"]
        assert float(results["effectivity_min"].dropna("entry").min()) > 0.9


def test_worst_cases_are_named(results):
    for i, split in np.ndindex(results.sizes["entry"], 2):
        errors = results["case_error"].values[i, split]
        held = np.flatnonzero(~np.isnan(errors))
        worst = int(results["worst_case"].values[i, split])
        assert errors[results["case"].values == worst][0] == errors[held].max() == results["error_max"].values[i, split]
    for i in range(results.sizes["entry"]):
        for split, name in enumerate(("split_published", "split_hard")):
            tested = ~np.isnan(results["case_error"].values[i, split])
            held_out = results[name].values == 2  # the flag of a test case
            assert tested.sum() == results["n_evaluated"].values[i, split] > 0
            assert not (tested & ~held_out).any()
            if results["method"].values[i] not in ("direct", "direct-reused", "coarse-fem"):  # a share is enough there
                assert (tested == held_out).all()


def test_learning_costs_its_snapshots(results):
    for i in range(results.sizes["entry"]):
        learns = metamodel_class(str(results["method"].values[i])).learns
        snapshots = float(results["snapshot_seconds"][i])
        assert (snapshots > 0) == learns
        assert float(results["offline_seconds"][i]) == pytest.approx(snapshots + float(results["fit_seconds"][i]))


def test_results_survive_the_file(results, tmp_path):
    path = write_results(results, tmp_path / "new")
    assert path == tmp_path / "new" / "results.nc"
    again = read_netcdf(path)
    for variable in PROMISED:
        np.testing.assert_array_equal(again[variable], results[variable])
    assert list(again["method"].values) == list(results["method"].values)
    np.testing.assert_array_equal(again["headline"].astype(bool), results["headline"])
    if "harmonic" in results.attrs["scene"]:
        np.testing.assert_array_equal(again["worst_answer"], results["worst_answer"])  # complex


# ---- the cache ----------------------------------------------------------------------------------------------

def test_a_second_run_fits_nothing_and_says_the_same(name, tiny_tip, results, monkeypatch):
    made = fits(monkeypatch)
    monkeypatch.setattr(module, "make_dataset", None)  # a call would fail
    again = run(name, tiny_tip)
    assert set(made) <= {"modal"}  # the natural frequencies that the report marks
    np.testing.assert_array_equal(again["error_max"], results["error_max"])
    np.testing.assert_array_equal(again["offline_seconds"], results["offline_seconds"])


def test_another_tissue_is_never_answered_from_the_cache(name, tiny_tip, results, monkeypatch):
    stiffer = dataclasses.replace(tiny_tip.anatomy, dermis=dataclasses.replace(
        tiny_tip.anatomy.dermis, elastic_modulus=1.001 * tiny_tip.anatomy.dermis.elastic_modulus))
    tip = dataclasses.replace(tiny_tip, anatomy=stiffer)
    method = "superposition" if name == "static-point-forces" else "modal-krylov"
    made = fits(monkeypatch)
    again = run(name, tip, [method])
    assert method in made and "direct" in made
    assert again.attrs["scene_hash"] != results.attrs["scene_hash"]
    # right for the new tissue, so the truth was made again too, and nothing of the old one was mixed in
    mine = again["method"].values == "direct"
    assert float(again["error_max"].sel(split="published")[mine].max()) <= 1e-9
    made.clear()  # and both stand in the cache beside one another
    run(name, tiny_tip, [method])
    assert set(made) <= {"modal"}


def test_another_seed_is_another_truth(tiny_tip, results, name):
    scene = module.get_scene(name, tiny_tip)
    first, second = (module.find_truth(scene, 60, 8, seed, module.no_progress) for seed in (0, 1))
    assert first.key != second.key
    assert isinstance(first, Truth)
    with pytest.raises(AssertionError):
        xr.testing.assert_equal(read_dataset(first.path)["load_node"], read_dataset(second.path)["load_node"])


def test_a_damaged_model_is_fitted_again(tiny_tip, monkeypatch, tmp_path):
    monkeypatch.setenv("ROM_CACHE", str(tmp_path))
    run("static-point-forces", tiny_tip, ["superposition"])
    for path in (tmp_path / "models").iterdir():
        path.write_bytes(path.read_bytes()[:100])
    made = fits(monkeypatch)
    again = run("static-point-forces", tiny_tip, ["superposition"])
    assert "superposition" in made
    assert float(again["error_max"].max()) <= 1e-9
