"""The reduced finger against the full one: exact where nothing is left out, lawful where something is."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from rom.datasets.schema import dataset_attributes
from rom.finger_on_glass.contact import Glass
from rom.finger_on_glass.equilibrium import solve_step
from rom.finger_on_glass.finger import Finger
from rom.finger_on_glass.tissue import Tissue
from rom.metamodels import load
from rom.metamodels.finger_on_glass.galerkin import PathGalerkin
from rom.metamodels.finger_on_glass.hyper_reduction import (
    ReducedSpace,
    displacement_shares,
    orthonormal,
    pressure_modes,
    principal_directions,
    reduce,
    sampled,
    sparse_weights,
    supremizers,
)
from rom.metamodels.finger_on_glass.reduced_equations import assemble, volumes
from rom.metamodels.finger_on_glass.reduced_finger import Constants, Contact
from rom.metamodels.finger_on_glass.reduced_path import Controls, history_of, reduced_step
from rom.scenes.finger_on_glass import FingerOnGlass
from rom.scenes.paths import PathArrays

SCENE = FingerOnGlass(rays=28, layers=3)
TIGHT = Controls(1e-9, 1e-10)


def paths_of(variant: int, count: int, seed: int) -> PathArrays:
    drawn = SCENE.sample(3 * count, seed)
    return drawn.take(drawn.variant == variant)


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    """Eight paths of the radial and of the random variant, solved by the full model."""
    paths = paths_of(0, 8, 3).joined(paths_of(2, 8, 3))
    answers, record = SCENE.solve(paths)
    data = SCENE.label(SCENE.cases_from(paths), answers)
    data["reached"] = (("case", "position"), record["reached"])
    data.attrs = dataset_attributes(SCENE)
    return data


@pytest.fixture(scope="module")
def learned(truth) -> PathGalerkin:
    return PathGalerkin(SCENE, rank=16, pressure_rank=6, sampling=2e-3).fit(truth.isel(case=HELD_IN))


HELD_IN, HELD_OUT = [*range(6), *range(8, 14)], [6, 7, 14, 15]


def everything(finger: Finger) -> ReducedSpace:
    """Every displacement and every element's pressure is a mode."""
    n = 2 * len(finger.mesh.nodes)
    free = finger.free_rows[finger.free_rows < n]
    return ReducedSpace(np.eye(n)[:, free], np.diag(finger.element_volume**-0.5), np.arange(finger.rays))


@pytest.mark.parametrize("variant", ["radial", "random"])
def test_is_exact_where_nothing_is_left_out(variant):
    finger = Finger(tissue=Tissue(variant), plate=Glass(friction=0.8), rays=18, layers=3)
    space, t = everything(finger), finger.tissue
    small = reduce(finger, space)
    constants = Constants(t.c, t.k1, t.k2, t.bulk, 100.0, 0.8, 20.0, 5.0)
    state, no = finger.at_rest(), np.zeros(finger.rays, bool)
    history = Contact(state.contact.gap, np.zeros(finger.rays), np.zeros(finger.rays), no, no)
    q, z, y, x, s = np.zeros(small.drag.shape[0]), 1.0, finger.lowest, 0.0, np.zeros(len(small.volume))
    # touch, press, press on, slide with sticking nodes, slide on
    for control in ({"plate_y": finger.lowest + 0.02}, {"normal_force": 0.01}, {"normal_force": 0.015},
                    {"normal_force": 0.015, "plate_x": 0.1}, {"normal_force": 0.015, "plate_x": 0.3}):
        full = solve_step(finger, state, **control)
        held, to = "plate_y" in control, control.get("plate_x", x)
        code, _, q, z, y, s, contact, largest = reduced_step(
            small, constants, TIGHT, history, q, z, control.get("plate_y", y), x, s, held,
            control.get("normal_force", 0.0), to, 0.0)
        assert code == 0
        state, history, x = full.state, history_of(contact), to
        np.testing.assert_allclose(space.vectors @ q, state.displacement.ravel(), atol=1e-6)  # the goal that was set
        np.testing.assert_allclose((z, y), (state.stretch_z, state.plate_y), atol=1e-6)
        np.testing.assert_allclose(space.pressures @ s, state.pressure, atol=1e-6 * t.bulk)
        np.testing.assert_allclose(history.shear, state.contact.shear, atol=1e-6)
        assert largest == pytest.approx(full.residual.largest_fibre, abs=1e-6)
        assert (history.slipping == state.contact.slipping).all()


def small_finger(truth: xr.Dataset, variant: int, rank: int = 12):
    """A reduced finger with every point, and states and constants of its training paths."""
    finger = SCENE.finger(paths_of(variant, 8, 3), 0)
    mine = truth.isel(case=[0, 1, 2] if variant == 0 else [8, 9, 10])
    rows = 1e3 * mine["displacement"].values.reshape(3 * SCENE.n_positions, -1)
    pressures = pressure_modes(finger, np.random.default_rng(0).standard_normal((9, len(finger.mesh.quads))), 4)
    vectors = orthonormal(principal_directions(rows, rank), supremizers(finger, pressures))
    whole = reduce(finger, ReducedSpace(vectors, pressures, np.r_[21:28, 0:8]))
    paths = SCENE.read(mine)
    constants = [Constants(paths.c[i] * 1e-6, paths.k1[i] * 1e-6, 15.0, 2e3 * paths.c[i] * 1e-6, 100.0,
                           paths.friction[i], 20.0, 5.0) for i in range(3) for _ in range(SCENE.n_positions)]
    plate = finger.lowest + 1e3 * mine["normal_displacement"].values.ravel()
    return whole, constants, rows @ vectors, mine["stretch_z"].values.ravel(), plate


