"""A whole comparison on a tiny mesh: what results.nc promises, and a cache that is never stale."""

import dataclasses
import json

import numpy as np
import pytest
import xarray as xr

from rom.comparison import compare, compared, entries, side_by_side, write_results
from rom.comparison.entries import Entry, fit_or_load, model_path
from rom.comparison.truth import find_truth, held_out_tests, truth_path, validation_tests
from rom.datasets import SPLITS, read_dataset
from rom.datasets.splits import held_out_numbers
from rom.datasets.storage import read_netcdf
from rom.metamodels import metamodel_class
from rom.metamodels.metamodel import Metamodel
from rom.scenes import get_scene, scene_from_json

METHODS = {
    "static-point-forces": ["superposition", "pod-galerkin", "pod-regression"],
    "harmonic-point-force": ["coarse-fem", "modal", "modal-static", "modal-krylov", "pod-galerkin"],
}
SOLVERS = ["direct", "direct-reused"]
PROMISED = {
    "error_max": ("entry", "split"), "error_p95": ("entry", "split"), "error_median": ("entry", "split"),
    "validation_error_max": ("entry", "split"), "case_error": ("entry", "split", "case"),
    "online_seconds": ("entry", "repeat"), "cold_seconds": ("entry", "repeat"), "output_seconds": ("entry", "repeat"),
    "predict_seconds": ("entry", "repeat"), "batch_seconds": ("entry", "batch_repeat"), "first_seconds": ("entry",),
    "offline_seconds": ("entry",), "model_bytes": ("entry",), "speedup": ("entry",), "speedup_direct": ("entry",),
    "break_even_cases": ("entry",)}


def run(name, tip, methods=None, **options):
    return compare(name, methods=methods or METHODS[name], cases=60, quick=True, fingertip=tip, **options)


@pytest.fixture(scope="module", autouse=True)
def _cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROM_CACHE", str(tmp_path_factory.mktemp("compare")))
        yield


@pytest.fixture(scope="module", params=METHODS)
def name(request):
    return request.param


@pytest.fixture(scope="module")
def results(name, tiny_tip):
    return run(name, tiny_tip)


@pytest.fixture
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
    for coordinate in ("method", "setting", "headline", "snapshot_source"):
        assert results[coordinate].dims == ("entry",)
    for attribute in ("machine", "threads", "software_versions", "commit", "seed", "scene", "residual_max", "backend",
                      "case_noun", "partial_output", "error_definition"):
        assert attribute in results.attrs
    assert results.attrs["residual_max"] <= 1e-10
    assert json.loads(results.attrs["full_order"]) == SOLVERS
    colours = json.loads(results.attrs["method_colours"])
    assert colours["direct"] == "#000000" and set(results["method"].values) <= set(colours)


def test_exactly_one_headline_a_method(name, results):
    headline = results["headline"].values
    for method in np.unique(results["method"]):
        assert headline[results["method"].values == method].sum() == 1
    # few cases do not span every rank; what cannot be is named, with the reason
    omitted = json.loads(results.attrs["omitted"])
    assert all("rank" in reason for reason in omitted)
    assert set(results["method"].values) == {*SOLVERS, *METHODS[name]}


def half_omitted(results):
    """Entries that could not be fitted to the hard split."""
    return [text.split(" (hard split): ")[0] for text in json.loads(results.attrs["omitted"]) if "(hard split)" in text]


def test_numbers_are_numbers(results):
    for variable in ("error_max", "validation_error_max", "offline_seconds", "model_bytes", "first_seconds"):
        for entry, method, values in zip(results["entry"].values, results["method"].values, results[variable].values,
                                         strict=True):
            known = np.isfinite(np.atleast_1d(values))
            if variable == "validation_error_max" and method in SOLVERS:
                assert not known.any()
            else:  # the hard split's fewer training cases may span fewer directions, which is said
                assert known.all() or (known[0] and entry in half_omitted(results)), (variable, entry)
    for variable in ("online_seconds", "cold_seconds", "predict_seconds", "output_seconds", "batch_seconds"):
        assert (results[variable] > 0).any("repeat" if "repeat" in results[variable].dims else "batch_repeat").all()
    assert not (results["error_median"] > results["error_p95"]).any()
    assert not (results["error_p95"] > results["error_max"]).any()
    assert results.sizes["repeat"] == side_by_side.QUICK_ROUNDS


