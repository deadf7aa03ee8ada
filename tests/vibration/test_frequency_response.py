"""Receptances against plain loops and dense linear algebra; a sweep sees every case once."""

import numpy as np
import pytest

from rom.errors import NotFittedError
from rom.fingertip import DIRECTIONS
from rom.metamodels import create
from rom.scenes import CaseArrays, get_scene
from rom.vibration.frequency_response import frequency_response, receptances, sweep_cases

FREQUENCY = [0.0, 60.0, 121.0, 250.0]


@pytest.fixture(scope="module")
def scene(tiny_tip):
    return get_scene("harmonic-patch-forces", tiny_tip)


@pytest.fixture(scope="module")
def direct(scene):
    return create("direct-reused", scene).fit()


def test_receptances_are_those_of_dense_algebra_and_plain_loops(scene, direct):
    tip = scene.body.fingertip
    found = frequency_response(direct, FREQUENCY, amplitude=0.3, loss_factor=0.2)
    stiffness, mass = tip.stiffness.toarray(), tip.mass.toarray()
    node = tip.mesh.fingerprint_centroid
    patch = tip.mesh.skin_patch(node)
    for direction in DIRECTIONS:
        along = tip.skin_frame(node)[direction]
        for f in FREQUENCY:
            u = np.zeros(3 * tip.mesh.n_nodes, dtype=complex)
            u[tip.free_dofs] = np.linalg.solve(stiffness * (1 + 0.2j) - (2 * np.pi * f) ** 2 * mass,
                                               tip.patch_force(node, direction))
            size = {n: np.sqrt(sum(abs(u[3 * n + i]) ** 2 for i in range(3))) for n in range(tip.mesh.n_nodes)}
            one = found.sel(direction=direction, frequency=f)
            np.testing.assert_allclose(abs(one["receptance"].sel(measure="excitation")),
                                       np.mean([size[n] for n in patch]), rtol=1e-9)
            moving = [n for n in range(tip.mesh.n_nodes) if n not in tip.mesh.bone_nodes]
            np.testing.assert_allclose(abs(one["receptance"].sel(measure="whole")),
                                       np.mean([size[n] for n in moving]), rtol=1e-9)
            phasors = [np.mean([along @ u[3 * n:3 * n + 3] for n in nodes]) for nodes in (patch, moving)]
            np.testing.assert_allclose(np.exp(1j * np.angle(one["receptance"])), phasors / np.abs(phasors), atol=1e-6)
            np.testing.assert_allclose(one["driving_point_receptance"].item(),
                                       np.mean([along @ u[3 * n:3 * n + 3] for n in patch]), rtol=1e-9)


def test_a_passive_body_takes_power_in(direct):
    # input power -(omega / 2) F^2 Im(receptance) >= 0, by the second law
    driving = frequency_response(direct, np.arange(10.0, 400.0, 30.0))["driving_point_receptance"]
    assert (driving.imag < 0).all()


def test_a_sweep_shows_every_field_once_whatever_the_block(scene, direct, monkeypatch):
    seen = {}

    def watch(part, field):
        seen.update({i: field[k].copy() for k, i in enumerate(range(part.start, part.stop))})

    whole = frequency_response(direct, FREQUENCY)
    monkeypatch.setattr("rom.vibration.frequency_response.BLOCK", 5)
    parts = frequency_response(direct, FREQUENCY, watch=watch)
    for name in ("receptance", "driving_point_receptance"):
        np.testing.assert_allclose(parts[name], whole[name], rtol=1e-9)
    cases = sweep_cases(scene, FREQUENCY)
    np.testing.assert_allclose(np.stack([seen[i] for i in range(len(cases))]), direct.evaluate(cases), rtol=0,
                               atol=1e-9 * max(abs(field).max() for field in seen.values()))
    assert float(parts["sweep_seconds"]) > 0


def test_receptances_do_not_depend_on_the_force(scene, direct):
    cases = sweep_cases(scene, FREQUENCY)
    magnitude, driving = receptances(scene, cases, direct.evaluate(cases))
    turned = CaseArrays(cases.node, cases.force * (3 - 4j), cases.frequency, cases.loss_factor)
    again = receptances(scene, turned, direct.evaluate(turned))
    np.testing.assert_allclose(again[0], magnitude, rtol=1e-9)
    np.testing.assert_allclose(again[1], driving, rtol=1e-9)


def test_directions_and_sites_can_be_chosen(patches):
    model = create("modal-krylov", patches, modes=8, vectors=3).fit()
    both = frequency_response(model, [50.0], node=int(patches.loads.labels["load_node"][3]))
    one = frequency_response(model, [50.0], ["distal-proximal"], node=int(patches.loads.labels["load_node"][3]))
    assert one.sizes["direction"] == 1
    np.testing.assert_allclose(one["receptance"][0], both["receptance"].sel(direction="distal-proximal"), rtol=1e-9)
    first = frequency_response(model, [50.0])
    assert (np.abs(first["receptance"] / both["receptance"] - 1) > 1e-3).any()  # another place answers otherwise


@pytest.mark.parametrize(("words", "say"), [
    ({"frequency": []}, "no frequency"), ({"frequency": [np.nan]}, "frequency nan Hz"),
    ({"frequency": [-1.0]}, "frequency -1 Hz"), ({"directions": []}, "cannot be swept"),
    ({"directions": ["normal", "normal"]}, "at most once"), ({"directions": ["up"]}, "direction holds 'up'"),
    ({"amplitude": 0.0}, "moves nothing"), ({"amplitude": np.inf}, "force amplitude inf"),
    ({"loss_factor": -0.1}, "loss factor -0.1"), ({"node": 0}, "load_node 0 cannot carry load")])
def test_impossible_sweeps_are_refused(scene, words, say):
    with pytest.raises(ValueError, match=say):
        sweep_cases(scene, **{"frequency": [10.0]} | words)


def test_other_models_are_refused(scene, direct, tiny_harmonic):
    with pytest.raises(ValueError, match="a frequency response needs the scene harmonic-patch-forces"):
        frequency_response(create("direct", tiny_harmonic).fit(), [10.0])
    with pytest.raises(NotFittedError):
        frequency_response(create("direct", scene), [10.0])
    several = CaseArrays(np.zeros((1, 2), dtype=int), np.ones((1, 2)), np.ones(1), np.ones(1))
    with pytest.raises(ValueError, match="belongs to one force"):
        receptances(scene, several, direct.evaluate(several))
