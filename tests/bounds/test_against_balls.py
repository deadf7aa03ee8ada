"""No bound is broken on small adversarial models, whose truth is known in ball arithmetic; and a broken one is seen."""

import collections
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

import check_bounds

from rom.metamodels.energy_form import EnergyForm
from rom.metamodels.modal_bound import ModalBound
from rom.metamodels.residual_bound import ResidualBound

FIRST, MODELS = 10_000, 200


@pytest.fixture(scope="module")
def verdicts():
    found = [check_bounds.check(seed, largest=9, count=2)[0] for seed in range(FIRST, FIRST + MODELS)]
    return [one for some in found for one in some]


def test_no_bound_is_broken(verdicts):
    assert not [one for one in verdicts if one.broken]


def test_every_method_that_bounds_is_met(verdicts):
    count = collections.Counter(one.method.split(",")[0] for one in verdicts)
    expected = {"superposition", "modal", "modal-static", "modal-krylov"}
    assert {*expected, *(f"{name} float32" for name in expected), "residual"} == set(count)
    assert min(count.values()) > 50


def test_most_bounds_say_something(verdicts):
    # undamped cases at a resonance, forces that cancel to nothing and hopelessly scaled models have none
    finite = sum(one.bound < 1 for one in verdicts if one.error < 0.1)
    assert finite > 0.8 * sum(one.error < 0.1 for one in verdicts)


@pytest.mark.parametrize("spoilt", [(ModalBound, "bounds"), (ResidualBound, "bound"), (EnergyForm, "norms")])
def test_a_bound_that_is_too_small_is_seen(monkeypatch, spoilt):
    """Half of every bound: truncation makes errors that come near the whole."""
    owner, name = spoilt
    whole = getattr(owner, name)
    half = {"bounds": lambda *a: (0.5 * whole(*a)[0], whole(*a)[1]), "bound": lambda *a: 0.5 * whole(*a),
            "norms": lambda *a: tuple(0.5 * norm for norm in whole(*a))}[name]
    monkeypatch.setattr(owner, name, half)
    assert any(one.broken for seed in range(FIRST, FIRST + 12) for one in check_bounds.check(seed, 9, 2)[0])
