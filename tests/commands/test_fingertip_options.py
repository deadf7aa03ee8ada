"""Options that choose a fingertip: what they set, and one sentence for what they refuse."""

import argparse

import pytest

from rom.commands.fingertip_options import add_fingertip_options, changed_anatomy, fingertip_from
from rom.fingertip import PRESETS, Anatomy, Fingertip


def parsed(*words, **defaults):
    parser = argparse.ArgumentParser()
    add_fingertip_options(parser, **defaults)
    return fingertip_from(parser.parse_args(words))


def test_defaults_are_the_studys_free_fingertip():
    assert parsed() == Fingertip.preset("study")
    assert parsed(formulation="full", preset="metamodel") == Fingertip.preset("metamodel", formulation="full")


def test_every_option_reaches_the_fingertip():
    tip = parsed("--preset", "metamodel", "--formulation", "full", "--rear", "fixed", "--set", "dermis_thickness=1.2",
                 "--set", "dermis.elastic_modulus=0.1", "--set", "shape.bone_axis_rise=0.8")
    assert (tip.density, tip.formulation, tip.rear) == (PRESETS["metamodel"], "full", "fixed")
    by_hand = Anatomy().replace(dermis_thickness=1.2).replace_tissue("dermis", elastic_modulus=0.1)
    assert tip.anatomy == by_hand.replace_shape(bone_axis_rise=0.8)


def test_only_the_outcome_of_all_changes_must_be_possible():
    # a longer bone alone would not fit into the default fingertip
    changed = changed_anatomy(Anatomy(), ["bone_length=30", "fingertip_length=36"])
    assert (changed.bone_length, changed.fingertip_length) == (30, 36)
    with pytest.raises(ValueError, match="Anatomy cannot exist"):
        changed_anatomy(Anatomy(), ["bone_length=30"])


@pytest.mark.parametrize(("change", "words"), [
    ("dermis_thickness", "needs NAME=VALUE"),
    ("=1.2", "needs NAME=VALUE"),
    ("dermis_thickness=", "needs NAME=VALUE"),
    ("dermis_thickness=thick", "needs a finite number"),
    ("dermis_thickness=nan", "needs a finite number"),
    ("dermis_thicknes=1.2", "did you mean dermis_thickness"),
    ("dermis=1.2", "dermis.elastic_modulus"),
    ("dermis.modulus=1.2", "dermis.elastic_modulus"),
    ("shape.rise=1", "shape.bone_axis_rise"),
    ("dermis_thickness.x=1", "did you mean"),
    ("nonsense=1", "choose among"),
    ("dermis.poisson_ratio=0.5", "-1 < nu < 0.5"),
    ("dermis_thickness=-1", "dermis_thickness=-1.0 cannot be")])
def test_what_is_refused(change, words):
    with pytest.raises(ValueError) as refusal:
        changed_anatomy(Anatomy(), [change])
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_a_name_given_twice():
    with pytest.raises(ValueError, match="twice"):
        changed_anatomy(Anatomy(), ["dermis_thickness=1", "dermis_thickness=2"])


@pytest.mark.parametrize(("words", "known"), [(["--preset", "huge"], "study"), (["--rear", "loose"], "fixed"),
                                              (["--formulation", "magic"], "b-bar")])
def test_unknown_choices_name_the_known_ones(words, known):
    with pytest.raises(ValueError, match=known):
        parsed(*words)
