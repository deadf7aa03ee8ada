"""The fit of the surfaces: exact slopes, a known shape found again, bad questions refused."""

import numpy as np
import pytest
from analysis.surface_fit import FAMILY, LABELS, TOLERANCE, Facts, characteristics, fit_surface, residuals

from rom.errors import AnatomyError
from rom.fingertip import Anatomy, MeshDensity

COARSE = MeshDensity((6, 6), 3, 3, (1, 1, 1, 1))
NO_CORRECTION = (np.ones((2, len(LABELS))), 1.0)
NAMES = ("lower_exponent", "nail_bed_thickness")


def at(**changes):
    return characteristics(Anatomy().replace_shape(**changes), COARSE, NAMES)


@pytest.fixture(scope="module")
def here():
    return at()


def facts_of(found):
    row = dict(zip(LABELS, found.frequency[0], strict=True))
    return Facts(found.volume, {"mode_1": row["A1"], "mode_2": row["S1"], "mode_4_about": row["S2"],
                                "mode_7": row["A4"], "mode_8": min(row["A5"], row["S4"])},
                 {**TOLERANCE, "plain": 1e6}, ("order_free", "order_fixed"))


def test_slopes_of_residuals_are_those_of_differences(here):
    # central differences of residuals of re-solved models, along one direction in the family
    facts, x = Facts.published(), np.array([getattr(Anatomy().shape, name) for name in NAMES])
    direction, step = np.array([1.0, -0.5]), 1e-4
    ends = []
    for sign in (-1, 1):
        moved = x + sign * step * direction
        found = at(**dict(zip(NAMES, map(float, moved), strict=True)))
        ends.append(residuals(found, facts, NO_CORRECTION, NAMES, moved)[0])
    slope = residuals(here, facts, NO_CORRECTION, NAMES, x)[1] @ direction
    difference = (ends[1] - ends[0]) / (2 * step)
    np.testing.assert_allclose(slope, difference, atol=1e-4 * np.abs(difference).max())


def test_a_known_shape_is_found_again():
    # facts are those of a shape of the family itself, so that the least residual is zero
    wanted = {"lower_exponent": 3.0, "nail_bed_thickness": 2.3}
    facts = facts_of(at(**wanted))
    start = {name: getattr(Anatomy().shape, name) for name in NAMES}
    fit = fit_surface(facts, COARSE, NO_CORRECTION, start=start, evaluations=12)
    assert fit.cost < 1e-2  # each fact within a tenth of its unit
    for name, value in wanted.items():
        assert fit.shape[name] == pytest.approx(value, abs=0.01 * FAMILY[name].spread)


def test_a_fact_left_out_adds_no_residual(here):
    x = np.array([getattr(Anatomy().shape, name) for name in NAMES])
    every = residuals(here, Facts.published(), NO_CORRECTION, NAMES, x)[0]
    fewer = residuals(here, Facts.published().without("mode_7", "order_fixed"), NO_CORRECTION, NAMES, x)[0]
    assert len(every) - len(fewer) == 1 + 4  # one frequency, four pairs of neighbours


def test_the_order_costs_only_what_is_missing(here):
    swapped = here.frequency.copy()
    swapped[0, [LABELS.index("S1"), LABELS.index("A2")]] = 170.0, 160.0
    facts, x = Facts.published(), np.array([getattr(Anatomy().shape, name) for name in NAMES])
    apart = here.frequency.copy()
    apart[0, [LABELS.index("S1"), LABELS.index("A2")]] = 160.0, 170.0
    first = 6  # volume and five frequencies stand before the order
    bad, good = (residuals(type(here)(f, here.volume, here.slope, here.volume_slope), facts, NO_CORRECTION, NAMES, x)[0]
                 for f in (swapped, apart))
    assert bad[first] == pytest.approx((0.015 - np.log(160 / 170)) / TOLERANCE["order"])
    assert good[first] == 0.0


def test_impossible_questions_are_refused():
    with pytest.raises(ValueError, match="mode_9 is no fact: choose among"):
        Facts.published().without("mode_9")
    with pytest.raises(AnatomyError):  # a bone as wide as the finger leaves no room to begin with
        fit_surface(Facts.published(), COARSE, NO_CORRECTION, anatomy=Anatomy().replace(bone_distal_width=17.5))
