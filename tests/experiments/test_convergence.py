"""Extrapolation on sequences whose limit and order are known, and a ladder of meshes that grows evenly."""

import itertools
import subprocess

import numpy as np
import pytest
from analysis import mesh_ladder
from analysis.convergence import extrapolate
from analysis.mesh_ladder import LADDER, QUICK_LADDER, modes_on, node_count

from rom.errors import SolverError
from rom.fingertip import PRESETS, Fingertip
from rom.fullorder import natural_modes

WIDTH = np.array([1.0, 0.8, 0.63, 0.5, 0.4])


@pytest.mark.parametrize("order", [1.0, 2.0, 3.7])
@pytest.mark.parametrize("count", [3, 5])
def test_a_power_law_is_recovered(order, count):
    found = extrapolate(WIDTH[:count], 120 + 7 * WIDTH[:count] ** order)
    assert found.order == pytest.approx(order, rel=1e-4) and found.limit == pytest.approx(120, rel=1e-6)
    fixed = extrapolate(WIDTH[:count], 120 + 7 * WIDTH[:count] ** order, order=order)
    assert fixed.limit == pytest.approx(120) and fixed.misfit < 1e-10


def test_three_halvings_against_the_closed_form():
    # Roache: p = log2((f1 - f2) / (f2 - f3)), f_0 = f3 + (f3 - f2) / (2^p - 1)
    f = np.array([131.0, 123.0, 120.5])
    p = np.log2((f[0] - f[1]) / (f[1] - f[2]))
    found = extrapolate([4.0, 2.0, 1.0], f)
    assert found.order == pytest.approx(p, rel=1e-6)
    assert found.limit == pytest.approx(f[2] + (f[2] - f[1]) / (2**p - 1))


def test_scatter_shows_no_order():
    assert np.isnan(extrapolate(WIDTH, [120.0, 121.0, 119.5, 121.2, 119.8]).order)


@pytest.mark.parametrize(("width", "value"), [
    ([1.0, 0.5], [1.0, 2.0]), ([1.0, 1.0, 0.5], [1.0, 2.0, 3.0]), ([1.0, 0.5, -0.1], [1.0, 2.0, 3.0]),
    ([1.0, 0.5, 0.2], [1.0, np.nan, 3.0])])
def test_what_cannot_be_extrapolated(width, value):
    with pytest.raises(ValueError):
        extrapolate(width, value)


def test_the_ladder_grows_evenly():
    nodes = np.array([node_count(density) for density in LADDER])
    assert PRESETS["study"] in LADDER
    assert nodes[0] < 2500 and nodes[-1] >= 60_000
    ratio = nodes[1:] / nodes[:-1]
    assert np.all(np.abs(ratio / 1.5 - 1) < 0.06)
    for ladder in (LADDER, QUICK_LADDER):
        for a, b in itertools.pairwise(ladder):
            counts = [(*d.cap, d.front_rings, d.rear_rings, *d.layers) for d in (a, b)]
            assert all(y >= x for x, y in zip(*counts, strict=True))  # no direction gets coarser
    assert node_count(PRESETS["study"]) == Fingertip.preset("study").mesh.n_nodes


def test_a_rung_is_computed_once_and_kept(monkeypatch, tiny_tip):
    found = modes_on(tiny_tip, QUICK_LADDER[0], 5)
    # independent: here and now, without another process
    expected = natural_modes(tiny_tip.stiffness, tiny_tip.mass, count=5).frequency_hz
    assert np.allclose(found["natural_frequency"], expected, rtol=1e-9)
    assert found["nodes"] == tiny_tip.mesh.n_nodes and found["seconds"] > 0
    assert 1e7 < found["peak_memory"] < 4e9 or np.isnan(found["peak_memory"])
    monkeypatch.setattr(mesh_ladder.subprocess, "run", lambda *_, **__: pytest.fail("computed again"))
    assert modes_on(tiny_tip, QUICK_LADDER[0], 5).identical(found)


def test_a_process_that_dies_is_told(monkeypatch, tiny_tip):
    dead = subprocess.CompletedProcess([], -9, "", "")
    monkeypatch.setattr(mesh_ladder.subprocess, "run", lambda *_, **__: dead)
    with pytest.raises(SolverError, match="not enough memory"):
        modes_on(tiny_tip, QUICK_LADDER[0], 4)