@pytest.mark.parametrize("variant", [0, 2])
def test_tangent_is_the_derivative_of_the_residual(truth, variant):
    whole, constants, q, stretch, plate = small_finger(truth, variant)
    case, n = constants[40], len(whole.height)
    before = Contact(np.zeros(n), np.linspace(-1e-3, 1e-3, n), np.full(n, 1e-4), np.arange(n) % 3 > 0,
                     np.arange(n) % 2 > 0)

    def residual(unknown: np.ndarray) -> tuple:
        at, z, y = unknown[:-2], unknown[-2], unknown[-1]
        s = case.bulk * volumes(whole, at, z)[0]
        return assemble(whole, case, before, at, z, y, 0.02, s, 0.03, False, 1e-4, np.zeros(len(at)))

    start = np.concatenate([q[40], [stretch[40], plate[40] + 0.03]])
    assert residual(start)[5][6].sum() >= 3  # some nodes touch, so that contact is in the tangent
    h = 1e-6
    columns = [(residual(start + h * e)[1] - residual(start - h * e)[1]) / (2 * h) for e in np.eye(len(start))]
    found = residual(start)[2]
    # central differences of step h: h^2 times third derivatives, and rounding over h
    np.testing.assert_allclose(np.column_stack(columns), found, atol=1e-6 * np.abs(found).max())


def test_sampled_points_meet_the_training_forces(truth):
    whole, constants, q, stretch, plate = small_finger(truth, 0)
    shares = displacement_shares(whole, constants, q, stretch, plate)
    full = shares @ whole.weights
    counts = []
    for tolerance in (3e-2, 3e-3):
        points, weights = sparse_weights(shares, whole.weights, tolerance)
        assert (weights >= 0).all() and len(np.unique(points)) == len(points)
        missed = np.linalg.norm(shares[:, points] @ weights - full) / np.linalg.norm(full)
        assert missed <= tolerance * (1 + 1e-9)
        counts.append(len(points))
    assert counts[0] < counts[1] < len(whole.weights)
    few = sampled(whole, points, weights)
    assert len(few.weights) == counts[1] and few.gradients.shape == (4 * counts[1], whole.gradients.shape[1])


def test_held_out_paths_are_lawful_and_close(learned, truth):
    cases = truth.isel(case=HELD_OUT)
    answer = learned.evaluate(SCENE.read(cases))
    force = cases["normal_force"].values[:, None] * SCENE.force_share
    friction = cases["friction"].values[:, None]
    assert np.isfinite(answer["displacement"]).all()
    assert (np.abs(answer["tangential_force"]) <= friction * force * (1 + 1e-5)).all()  # Coulomb, to Newton's tolerance
    u = cases["displacement"].values
    error = np.linalg.norm(answer["displacement"] - u, axis=(2, 3)) / np.linalg.norm(u, axis=(2, 3))
    assert np.median(error) < 0.05  # the scene's gate; six training paths a variant do not meet it at the maximum
    best = learned.best_approximation(SCENE.read(cases), u)
    floor = np.linalg.norm(best - u, axis=(2, 3)) / np.linalg.norm(u, axis=(2, 3))
    assert (floor <= error + 1e-12).all()  # a projection is the best that the modes can do


def test_pressing_harder_than_the_tissue_bears_is_said(learned, truth):
    cases = truth.isel(case=HELD_OUT[:1]).copy()
    cases["normal_force"] = cases["normal_force"] * 0 + 900.0
    with pytest.warns(UserWarning, match="does not stand behind"):
        answer = learned.predict(cases)
    assert "the reduced path ends at" in str(answer["validity"].values[0])
    assert not answer["answered"].values[0, -1]


def test_save_load_and_refit_change_nothing(learned, truth, tmp_path):
    paths = SCENE.read(truth.isel(case=HELD_OUT[1:3]))
    learned.save(tmp_path / "model.nc")
    again = load(tmp_path / "model.nc")
    refitted = PathGalerkin(SCENE, **learned.settings).fit(truth.isel(case=HELD_IN))
    expected = learned.evaluate(paths)
    for other in (again, refitted):
        for name, values in other.evaluate(paths).items():
            np.testing.assert_array_equal(values, expected[name])


@pytest.mark.parametrize(("setting", "value"), [("rank", 0), ("rank", 2.5), ("pressure_rank", True), ("sampling", 2.0),
                                                ("stick_stiffness", -1.0), ("tolerance", None)])
def test_refuses_settings_that_cannot_be(setting, value):
    with pytest.raises(ValueError, match=setting):
        PathGalerkin(SCENE, **{setting: value})