@pytest.mark.parametrize(("workload", "stem"), [("online", ""), ("batch", "batch_"), ("output", "output_"),
                                                ("predict", "predict_")])
def test_speedups_are_over_the_fastest_full_order_method_for_the_same_workload(results, workload, stem):
    median = np.nanmedian(results[f"{workload}_seconds"].values, axis=1)
    solver = np.isin(results["method"].values, SOLVERS)
    np.testing.assert_allclose(results[f"{stem}speedup"], median[solver].min() / median)
    np.testing.assert_allclose(results[f"{stem}speedup_direct"], median[results["method"].values == "direct"] / median)
    assert results[f"{stem}speedup"].values[solver].max() == 1.0


def test_what_is_saved_repays_what_was_spent(results):
    median = np.nanmedian(results["online_seconds"].values, axis=1)
    gain = median[np.isin(results["method"].values, SOLVERS)].min() - median
    expected = np.where(gain > 0, results["offline_seconds"] / np.where(gain > 0, gain, 1), np.inf)
    np.testing.assert_allclose(results["break_even_cases"], expected)


def test_a_batch_offers_grouped_solves_as_many_columns_as_it_has_at_one_point(name, results):
    sizes = dict(zip(results["method"].values, results["batch_size"].values, strict=True))
    arrays = held_out_tests(*found(name, results)).arrays
    scene = found(name, results)[0]
    assert sizes["pod-galerkin"] == scene.extent.quick_batch
    if name == "static-point-forces":
        assert sizes["direct-reused"] == 32  # all cases share one factor: as many as make a column no cheaper
    else:
        assert 1 < sizes["direct-reused"] <= 32 < sizes["pod-galerkin"]
        assert len(scene.groups(arrays)) > 1
    assert sizes["direct"] == sizes["direct-reused"]


def found(name, results):
    """Scene and truth of these results."""
    scene = scene_from_json(results.attrs["scene_parameters"])
    return scene, find_truth(scene, 60, 8, 2026, side_by_side.no_progress)


def test_errors_are_those_of_the_methods(name, results):
    error = results["error_max"].sel(split="published")
    names = results["method"].values
    by_method = {method: float(error[names == method].min()) for method in set(names)}
    assert by_method["direct"] <= 1e-9  # the truth itself, solved again
    if name == "static-point-forces":
        assert by_method["superposition"] <= 1e-9
    else:
        assert by_method["modal-krylov"] < by_method["modal-static"] < by_method["modal"]
        # a bound below the error would be none
        assert float(results["effectivity_min"].dropna("entry").min()) >= 1.0 - 1e-9


def test_the_mesh_floor_is_the_error_of_the_truth_against_a_finer_mesh(name, results):
    scene, truth = found(name, results)
    tests = held_out_tests(scene, truth)
    rows = np.flatnonzero(tests.tested["published"])
    rows = rows[np.linspace(0, len(rows) - 1, 4).astype(int)]
    finer = metamodel_class("coarse-fem", scene)(scene, scale=1.25).fit()
    miss = finer.evaluate(tests.arrays.take(rows), "field") - tests.values[rows]
    error = np.linalg.norm(miss, axis=1) / np.linalg.norm(tests.values[rows], axis=1)
    assert float(results["mesh_floor_max"]) == pytest.approx(error.max(), rel=1e-6)
    assert float(results["mesh_floor_median"]) == pytest.approx(np.median(error), rel=1e-6)


