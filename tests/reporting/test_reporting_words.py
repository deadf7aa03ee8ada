"""Numbers as people read them, colours that stay with their method, and the arithmetic of the figures."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from synthetic_contact import make_contact
from synthetic_results import make

from rom.reporting import words
from rom.reporting.cases import case_words, inputs_of
from rom.reporting.fields import snapshot
from rom.reporting.inputs import binned, kept_from_training
from rom.reporting.palette import COLOURS, style
from rom.reporting.positions import _scaled
from rom.reporting.results import Results
from rom.reporting.work_precision import frontier

NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(("say", "value", "text"), [
    (words.error, 0.0123, "1.2 %"), (words.error, 0.98, "98 %"), (words.error, 12.0, "1,200 %"),
    (words.error, 1e-4, "0.01 %"), (words.error, 3.21e-6, "3.2 × 10⁻⁶"), (words.error, 1e-9, "1 × 10⁻⁹"),
    (words.error, 1.8e9, "1.8 × 10¹¹ %"), (words.error, 0.0, "0"), (words.error, NAN, "–"),
    (words.error, INF, "unbounded"),
    (words.ratio, 1543.2, "1,540 ×"), (words.ratio, 1.24, "1.2 ×"), (words.ratio, NAN, "–"),
    (words.ratio, 0.5, "0.5 ×"), (words.seconds, 1.1e-4, "110 µs"), (words.seconds, 0.55, "550 ms"),
    (words.seconds, 0, "none"), (words.seconds, 3.25e-8, "32.5 ns"), (words.seconds, 90.0, "90 s"),
    (words.seconds, 200.0, "3.33 min"), (words.seconds, 1e4, "2.78 h"), (words.seconds, NAN, "–"),
    (words.size, 0.0, "0 B"), (words.size, 2.34e7, "23.4 MB"), (words.size, 4e9, "4 GB"),
    (words.count, 55.2, "56"), (words.count, 123456.0, "123,000"), (words.count, INF, "never"),
    (words.count, NAN, "–"), (words.frequency, 122.44, "122.4 Hz"),
])
def test_words(say, value, text):
    assert say(value) == text


def test_a_bound_is_never_rounded_across_one():
    assert [words.bound(v) for v in (0.999999, 1.0000001, 0.98, 1.0552)] == ["just below 1", "1", "0.98", "1.055"]


def test_lists():
    assert [words.listed(list("abc")[:n]) for n in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert words.plural(1, "case") == "1 case"
    assert words.plural(1200, "case") == "1,200 cases"


def test_each_method_has_its_own_colour_and_marker():
    styles = [style(method) for method in COLOURS]
    assert len({s.colour for s in styles}) == len({s.marker for s in styles}) == len(styles)
    assert style("a method of tomorrow") == style("a method of tomorrow")


def test_results_bring_their_own_colours():
    given = {"mine": "#123456", "yours": "#abcdef"}
    assert [style(name, given).colour for name in given] == ["#123456", "#abcdef"]
    assert style("mine", given).marker != style("yours", given).marker


def test_frontier_keeps_only_settings_that_nothing_beats():
    times, errors = np.array([1.0, 2.0, 3.0, 1.0]), np.array([0.5, 0.6, 0.1, 0.7])
    assert frontier(times, errors, [0, 1, 2, 3]) == [0, 2]


def test_bins_do_not_straddle_an_edge():
    x = np.arange(1.0, 41.0)
    middle, worst, typical = binned(x, np.where(x > 20, 1.0, 0.1), [20.5])
    np.testing.assert_array_equal(middle, [5.5, 15.5, 25.5, 35.5])
    assert set(worst) == set(typical) == {0.1, 1.0}
    assert len(binned(x, np.full(40, NAN))[0]) == 0


def test_intervals_kept_from_training_are_found_in_the_cases():
    found = Results(make("harmonic"))
    by_name = {one.name: one for one in inputs_of(found)}
    (low, high), (low2, high2), (low3, high3) = kept_from_training(found, by_name["frequency"])
    assert 111 <= low < high <= 127  # the bands and the range of synthetic_results, half a step aside
    assert 205 <= low2 < high2 <= 221
    assert 300 <= low3 < high3 <= 401


def test_inputs_are_what_varies_from_case_to_case():
    assert [one.title for one in inputs_of(Results(make("harmonic")))] == ["frequency", "loss factor"]
    (one,) = inputs_of(Results(make("static")))
    assert (one.title, sorted(set(one.values))) == ("number of forces", [1, 2, 3, 4, 5])
    assert [one.name for one in inputs_of(Results(make_contact()))] == ["variant", "c", "friction", "normal_force"]


def test_named_loads_are_an_input_where_they_are_few():
    data = make("static", cases=40)
    one = data.drop_vars(["load_node", "force"], errors="ignore").assign_coords(
        load=(("case", "force"), np.array([["a"], ["b"]])[np.arange(40) % 2]), hard_region=data["hard_region"])
    assert [(given.name, set(given.values)) for given in inputs_of(Results(one))] == [("load", {"a", "b"})]
    assert case_words(Results(one), 1) in ("load a", "load b")
    two = one.drop_vars("load").assign_coords(load=(("case", "force"), np.array([["a", ""], ["a", "b"]])[
        np.arange(40) % 2]))
    assert [(given.title, set(given.values)) for given in inputs_of(Results(two))] == [("number of forces", {1, 2})]
    assert {case_words(Results(two), k) for k in range(4)} <= {"load a", "load a and b"}


def test_a_long_axis_needs_no_exponents():
    unit, factor = _scaled(xr.DataArray([2e-5, -4e-5], attrs={"units": "m2"}))
    assert (unit, factor) == ("10⁻⁶ m2", pytest.approx(1e6))
    assert _scaled(xr.DataArray([0.5], attrs={"units": "N"})) == ("N", 1.0)


def test_snapshot_is_taken_when_the_truth_is_largest():
    rng = np.random.default_rng(1)
    shape = rng.standard_normal((5, 3))
    truth, answer = snapshot(shape * np.exp(0.7j), 2 * shape * np.exp(0.7j))
    np.testing.assert_allclose(np.abs(truth), np.abs(shape), rtol=1e-12)
    np.testing.assert_allclose(answer, 2 * truth, rtol=1e-12)
