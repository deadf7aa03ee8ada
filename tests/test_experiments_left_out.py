"""The worker of the experiment on what is left out, and its page, from one scene alone."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import left_out

from rom.fingertip.fingertip import PRESETS
from rom.fingertip import MeshDensity


@pytest.fixture(scope="module")
def results():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(left_out, "EXTRAS", {"static-point-forces": left_out.EXTRAS["static-point-forces"]})
        patch.setattr(left_out, "EXTRAS", {"static-point-forces": ("mass", "figures")})
        patch.setattr(left_out, "MODULES", ("rom",))
        patch.setitem(PRESETS, "quick", MeshDensity((4, 4), 1, 1, (1, 1, 1, 1)))
        found = left_out.main(quick=True)
        return found, left_out.findings(found), left_out.tables(found)


def test_each_thing_more_costs_more(results):
    found, sentences, tables = results
    middle = left_out.medians(found).isel(scene=0)
    assert middle["modules"].sel(way="figures") > middle["modules"].sel(way="lean")
    assert middle["peak_bytes"].sel(way="everything") > middle["peak_bytes"].sel(way="lean")
    assert middle["seconds"].sel(way=["modes", "complex", "torch"]).isnull().all()  # not among this run's ways
    assert "MB" in sentences[0] and "only what the scene needs" in tables[0]
    assert len(left_out.draw(found)) == 1
