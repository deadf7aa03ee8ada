"""Sentences follow the numbers: change the numbers and the sentences change."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_results import HARMONIC, STATIC, make

from rom.reporting import conclusions, verdict
from rom.reporting.failures import failures
from rom.reporting.results import Results


def one(sentences: list[str], start: str) -> str:
    found = [s for s in sentences if s.startswith(start)]
    assert len(found) == 1, sentences
    return found[0]


def test_the_cheapest_passing_setting_is_recommended():
    sentences = conclusions(make("static"))
    assert sentences[0].startswith("Cheapest within 1 % on both splits: superposition, ")
    assert verdict(make("static")) == sentences[0]


def test_the_recommendation_changes_with_the_method_that_passes():
    table = STATIC | {"superposition": [("", 7e-5, 0.3, 0.3, 0.3, 8.0)],
                      "transformer": [("", 1e-3, 1e-3, 2e-3, 2e-3, 160.0)]}
    sentences = conclusions(make("static", table))
    assert sentences[0].startswith("Cheapest within 1 % on the published split: pod-galerkin (rank=239), ")
    assert sentences[1].startswith("Cheapest within 1 % on the hard split: transformer, ")
    assert "superposition with 30 % (30 times the gate)" in one(sentences, "Outside 1 % on the published split")


def test_splits_are_told_apart():
    table = {k: HARMONIC[k] for k in ("direct", "pod-galerkin")}
    sentences = conclusions(make("harmonic", table))
    assert sentences[0].startswith("Cheapest within 5 % on the published split: pod-galerkin (rank=256)")
    assert sentences[1].startswith("No method stays within 5 % on the hard split: only direct can be trusted")
    assert one(sentences, "Speed-up over direct at 5 % on the hard split").endswith("not reached.")


def test_speed_at_the_gate_uses_the_fastest_passing_entry():
    data = make("harmonic")
    passing = (data["error_max"].sel(split="published") <= 0.05) & (data["method"] != "direct")
    best = int(data["speedup"].where(passing).max())
    text = one(conclusions(data), "Speed-up over direct at 5 % on the published split")
    assert f"{float(f'{best:.3g}'):,.0f} × for one full field (modal-krylov)" in text


def test_plain_modal_is_named_bad_with_its_reason():
    text = one(conclusions(make("harmonic")), "Plain modal superposition with the 11 modes below 300 Hz")
    assert "off by up to 93 %" in text
    assert "quasi-statically" in text
    assert "100 modes still leave 40 %" in text
    assert "modal-krylov" in text


def test_fewer_modes_than_in_the_band_are_no_remedy():
    table = HARMONIC | {"modal": [("modes=6", 4e-5, 0.99, 1.5, 0.99, 3.0), ("", 5e-5, 0.93, 1.4, 0.95, 4.0)]}
    text = one(conclusions(make("harmonic", table)), "Plain modal superposition with the 11 modes below 300 Hz")
    assert "still leave" not in text


def test_plain_modal_is_not_blamed_when_it_is_good():
    good = make("harmonic", HARMONIC | {"modal": [("modes=11", 5e-5, 0.01, 0.02, 0.01, 4.0)]})
    text = one(conclusions(good), "Plain modal superposition")
    assert "within the gate" in text
    assert "quasi-statically" not in text


def test_networks_lose_or_win_by_the_numbers():
    text = one(conclusions(make("harmonic")), "mlp (width=256)")
    assert "it loses to modal-krylov" in text
    assert "in error and time" in text
    assert "At nodes kept from training it reaches 70 %" in text
    table = {k: HARMONIC[k] for k in ("direct", "modal")} | {"mlp": [("width=256", 1e-5, 0.01, 0.02, 0.02, 220.0)]}
    assert "it beats modal" in one(conclusions(make("harmonic", table)), "mlp (width=256) is off")
    table["mlp"] = [("width=256", 1e-2, 0.01, 0.02, 0.02, 220.0)]
    text = one(conclusions(make("harmonic", table)), "mlp (width=256) is off")
    assert "more accurate than modal (modes=100), but slower" in text


def test_pod_at_unseen_nodes():
    text = one(conclusions(make("harmonic")), "pod-galerkin (rank=256) is off")
    assert "33 % at unseen nodes: a POD basis does not carry over" in text
    assert "even the best combination" in text
    table = HARMONIC | {"pod-galerkin": [("rank=256", 3e-4, 0.005, 0.006, 0.006, 95.0)]}
    text = one(conclusions(make("harmonic", table)), "pod-galerkin (rank=256) is off")
    assert "carries over to unseen loads" in text
    table = HARMONIC | {"pod-galerkin": [("rank=20", 3e-4, 0.42, 0.65, 0.65, 95.0)]}
    assert "too small for either" in one(conclusions(make("harmonic", table)), "pod-galerkin (rank=20) is off")


@pytest.mark.parametrize(("needed", "words"), [(55.2, "pays back after 56 answers"), (np.inf, "never pays back"),
                                               (0.0, "pays back with the first answer")])
def test_break_even_of_the_recommended_setting(needed, words):
    data = make("static")
    data["break_even_cases"][:] = needed
    assert words in one(conclusions(data), "superposition costs 8 s offline")


def test_a_bound_that_fails_is_told():
    data = make("harmonic")
    assert "did it promise too much" in one(conclusions(data), "The error bound of modal-krylov")
    data["effectivity_min"] = data["effectivity_min"].where(data["effectivity_min"].isnull(), 0.7)
    assert "it was not a bound in every case" in one(conclusions(data), "The error bound of modal-krylov")
    assert one(failures(Results(data)), "The error bound was below").endswith("modal-static and modal-krylov.")


def test_failures_tell_slow_models_and_omissions():
    table = STATIC | {"transformer": [("", 0.2, 0.3, 0.3, 0.3, 100.0)]}
    sentences = failures(Results(make("static", table)))
    assert one(sentences, "No faster than direct").endswith("transformer.")
    assert one(sentences, "Their preparation never pays back").endswith("transformer.")
    assert one(sentences, "Not fitted").endswith("more than the 240 snapshots")


def test_mesh_floor_is_told():
    assert "2.8 % in the median and 6.1 % at most" in one(conclusions(make("static")), "The mesh itself differs")
