"""The modal family beside and at resonances, where two modes cross, with stored single precision, with all the modes.

Reference: direct solves, which refine themselves near resonances in doubled precision.
"""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from rom.datasets import draw_cases
from rom.fullorder import IllConditionedWarning
from rom.metamodels import create
from rom.scenes import CaseArrays, get_scene
from rom.vibration.modal_analysis import analyse_modes


def one_case(node, frequency, loss_factor):
    return CaseArrays(np.array([[node]]), np.array([[1.0]]), np.array([frequency]), np.array([loss_factor]))


def difference(model, scene, cases):
    """Relative to the direct answer; next to a resonance the direct solve may doubt itself."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        exact = scene.model.solve_harmonic(scene.force_vectors(cases)[:, 0], cases.frequency[0],
                                                cases.loss_factor[0])
    return np.linalg.norm(model.evaluate(cases)[0] - exact) / np.linalg.norm(exact)


def symmetric_load(tip):
    return int(np.argmin(np.abs(tip.mesh.nodes[tip.mesh.pad_nodes][:, 1])))


@pytest.fixture(scope="module")
def krylov(harmonic):
    return create("modal-krylov", harmonic, modes=20, vectors=8).fit()


@pytest.mark.parametrize("mode", [0, 1, 2, 3, 7])
def test_the_modal_answer_holds_within_a_millihertz_of_a_resonance(krylov, harmonic, mode):
    """Loss factor 1e-6 asks for eigenvalues to better than 1e-6 of that; loads across the symmetry included."""
    resonance = np.sqrt(krylov.eigenvalue[mode]) / (2 * np.pi)
    for node in (0, symmetric_load(harmonic.body.fingertip)):
        for distance in (0.0, 1e-4, -1e-3):
            assert difference(krylov, harmonic, one_case(node, resonance + distance, 1e-6)) < 1e-6
        assert difference(krylov, harmonic, one_case(node, resonance + 1e-3, 0.0)) < 1e-6


def test_two_modes_that_cross(small_tip):
    """The nail's height brings a symmetric and an antisymmetric mode, the fourth and fifth, to one frequency."""
    def gap(height):
        found = analyse_modes(replace(small_tip, anatomy=small_tip.anatomy.replace(nail_height=height)), 6)
        pair = sorted(zip(found.parity[3:5], found.modes.eigenvalue[3:5], strict=True))
        assert pair[0][0] != pair[1][0]
        return pair[1][1] / pair[0][1] - 1

    height, before = 3.05, 3.0
    value, last = gap(height), gap(before)
    for _ in range(6):  # secant
        if abs(value) < 1e-9 or value == last:
            break
        height, before, last = height - value * (height - before) / (value - last), height, value
        value = gap(height)
    assert abs(value) < 1e-7
    tip = replace(small_tip, anatomy=small_tip.anatomy.replace(nail_height=height))
    scene = get_scene("harmonic-point-force", tip)
    for modes in (4, 5, 20):  # four cut the pair
        model = create("modal-krylov", scene, modes=modes, vectors=12 if modes == 20 else 40).fit()
        resonance = np.sqrt(model.eigenvalue[3]) / (2 * np.pi)
        for frequency, loss_factor in ((resonance + 1e-3, 1e-6), (resonance, 1e-4), (0.7 * resonance, 0.0)):
            if modes == 4 and frequency > 0.9 * resonance:
                continue  # beyond what it keeps
            assert difference(model, scene, one_case(0, frequency, loss_factor)) < 1e-6


@pytest.mark.parametrize("frequency", [1.0, 55.0, 150.0, 260.0])
@pytest.mark.parametrize("loss_factor", [0.0, 0.1, 0.5])
def test_modal_krylov_and_direct_agree_in_the_band(krylov, harmonic, frequency, loss_factor):
    for node in (0, 11):
        assert difference(krylov, harmonic, one_case(node, frequency, loss_factor)) < 1e-6


def test_single_precision_of_the_shapes_costs_single_precision(harmonic):
    """Coordinates stay double, so a resonance does not amplify what the stored shapes lost."""
    model = create("modal-krylov", harmonic, modes=20, vectors=8, precision="float32").fit()
    for mode in (0, 4):
        resonance = np.sqrt(model.eigenvalue[mode]) / (2 * np.pi)
        assert difference(model, harmonic, one_case(0, resonance + 1e-3, 1e-6)) < 1e-6


def test_bases_of_one_and_of_all_modes(tiny_harmonic):
    n = tiny_harmonic.n_free
    for name, settings in (("modal", {"modes": n}), ("modal-krylov", {"modes": n, "vectors": 2}),
                           ("modal-krylov", {"modes": 1, "vectors": 60})):
        model = create(name, tiny_harmonic, **settings).fit()
        assert difference(model, tiny_harmonic, one_case(2, 90.0, 0.1)) < 1e-8


@pytest.mark.parametrize("name", ["superposition", "modal-krylov"])
def test_answers_too_small_for_single_precision_are_refused(name, static, harmonic):
    """Stored shapes lose nothing at 1e-20 N, everything at 1e-42 N; double precision answers both."""
    scene = static if name == "superposition" else harmonic
    _, cases = draw_cases(scene, 3, seed=1)
    single, double = (create(name, scene, precision=precision).fit() for precision in ("float32", "float64"))
    force = next(one for one in cases.data_vars if "amplitude" in one)
    exact = double.predict(cases)["displacement"].values
    for size in (1e-20, 1e-42):
        small = cases.copy(deep=True)
        small[force] = cases[force] * size
        np.testing.assert_allclose(double.predict(small)["displacement"].values / size, exact, rtol=1e-8, atol=1e-12)
        if size > 1e-25:
            found = single.predict(small)["displacement"].values / size
            assert np.linalg.norm(found - exact) < 1e-6 * np.linalg.norm(exact)
        else:
            with pytest.raises(ValueError, match="single precision cannot resolve"):
                single.predict(small)
