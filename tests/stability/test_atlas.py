"""The quick atlas: nothing silently wrong, nothing crashed; each level has a name of its own; figures are drawn."""

import collections

import numpy as np
import pytest
from atlas import AXES, OUTCOMES, atlas, levels
from atlas.excitation_extremes import _crossing
from atlas.level import SCENES, default_settings
from atlas.survey import QUICK_DENSITY
from presentation.stability import FAMILIES, draw, findings, tables

from rom.fingertip import Fingertip
from rom.fullorder import natural_modes


@pytest.fixture(scope="module")
def results():
    return atlas(quick=True)


def test_every_level_has_a_name_of_its_own_and_every_method_is_asked_somewhere():
    grid = levels()
    assert max(collections.Counter(level.label for level in grid).values()) == 1
    assert {name for level in grid for name in level.asked} == {
        name for scene in SCENES for name in default_settings(scene)}
    assert {level.axis for level in grid} == set(AXES) == {axis for family in FAMILIES.values() for axis in family}
    assert all(level.scene in SCENES for level in grid)


@pytest.mark.accuracy
def test_no_answer_is_silently_wrong(results):
    lies = [f"{axis}: {level}, {method}" for axis, level, row in zip(
        results["axis"].values, results["level"].values, results["outcome"].values, strict=True)
        for method, outcome in zip(results["method"].values, row, strict=True) if outcome == "silent"]
    assert not lies


@pytest.mark.accuracy
def test_nothing_crashes(results):
    assert not (results["outcome"] == "crashed").any()


@pytest.mark.accuracy
def test_no_claimed_bound_is_broken(results):
    assert (results["bound_holds"] == 1).all()


def test_outcomes_are_of_the_list_and_the_atlas_reaches_what_breaks(results):
    assert set(np.unique(results["outcome"].values.astype(str))) <= {*OUTCOMES, ""}
    for outcome in ("right", "warned", "refused"):  # an atlas where nothing breaks did not go far enough
        assert (results["outcome"] == outcome).any()


def test_direct_is_right_at_ordinary_cases(results):
    ordinary = results.isel(case=(results["axis"].values == "threads"))
    assert (ordinary["outcome"].sel({"method": "direct"}) == "right").all()
    assert (ordinary["error"].sel({"method": "direct"}) < 1e-9).all()  # condition about 1e7 times unit roundoff


def test_two_modes_cross_as_named():
    tip = _crossing(1e-6)(Fingertip(density=QUICK_DENSITY))
    frequency = natural_modes(tip.stiffness, tip.mass, count=8).frequency_hz
    assert np.min(np.diff(frequency) / frequency[1:]) == pytest.approx(1e-6, rel=0.1)


def test_a_finished_level_is_found_again(results, monkeypatch):
    def never(*_):
        raise AssertionError("judged again")
    monkeypatch.setattr("atlas.survey.judge_level", never)
    again = atlas(quick=True)
    np.testing.assert_array_equal(again["outcome"].values, results["outcome"].values)
    np.testing.assert_array_equal(again["error"].values, results["error"].values)


@pytest.mark.parametrize(("options", "word"), [({"axes": ["weather"]}, "weather"), ({"methods": ["oracle"]}, "oracle")])
def test_unknown_names_are_refused(options, word):
    with pytest.raises(ValueError, match=word):
        atlas(quick=True, **options)


def test_results_become_sentences_tables_and_figures(results, tmp_path):
    sentences = findings(results)
    assert "silently wrong" in sentences[0]
    assert any("bounds" in sentence for sentence in sentences)
    for html in tables(results):
        assert "<table>" in html
    figures = draw(results)
    assert [figure.file for figure in figures] == ["overview.png", *(f"{name}.png" for name in FAMILIES)]
    for figure in figures[:2]:
        figure.write(tmp_path)
        assert (tmp_path / figure.file).stat().st_size > 10_000


def test_defects_come_first_in_plain_words(results):
    # what a page says when a method lies: one answer is made wrong by hand
    wrong = results.copy(deep=True)
    wrong["outcome"].values[wrong["outcome"].values == "silent"] = "warned"
    wrong["outcome"].values[0, 0], wrong["error"].values[0, 0] = "silent", 0.5
    sentences = findings(wrong)
    assert f"`{wrong['method'].values[0]}`" in sentences[1] and "50 % off and said nothing" in sentences[1]
