import numpy as np
import pytest
import xarray as xr

from rom.finger_on_glass.path import LoadPath, PathAnswer, follow
from rom.finger_on_glass.record import recorded, settings
from rom.finger_on_glass.tissue import Tissue


def test_everything_is_recorded_in_si_units(walked, tmp_path):
    finger, answer, _ = walked
    data = recorded(finger, answer)
    assert data.sizes["position"] == len(answer.observations)
    last = answer.last
    assert float(data["tangential_displacement"][-1]) == pytest.approx(1e-3 * last.tangential_displacement)
    assert float(data["area"][-1]) == pytest.approx(1e-6 * last.area)
    assert data["pressure"].max() == pytest.approx(1e6 * max(o.pressure.max() for o in answer.observations))
    assert float(data["work"][-1]) == pytest.approx(1e-3 * last.work)
    for name in [*data.data_vars, "node_x", "node_y"]:
        assert {"units", "long_name"} <= set(data[name].attrs)
    assert data.attrs["complete"] == 1
    assert data.attrs["tissue.variant"] == finger.tissue.variant
    data.to_netcdf(tmp_path / "path.nc")
    with xr.open_dataset(tmp_path / "path.nc") as again:
        xr.testing.assert_equal(again.load(), data)


def test_what_an_unfinished_path_reached_is_kept(coarse):
    finger = coarse(tissue=Tissue("radial"))
    whole = follow(finger, LoadPath((0.1, 0.2)))
    cut = recorded(finger, PathAnswer(whole.observations[:1], whole.last, False, "it ends here"))
    assert (cut.attrs["complete"], cut.attrs["reason"]) == (0, "it ends here")
    assert cut["normal_force"].values == pytest.approx([0.1, 0.2])
    nothing = recorded(finger, PathAnswer([], None, False, "it never began"))
    assert nothing.sizes["position"] == 0
    assert nothing["displacement"].shape == (0, 200, 2)


def test_settings_name_every_assumption(coarse):
    names = settings(coarse())
    assert {"section.bone_offset", "out_of_plane.stiffness", "out_of_plane.effective_length", "tissue.seed",
            "plate.normal_stiffness", "rays"} <= set(names)
    assert all(isinstance(value, str | int | float | np.integer) for value in names.values())
