"""Sentences follow the numbers: change the numbers and the sentences change."""

from __future__ import annotations

import re

import numpy as np
import pytest
from synthetic_contact import make_contact
from synthetic_results import HARMONIC, STATIC, make

from rom.reporting import conclusions, verdict
from rom.reporting.bounds import bound_table
from rom.reporting.choices import choices
from rom.reporting.conclusions import failures
from rom.reporting.results import Results
from rom.reporting.tables import learner_table, mode_table, shortfall_table


def one(sentences: list[str], start: str) -> str:
    found = [s for s in sentences if s.startswith(start)]
    assert len(found) == 1, sentences
    return found[0]


def asked(data, start: str):
    """The choice that answers a question, and the results' view."""
    found = Results(data)
    return next(one for one in choices(found) if one.question.startswith(start)), found


def test_the_verdict_is_three_to_five_sentences_of_few_numbers():
    for data in (make("static"), make("harmonic"), make_contact()):
        sentences = conclusions(data)
        assert 3 <= len(sentences) <= 5
        for sentence in sentences:
            plain = re.sub(r"\([^)]*=[^)]*\)", "", sentence).replace(" × 10", "e")  # a setting is a name
            assert len(re.findall(r"\d[\d.,]*", re.sub(r"e[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", "", plain))) <= 3, sentence


def test_the_cheapest_passing_setting_is_recommended():
    sentences = conclusions(make("static"))
    assert sentences[0].startswith("Cheapest within 1 % on the published split: superposition, ")
    assert verdict(make("static")) == sentences[0]
    one(sentences, "It holds on parts that were kept from training too: at most 5 × 10⁻¹⁴ off on the hard split.")


def test_the_recommendation_changes_with_the_method_that_passes():
    table = STATIC | {"superposition": [("", 7e-5, 0.3, 0.3, 0.3, 8.0)],
                      "transformer": [("", 1e-3, 1e-3, 2e-3, 2e-3, 160.0)]}
    sentences = conclusions(make("static", table))
    assert sentences[0].startswith("Cheapest within 1 % on the published split: pod-galerkin (rank=239), ")
    assert "cheapest within 1 % there: transformer, " in one(sentences, "It does not hold on the hard split")
    rows = next(shortfall_table(Results(make("static", table))))
    assert "30\u00a0×" in rows.partition("superposition")[2].partition("</tr>")[0]  # of a gate of 1 %


def test_splits_are_told_apart():
    table = {k: HARMONIC[k] for k in ("direct", "pod-galerkin")}
    sentences = conclusions(make("harmonic", table))
    assert sentences[0].startswith("Cheapest within 5 % on the published split: pod-galerkin (rank=256)")
    assert one(sentences, "It does not hold on the hard split, at most 33 % off").endswith(
        "no method stays within 5 % there: only direct can be trusted.")


def test_speed_is_told_against_the_fastest_full_solve_of_the_same_work():
    data = make("static")
    solve = float(data["online_seconds"].isel(entry=data["method"].values == "direct-reused").median())
    ours = data["online_seconds"].isel(entry=data["method"].values == "superposition").median()
    assert f"{float(f'{solve / float(ours):.3g}'):,.0f} × faster than direct-reused" in verdict(data)
    found = Results(data)
    data["batch_seconds"][found.headline("direct")] = 1e-3  # a batch in which `direct` is the faster one
    assert (found.method[found.baseline("batch")], found.method[found.baseline()]) == ("direct", "direct-reused")
    assert found.speedup("batch")[found.headline("direct")] == 1.0


def test_what_users_call_has_a_speed_of_its_own():
    data = make("static")
    found = Results(data)
    i, k = found.headline("superposition"), found.baseline("call")
    assert found.seconds("call")[i] == pytest.approx(found.online[i] + 3e-4)  # synthetic_results: labels add .3 ms
    assert found.speedup("call")[i] == pytest.approx((found.online[k] + 3e-4) / (found.online[i] + 3e-4))
    data["predict_seconds"] = 0.0 * data["online_seconds"] + 2e-3
    assert Results(data).seconds("call")[i] == 2e-3


def test_settings_are_chosen_by_validation_errors_where_there_are_any():
    data = make("static", STATIC | {"superposition": [("", 7e-5, 1e-9, 1e-9, 1e-9, 8.0),
                                                      ("fast", 1e-5, 2e-9, 2e-9, 2e-9, 8.0)]})
    assert "superposition (fast)" in verdict(data)
    valid = data["error_max"].copy()
    valid[data["setting"].values == "fast"] = 0.5
    chosen = verdict(data.assign(validation_error_max=valid))
    assert "superposition, " in chosen and "at most 1 × 10⁻⁹ off" in chosen  # what is told is the held-out error