def test_worst_cases_are_named(results):
    for i, split in np.ndindex(results.sizes["entry"], 2):
        errors = results["case_error"].values[i, split]
        held = np.flatnonzero(~np.isnan(errors))
        worst = int(results["worst_case"].values[i, split])
        if split and str(results["entry"].values[i]) in half_omitted(results):
            assert worst == results["n_evaluated"].values[i, split] == -1
            continue
        assert errors[results["case"].values == worst][0] == errors[held].max() == results["error_max"].values[i, split]
    whole = [i for i in range(results.sizes["entry"]) if str(results["entry"].values[i]) not in half_omitted(results)]
    for i in whole:
        for split, name in enumerate(("split_published", "split_hard")):
            tested = ~np.isnan(results["case_error"].values[i, split])
            held_out = results[name].values == 2  # the flag of a test case
            assert tested.sum() == results["n_evaluated"].values[i, split] > 0
            assert not (tested & ~held_out).any()
            if results["method"].values[i] not in ("direct", "direct-reused", "coarse-fem"):  # a share is enough there
                assert (tested == held_out).all()


def test_the_worst_case_is_drawn_on_the_skin(results, name):
    scene, truth = found(name, results)
    tests = held_out_tests(scene, truth)
    headline = np.flatnonzero(results["headline"].values)
    for k, i in enumerate(headline):
        row = int(np.flatnonzero(tests.number == int(results["worst_case"].values[i, 0]))[0])
        field = scene.whole(tests.values[row:row + 1])[0, results["skin_node"].values]
        np.testing.assert_array_equal(results["worst_truth"].values[k], field)
        assert results["worst_error"].values[k] == results["error_max"].values[i, 0]


def test_learning_costs_its_snapshots(name, results):
    scene, _ = found(name, results)
    for i in range(results.sizes["entry"]):
        learns = metamodel_class(str(results["method"].values[i]), scene).learns
        snapshots = float(results["snapshot_seconds"][i])
        assert (snapshots > 0) == learns == (str(results["snapshot_source"].values[i]) == "direct")
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


# ---- validation cases ---------------------------------------------------------------------------------------

def test_validation_cases_are_neither_learned_from_nor_judged(name, tiny_tip):
    scene = get_scene(name, tiny_tip)
    truth = find_truth(scene, 60, 8, 5, side_by_side.no_progress)
    tests = validation_tests(scene, truth, 12, side_by_side.no_progress)
    data = read_dataset(truth.path)
    known = scene.published_number(scene.read(data.isel(case=np.flatnonzero(data["split_published"].values != 0))))
    within = tests.arrays.take(tests.tested["published"])
    assert 3 < len(within) <= 12
    assert not np.isin(scene.published_number(within), known).any()
    # of the whole population the published split of this seed holds a fifth out: weights may have learned the rest
    assert np.isin(scene.published_number(within), held_out_numbers(scene.n_published, 5)).all()
    assert (scene.hard_region(tests.arrays.take(tests.tested["hard"]), 5) > 0).all()
    assert tests.tested["hard"].any()
    answers = metamodel_class("direct-reused", scene)(scene).fit().evaluate(tests.arrays, "field")
    np.testing.assert_allclose(tests.values, answers, rtol=1e-8, atol=1e-9 * np.abs(answers).max())


# ---- the cache ----------------------------------------------------------------------------------------------

def test_an_equal_comparison_is_measured_once(name, tiny_tip, monkeypatch, tmp_path):
    monkeypatch.setenv("ROM_CACHE", str(tmp_path))
    options = {"methods": ["pod-galerkin"], "cases": 60, "quick": True, "fingertip": tiny_tip}
    first = compared(name, **options)
    with monkeypatch.context() as patch:
        patch.setattr(side_by_side, "compare", None)  # a call would fail
        xr.testing.assert_identical(compared(name, **options).drop_attrs(), read_netcdf(
            next((tmp_path / "results").iterdir())).drop_attrs())
        np.testing.assert_array_equal(compared(name, **options)["online_seconds"], first["online_seconds"])
        for other in ({"cases": 61}, {"seed": 7}, {"methods": ["pod-galerkin", "coarse-fem"]}):
            with pytest.raises(TypeError):
                compared(name, **{**options, **other})
    for file in (tmp_path / "results").iterdir():
        file.write_bytes(file.read_bytes()[:100])
    again = compared(name, **options)
    np.testing.assert_array_equal(again["error_max"], first["error_max"])


