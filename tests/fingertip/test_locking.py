"""Full integration is doubted where it locks, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from rom.fingertip import Fingertip
from rom.fingertip.locking import locking_reason
from rom.fullorder import SecondOrderModel
from rom.metamodels import create
from rom.metamodels.validity import ValidityWarning
from rom.scenes import CaseArrays, get_scene


def with_ratio(tip, ratio):
    return replace(tip, anatomy=tip.anatomy.replace_tissue("dermis", poisson_ratio=ratio))


def test_b_bar_never_locks_and_the_published_study_is_not_doubted():
    study = Fingertip.preset("study")
    assert locking_reason(with_ratio(study, 0.4999)) == ""
    assert locking_reason(replace(study, formulation="full")) == ""  # as published, Poisson's ratio .48


def test_full_integration_near_incompressibility_is_doubted():
    study = Fingertip.preset("study", formulation="full")
    assert "0.4999" in locking_reason(with_ratio(study, 0.4999))


def test_a_coarse_mesh_locks_sooner_and_its_answers_say_so(tiny_tip):
    scene = get_scene("static-point-forces", replace(tiny_tip, formulation="full"))
    cases = scene.cases_from(CaseArrays(np.zeros((1, 1), dtype=int), np.ones((1, 1))))
    with pytest.warns(ValidityWarning, match="locks"):
        answer = create("direct", scene).fit().predict(cases)
    assert "coarse" in str(answer["validity"].values[0])


def test_matrices_in_single_precision_are_refused(tiny_tip):
    # condition about 1e7 times the roundoff 6e-8 of single precision: no digit would be sure
    with pytest.raises(ValueError, match="double precision"):
        SecondOrderModel(tiny_tip.stiffness.astype(np.float32))
