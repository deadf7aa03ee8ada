"""Coarse fingers and paths, followed once for all tests of the section."""

import sys
from pathlib import Path

import pytest

from rom.finger_on_glass.finger import Finger
from rom.finger_on_glass.path import LoadPath, follow
from rom.finger_on_glass.tissue import VARIANTS, Tissue

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))  # what experiments alone need is tested here too

SLIDING = LoadPath((0.1, 0.2, 0.3, 0.4, 0.5), (0.5, 1.0, 2.0, 3.0, 4.0))


def coarse(variant="radial", **changes):
    return Finger(tissue=changes.pop("tissue", Tissue(variant)), rays=40, layers=4, **changes)


@pytest.fixture(scope="session", name="coarse")
def _coarse():
    """Makes a finger of 160 elements."""
    return coarse


@pytest.fixture(scope="session", params=VARIANTS)
def walked(request):
    """(finger, answer, every step) of each variant, pressed with .5 N and slid 4 mm."""
    finger = coarse(request.param)
    steps = []
    return finger, follow(finger, SLIDING, on_step=steps.append), steps