def test_every_question_gets_the_cheapest_that_passes_it():
    data = make("harmonic")
    found = Results(data)
    good = found.errors("published") <= found.gate
    good &= ~np.isin(found.method, found.solvers)
    for start, seconds in (("One case at a time", found.online), ("Thousands of", found.per_entry("batch_seconds")),
                           ("Only the", found.per_entry("output_seconds"))):
        one, _ = asked(data, start)
        assert one.entry == min(np.flatnonzero(good), key=lambda i: seconds[i])
    one, _ = asked(data, "One case within 0.01 %")
    assert (found.errors("hard")[one.entry], found.errors("published")[one.entry]) <= (1e-4, 1e-4)
    one, _ = asked(data, "Beyond the training: unseen node")
    assert found.region_errors[one.entry, 0] <= found.gate


def test_one_answer_alone_is_a_matter_of_preparation():
    data = make("harmonic")
    one, found = asked(data, "One case, once")
    assert found.method[one.entry] in ("direct", "direct-reused")  # others prepare for seconds
    data["offline_seconds"][found.headline("modal-krylov")] = 0.0
    one, found = asked(data, "One case, once")
    assert found.method[one.entry] == "modal-krylov"


def test_other_quantities_are_asked_for_one_by_one():
    one, found = asked(make_contact(), "The pressure")
    errors = found.quantity_errors()[:, 0, found.quantities.index("pressure")]
    passing = [i for i in range(len(errors)) if errors[i] <= found.gate and found.method[i] != "direct"]
    assert one.entry == min(passing, key=lambda i: found.online[i])
    data = make_contact()
    data["contact_error_max"][:, :, 2] = 0.9
    assert asked(data, "The pressure")[0].entry is None


def test_a_question_that_nothing_answers_is_told_so():
    table = {k: HARMONIC[k] for k in ("direct", "modal")}
    assert conclusions(make("harmonic", table))[0].startswith(
        "No method stays within 5 % on the published split: only direct can be trusted")
    assert asked(make("harmonic", table), "One case at a time")[0].entry is None


def test_modes_and_what_they_leave_stand_in_a_table():
    table = next(mode_table(Results(make("harmonic"))))
    for setting, error in (("modes=11", "93 %"), ("modes=100", "40 %"),
                           ("modes=60 vectors=8 precision=float64", "7.9 × 10⁻⁶")):  # 10^(-0.35 * 8 - 60 / 30 - 0.3)
        assert error in table.partition(setting)[2].partition("</tr>")[0].replace("\u00a0", " ")
    assert not list(mode_table(Results(make("static"))))


def test_learners_stand_in_a_table_with_what_they_learned_from():
    data = make("harmonic")
    data["snapshot_seconds"] = data["snapshot_seconds"].where(data["method"].isin(["pod-galerkin", "mlp"]), 0.0)
    data["learned_cases"] = "entry", np.where(data["method"].values == "mlp", 516240.0, np.nan)
    data["snapshot_source"] = "entry", np.where(data["method"].values == "mlp", "modal-krylov", "direct")
    table = next(learner_table(Results(data))).replace("\u00a0", " ")
    of_pod = table.partition("pod-galerkin")[2].partition("</tr>")[0]
    assert "800" in of_pod and "solved by direct" in of_pod and "0.4 %" in of_pod  # its basis alone: .8 of .5 %
    of_mlp = table.partition("mlp")[2].partition("</tr>")[0]
    assert "516,000" in of_mlp and "solved by modal-krylov" in of_mlp and "70 %" in of_mlp  # at unseen nodes
    assert "not learn from equally many" in table and "modal-static" not in table
    told = one(conclusions(data), "Of the methods that learn")
    assert "pod-galerkin on the published split; none on the hard split" in told


@pytest.mark.parametrize(("offline", "online", "words"), [
    (2.0, 1e-4, "pays back after 65 cases"),  # 2 / (.031 - .0001) = 64.7
    (0.0, 1e-4, "pays back after 1 case"), (2.0, 0.032, "never pays back against direct-reused")])
def test_break_even_of_the_recommended_setting(offline, online, words):
    data = make("static", {k: STATIC[k] for k in ("direct", "direct-reused", "superposition")})
    data["online_seconds"][data["method"].values == "direct-reused"] = 31e-3
    data["online_seconds"][data["method"].values == "superposition"] = online
    data["offline_seconds"][data["method"].values == "superposition"] = offline
    assert words in one(conclusions(data), "Its preparation takes ")


def test_a_bound_that_fails_is_told():
    data = make("harmonic")
    assert 'class="fail"' not in next(bound_table(Results(data)))
    data["effectivity_min"] = data["effectivity_min"].where(data["effectivity_min"].isnull(), 0.7)
    assert 'class="fail"' in next(bound_table(Results(data)))
    assert one(list(failures(Results(data))), "The error bound was below").endswith("modal-static and modal-krylov.")


def test_failures_tell_slow_models_and_omissions():
    table = STATIC | {"transformer": [("", 0.2, 0.3, 0.3, 0.3, 100.0)]}
    sentences = list(failures(Results(make("static", table))))
    assert one(sentences, "No faster than direct-reused").endswith("transformer.")
    assert one(sentences, "Their preparation never pays back").endswith("transformer.")
    assert one(sentences, "Not fitted").endswith("more than the 240 snapshots")


def test_mesh_floor_is_told():
    assert "by up to 6.1 %" in one(conclusions(make("static")), "The mesh itself differs")
