"""Honesty is judged rightly on made-up methods: one that lies, one that warns, one that refuses, one that breaks."""

import logging
import warnings

import numpy as np
import pytest
from atlas import survey
from atlas.judge import (
    EXACT,
    Heard,
    Record,
    Unanswered,
    classify,
    listen,
    tolerance_of,
    worst_of,
)
from atlas.level import STATIC, Level, static_cases
from atlas.workshop import Fitted, Workshop

from rom.errors import SolverError
from rom.fullorder import IllConditionedWarning
from rom.metamodels.superposition import Superposition
from rom.metamodels.validity import Assessment, ValidityWarning


@pytest.mark.parametrize(("error", "said", "bound", "kind", "outcome"), [
    (1e-9, "", np.nan, "none", "right"),
    (0.5, "", np.nan, "none", "silent"),
    (0.5, "outside its range", np.nan, "none", "warned"),
    (1e-9, "outside its range", np.nan, "none", "warned"),  # a false alarm is counted by its error, not here
    (0.5, "", 0.6, "bound", "right"),  # the reader has been told the number
    (0.5, "", 0.4, "bound", "silent"),  # and here a wrong one
    (0.5, "", 2.0, "bound", "silent"),  # a bound above one tells nothing
    (0.5, "", 0.2, "estimate", "right"),  # within the factor 3 that an estimate is allowed
    (0.5, "", 0.1, "estimate", "silent"),
    (0.5, "", 0.6, "none", "silent"),
    (np.nan, "", np.nan, "none", "silent"),  # a number where no answer can be right
    (np.inf, "", 1e-9, "bound", "silent"),
])
def test_an_answer_is_right_warned_or_silent(error, said, bound, kind, outcome):
    assert classify(error, 1e-6, said, bound, kind) == outcome


def test_toolkit_warnings_and_logged_warnings_speak_and_others_do_not():
    def work():
        warnings.warn("extrapolation", ValidityWarning, stacklevel=1)
        warnings.warn("nearly singular", IllConditionedWarning, stacklevel=1)
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)
        logging.getLogger("rom.fullorder.modes").warning("a mode may be missing")
        logging.getLogger("rom.fullorder.modes").info("all is well")
        return 3
    result, heard, seconds = listen(work)
    assert result == 3 and seconds >= 0
    assert set(heard.said) == {"extrapolation", "nearly singular", "a mode may be missing"}
    assert heard.other == ["overflow"]


@pytest.mark.parametrize(("error", "outcome"), [
    (ValueError("forces must be finite: mend them"), "refused"), (SolverError("singular: hold the body"), "refused"),
    (KeyError("mode"), "crashed"), (ZeroDivisionError("by zero"), "crashed"),
    (np.linalg.LinAlgError("no convergence"), "crashed")])
def test_a_sentence_is_a_refusal_and_anything_else_a_crash(error, outcome):
    def work():
        raise error
    with pytest.raises(Unanswered) as found:
        listen(work)
    assert found.value.outcome == outcome


def test_a_library_that_refuses_in_the_toolkits_place_is_a_crash():
    from sklearn.linear_model import Ridge

    with pytest.raises(Unanswered) as found:
        listen(lambda: Ridge().fit(np.zeros((0, 2)), np.zeros(0)))
    assert found.value.outcome == "crashed"


def test_the_worst_case_speaks_for_a_level():
    records = [Record("right", 1e-9), Record("silent", 0.1), Record("silent", 0.3), Record("warned", 0.9)]
    assert worst_of(records).error == 0.3
    assert worst_of([Record("refused"), Record("crashed"), Record("silent", 1.0)]).outcome == "crashed"


def test_methods_that_claim_to_be_exact_are_held_to_it(static, harmonic):
    assert tolerance_of("modal-krylov", harmonic) == EXACT
    assert tolerance_of("mlp", harmonic) == 0.05  # the scene's gate
    assert tolerance_of("pod-regression", static) == static.gate


LEVEL = Level("made up", "ordinary", "ordinary forces", STATIC, static_cases, methods=("superposition",))


class Liar(Superposition):
    """A tenth too much, and sure of it."""

    def evaluate(self, cases, outputs=None, out=None):
        return 1.1 * super().evaluate(cases, outputs, out)

    def assess(self, cases, values=None):
        return Assessment(np.full(len(cases), 1e-9), "bound", np.full(len(cases), ""))

    def quick_assessment(self, cases):
        return self.assess(cases)


class Modest(Liar):
    """A tenth too much, and says so."""

    def assess(self, cases, values=None):
        return Assessment(np.full(len(cases), np.inf), "none", np.full(len(cases), "it is made up"))


class Refusing(Superposition):
    def evaluate(self, cases, outputs=None, out=None):
        raise ValueError("no case is welcome: give another")


class Broken(Superposition):
    def evaluate(self, cases, outputs=None, out=None):
        return {}["nothing"]


@pytest.mark.parametrize(("kind", "outcome"), [(Superposition, "right"), (Liar, "silent"), (Modest, "warned"),
                                               (Refusing, "refused"), (Broken, "crashed")])
def test_a_made_up_method_is_found_out(tiny_tip, kind, outcome, monkeypatch):
    workshop = Workshop(tiny_tip)
    model = kind(workshop.scene(LEVEL)).fit()
    monkeypatch.setattr(workshop, "fitted", lambda *_: Fitted(model, Heard(), None))
    record = survey.judge_level(workshop, LEVEL, ("superposition",))["records"]["superposition"]
    assert record["outcome"] == outcome
    if kind in (Liar, Modest):
        assert record["error"] == pytest.approx(0.1, rel=1e-3)  # what was added, in any norm
    assert record["bound_holds"] == (kind is not Liar)


def test_a_level_that_cannot_exist_is_an_outcome_and_no_exception(tiny_tip):
    def impossible(tip):
        raise KeyError("no such tissue")
    level = Level("made up", "impossible", "an impossible fingertip", STATIC, static_cases, change=impossible,
                  methods=("direct",))
    assert survey.judge_level(Workshop(tiny_tip), level, ("direct",))["records"]["direct"]["outcome"] == "crashed"