def test_a_truth_that_is_solved_in_seconds_is_not_kept(name, tiny_tip, results):
    scene = get_scene(name, tiny_tip)
    run(name, tiny_tip, ["pod-galerkin"])
    assert not truth_path(scene, 60, 8, 2026).exists()


def test_another_tissue_is_another_comparison(name, tiny_tip, results, fits):
    stiffer = dataclasses.replace(tiny_tip.anatomy, dermis=dataclasses.replace(
        tiny_tip.anatomy.dermis, elastic_modulus=1.001 * tiny_tip.anatomy.dermis.elastic_modulus))
    method = "superposition" if name == "static-point-forces" else "modal-krylov"
    again = run(name, dataclasses.replace(tiny_tip, anatomy=stiffer), [method])
    assert method in fits and "direct" in fits
    assert again.attrs["scene_hash"] != results.attrs["scene_hash"]
    # right for the new tissue, so the truth was made again too, and nothing of the old one was mixed in
    mine = again["method"].values == "direct"
    assert float(again["error_max"].sel(split="published")[mine].max()) <= 1e-9


def test_another_seed_is_another_truth(tiny_tip, name):
    scene = get_scene(name, tiny_tip)
    first, second = (find_truth(scene, 60, 8, seed, side_by_side.no_progress) for seed in (0, 1))
    assert first.key != second.key
    with pytest.raises(AssertionError):
        xr.testing.assert_equal(read_dataset(first.path)["load_node"], read_dataset(second.path)["load_node"])


def test_only_fits_that_took_long_are_kept_and_a_damaged_one_is_made_again(tiny_tip, monkeypatch, fits):
    scene = get_scene("static-point-forces", tiny_tip)
    truth = find_truth(scene, 60, 8, 3, side_by_side.no_progress)
    kind = metamodel_class("pod-galerkin", scene)
    path = model_path(kind, scene, {}, truth.key, truth.seed)
    fit_or_load(kind, scene, {}, truth)
    assert not path.exists()
    monkeypatch.setattr(entries, "REFITTED_SECONDS", 0.0)
    model = fit_or_load(kind, scene, {}, truth)
    assert path.exists() and fits == ["pod-galerkin"] * 2
    found = fit_or_load(kind, scene, {}, truth)
    assert fits == ["pod-galerkin"] * 2 and found.offline_seconds == model.offline_seconds
    path.write_bytes(path.read_bytes()[:100])
    fit_or_load(kind, scene, {}, truth)
    assert fits == ["pod-galerkin"] * 3
    monkeypatch.setattr(entries, "STORED_BYTES", 10.0)
    path.unlink()
    fit_or_load(kind, scene, {}, truth)
    assert not path.exists()


def test_each_split_and_seed_has_a_model_of_its_own(static):
    kind = metamodel_class("pod-galerkin", static)
    paths = {model_path(kind, static, {"rank": rank}, key, 0, split)
             for rank in (3, 4) for key in ("a", "b") for split in SPLITS}
    assert len(paths) == 8
    network = metamodel_class("transformer", static)
    assert model_path(network, static, {}, "a", 0) != model_path(network, static, {}, "a", 1)
    # what learns nothing is the same for every truth
    direct = metamodel_class("direct", static)
    assert model_path(direct, static, {}, "a", 0) == model_path(direct, static, {}, "b", 1, SPLITS[1])
    assert Entry(kind, {"rank": None}, True).label == "pod-galerkin rank=all"
