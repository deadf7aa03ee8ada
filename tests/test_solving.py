"""rom.solve: the tolerance is met, the choice follows the counts, and it says why."""

import subprocess
import sys

import numpy as np
import pytest
from energy import relative_energy_errors

import rom
from rom.metamodels import create
from rom.scenes import CaseArrays, get_scene
from rom.solving import options


@pytest.fixture
def fresh(small_tip):
    """Scenes that have neither factor nor modes yet."""
    return lambda name: get_scene(name, small_tip)


@pytest.mark.parametrize("name", ["static-point-forces", "harmonic-point-force"])
@pytest.mark.parametrize("tolerance", [0.1, 1e-3, 1e-8])
@pytest.mark.parametrize("count", [1, 60])
def test_the_tolerance_is_met(fresh, name, tolerance, count):
    scene = fresh(name)
    arrays = scene.sample(count, 5)
    answer = rom.solve(scene, scene.cases_from(arrays), tolerance)
    truth = create("direct-reused", scene).fit().evaluate(arrays)
    error = relative_energy_errors(scene.values(answer), truth, scene.model.stiffness)
    assert (error <= tolerance).all()
    assert (answer["error_estimate"] <= tolerance).all()
    assert answer.attrs["why"].startswith(answer.attrs["method"])


@pytest.mark.parametrize(("name", "count", "method"), [
    ("static-point-forces", 2, "direct-reused"), ("static-point-forces", 100, "superposition"),
    ("harmonic-point-force", 3, "direct-reused"), ("harmonic-point-force", 200, "modal-krylov")])
def test_few_cases_are_solved_and_many_share(fresh, name, count, method):
    scene = fresh(name)
    answer = rom.solve(scene, scene.cases_from(scene.sample(count, 1)), 1e-4)
    assert answer.attrs["method"] == method
    assert set(answer["answered_by"].values.tolist()) == {method}


def test_beyond_the_modes_only_direct_solves_are_left(fresh):
    scene = fresh("harmonic-point-force")
    n = 60
    rng = np.random.default_rng(0)
    node = rng.integers(scene.n_loads, size=(n, 1))
    inside = CaseArrays(node, np.ones((n, 1)), np.linspace(1, 300, n), np.full(n, 0.2))
    rom.solve(scene, scene.cases_from(inside))  # its modes are there now
    beyond = CaseArrays(inside.node, inside.force, np.linspace(2900, 3000, n), inside.loss_factor)
    assert [option.method for option in options(scene, beyond, 1e-6)] == ["direct-reused"]
    answer = rom.solve(scene, scene.cases_from(beyond.take(slice(3))))
    assert (answer["error_estimate"] <= 1e-6).all()


def test_a_static_answer_builds_nothing_dynamic(fresh):
    scene = fresh("static-point-forces")
    rom.solve(scene, scene.cases_from(scene.sample(3, 1)), 1e-6)
    with pytest.raises(ValueError, match="no mass matrix"):
        _ = scene.model.mass


def test_impossible_tolerances_are_refused(fresh):
    scene = fresh("static-point-forces")
    with pytest.raises(ValueError, match="below what double precision can reach"):
        rom.solve(scene, scene.cases_from(scene.sample(1, 1)), 1e-15)


def test_import_rom_loads_nothing_heavy():
    code = "import rom, sys; print([m for m in ('numpy', 'scipy', 'xarray', 'torch') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    with pytest.raises(AttributeError, match="no attribute 'resolve'"):
        _ = rom.resolve
