"""Which settings are compared: every method that applies, one headline each, refusals with their reason."""

import pytest
from rom.comparison.settings import COMPARED, CURVES, NOT_APPLICABLE, QUICK_CURVES, constructor_settings, label

from rom.comparison.side_by_side import chosen_curves, compare
from rom.metamodels import METHODS, applicable, create
from rom.metamodels.registry import CONTACT_METHODS
from rom.scenes import CONTACT_SCENES, get_scene


@pytest.mark.parametrize("curves", [CURVES, QUICK_CURVES], ids=["full", "quick"])
@pytest.mark.parametrize("name", COMPARED)
def test_every_method_that_applies_is_compared_and_the_others_say_why(curves, name):
    assert set(curves[name]) == set(applicable(name))
    known = set(METHODS) | (set(CONTACT_METHODS) if name in CONTACT_SCENES else set())
    assert set(NOT_APPLICABLE[name]) == known - set(applicable(name))


@pytest.mark.parametrize("curves", [CURVES, QUICK_CURVES], ids=["full", "quick"])
@pytest.mark.parametrize("name", COMPARED)
def test_settings_exist_and_labels_differ(curves, name, small_tip):
    scene = get_scene(name, rays=24, layers=3) if name in CONTACT_SCENES else get_scene(name, small_tip)
    for method, curve in curves[name].items():
        for settings in curve.settings:
            create(method, scene, **constructor_settings(method, settings))  # refuses what it does not know
        assert -len(curve.settings) <= curve.headline < len(curve.settings)
        labels = [label(method, settings) for settings in curve.settings]
        assert len(set(labels)) == len(labels)


def test_direct_always_joins_as_the_baseline():
    assert set(chosen_curves("static-point-forces", ["superposition"], True)) == {"direct", "superposition"}
    assert set(chosen_curves("harmonic-point-force", None, False)) == set(CURVES["harmonic-point-force"])


@pytest.mark.parametrize(("scene", "methods", "message"), [
    ("four words of nonsense", None, "'four words of nonsense' is no scene"),
    ("harmonic-patch-forces", None, "is no scene that is compared: choose one of static-point-forces, harmonic-point"),
    ("static-point-forces", ["superposition", "magic"], "'magic' is no method: choose from direct"),
    ("static-point-forces", ["modal"], "modal does not apply to static-point-forces: a static answer has no resonance"),
    ("harmonic-point-force", ["superposition"], "superposition does not apply to harmonic-point-force"),
    ("harmonic-point-force", [""], "'' is no method")])
def test_impossible_choices_are_refused(scene, methods, message):
    with pytest.raises(ValueError, match=message):
        chosen_curves(scene, methods, True)


@pytest.mark.parametrize("cases", [0, 9, -5])
def test_too_few_cases_are_refused(small_tip, cases):
    with pytest.raises(ValueError, match=f"{cases} cases are too few"):
        compare("static-point-forces", cases=cases, quick=True, fingertip=small_tip)
