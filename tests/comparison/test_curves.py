"""Which settings are compared: every method that applies, one headline each, refusals with their reason."""

import pytest

from rom.comparison import COMPARED, chosen_curves, compare, scene_of
from rom.comparison.entries import entries_of, label
from rom.metamodels import applicable, create, method_names
from rom.metamodels.networks.sizes import constructor_settings
from rom.scenes import get_scene

SCENES = ("static-point-forces", "harmonic-point-force", "harmonic-patch-forces", "finger-on-glass")


@pytest.fixture(scope="module")
def scenes(scene_of):
    return {**scene_of, "finger-on-glass": get_scene("finger-on-glass", rays=24, layers=3)}


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", SCENES)
def test_every_method_that_applies_is_compared_and_the_others_say_why(scenes, name, quick):
    reasons = applicable(scenes[name])
    assert set(chosen_curves(scenes[name], None, quick)) == {method for method, why in reasons.items() if why is None}
    assert set(reasons) == set(method_names())
    assert all(why is None or len(why) > 20 for why in reasons.values())


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", SCENES)
def test_settings_exist_and_labels_differ(scenes, name, quick):
    scene = scenes[name]
    for method, curve in chosen_curves(scene, None, quick).items():
        for settings in curve.settings:
            create(method, scene, **constructor_settings(method, settings))  # refuses what it does not know
        assert -len(curve.settings) <= curve.headline < len(curve.settings)
        labels = [label(method, settings) for settings in curve.settings]
        assert len(set(labels)) == len(labels)


def test_full_order_methods_always_join_as_the_baseline(static, harmonic, scenes):
    assert set(chosen_curves(static, ["superposition"], True)) == {"direct", "direct-reused", "superposition"}
    assert set(chosen_curves(scenes["finger-on-glass"], ["mlp"], True)) == {"direct", "mlp"}
    entries = entries_of(harmonic, chosen_curves(harmonic, None, False))
    assert [entry.method for entry in entries if entry.kind.full_order] == ["direct", "direct-reused"]
    for method in {entry.method for entry in entries}:
        assert sum(entry.headline for entry in entries if entry.method == method) == 1


@pytest.mark.parametrize("name", COMPARED)
def test_the_published_cases_and_seeds_are_the_defaults(name):
    # 6 x 239 cases of the linear scenes and 240 load paths: what the committed reports were made with
    extent = scene_of(name, quick=True).extent
    assert (extent.seed, extent.cases, extent.beyond(extent.cases)) == (
        (4817, 240, 24) if name == "finger-on-glass" else (2026, 1434, 143))


@pytest.mark.parametrize(("name", "methods", "message"), [
    ("static-point-forces", ["superposition", "magic"], "'magic' is no method: choose from direct"),
    ("static-point-forces", ["modal"], "modal does not apply to static-point-forces: a static answer has no resonance"),
    ("harmonic-point-force", ["superposition"], "superposition does not apply to harmonic-point-force"),
    ("harmonic-point-force", [""], "'' is no method")])
def test_impossible_choices_are_refused(scenes, name, methods, message):
    with pytest.raises(ValueError, match=message):
        chosen_curves(scenes[name], methods, True)


def test_what_is_no_scene_is_refused():
    with pytest.raises(ValueError, match="'four words of nonsense' is no scene"):
        compare("four words of nonsense", quick=True)


def test_a_scene_with_a_body_takes_no_fingertip(static, small_tip):
    with pytest.raises(ValueError, match="has a body of its own: leave the fingertip out"):
        compare(static, fingertip=small_tip)


@pytest.mark.parametrize("cases", [0, 9, -5])
def test_too_few_cases_are_refused(small_tip, cases):
    with pytest.raises(ValueError, match=f"{cases} cases are too few"):
        compare("static-point-forces", cases=cases, quick=True, fingertip=small_tip)


def test_too_few_load_paths_are_refused():
    with pytest.raises(ValueError, match=r"14 load paths are too few .* ask for 15 or more"):
        compare("finger-on-glass", cases=14, quick=True)
