"""Patch forces with directions and phases: labels, loads, and what linear dynamics says of every method's answers."""

import json

import numpy as np
import pytest
import xarray as xr
from energy import residuals

from rom.fingertip import DIRECTIONS
from rom.metamodels import create
from rom.relative import relative_errors
from rom.scenes import NO_FORCE, CaseArrays, get_scene, scene_from_json
from rom.scenes.harmonic_patch_forces import site_nodes

SETTINGS = {"direct": {}, "direct-reused": {}, "modal": {"modes": 12}, "modal-static": {"modes": 12},
            "modal-krylov": {"modes": 12, "vectors": 4}, "coarse-fem": {"scale": 0.7}, "pod-galerkin": {"rank": 20}}


def labelled(scene, **changes):
    """Two cases: one force alone, and one force of each direction at once."""
    first, second = map(int, site_nodes(scene))
    data = {"load_node": [[first, NO_FORCE, NO_FORCE], [first, second, second]],
            "direction": [["normal", "none", "none"], ["normal", "radial-ulnar", "distal-proximal"]],
            "force_amplitude": [[0.1, 0.0, 0.0], [0.1, 0.05, 0.2]],
            "force_phase": [[0.0, 1.0, 1.0], [0.0, np.pi / 2, np.pi]]}
    data = {name: (("case", "force"), values) for name, values in data.items()}
    data |= {"frequency": ("case", [50.0, 120.0]), "loss_factor": ("case", [0.1, 0.2])}
    return xr.Dataset({**data, **changes})


@pytest.fixture(scope="module", params=SETTINGS)
def model(request, patches, patches_data):
    made = create(request.param, patches, **SETTINGS[request.param])
    return made.fit(patches_data if made.learns else None)


# ---- labels -------------------------------------------------------------------------------------------------

def test_labels_become_columns_and_phasors(patches):
    arrays = patches.read(labelled(patches))
    np.testing.assert_array_equal(arrays.node, [[0, 0, 0], [0, 4, 5]])  # 3 x site + direction
    # by hand: a exp(i phase), nothing where no force acts
    np.testing.assert_allclose(arrays.force, [[0.1, 0, 0], [0.1, 0.05j, -0.2]], atol=1e-16)
    again = patches.read(patches.cases_from(arrays))
    for found, expected in zip(again, arrays, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-16)


def test_codes_say_the_same_as_names(patches):
    codes = labelled(patches, direction=(("case", "force"), [[0, -1, -1], [0, 1, 2]]))
    for found, expected in zip(patches.read(codes), patches.read(labelled(patches)), strict=True):
        np.testing.assert_array_equal(found, expected)


def test_phase_and_loss_factor_may_be_left_out(patches):
    cases = labelled(patches)
    arrays = patches.read(cases.drop_vars(["force_phase", "loss_factor"]))
    np.testing.assert_array_equal(arrays.force.imag, 0.0)
    np.testing.assert_array_equal(arrays.loss_factor, 0.1)  # as published
    with pytest.raises(ValueError, match="lack the variable 'direction'"):
        patches.read(cases.drop_vars("direction"))


@pytest.mark.parametrize(("change", "say"), [
    ({"direction": [["sideways", "none", "none"], ["normal"] * 3]}, "direction holds 'sideways': choose from normal"),
    ({"direction": [["none"] * 3, ["normal"] * 3]}, "force 0 of case 0 has the amplitude 0.1 N but no direction"),
    ({"direction": [[3, 0, 0], [0, 0, 0]]}, "direction holds 3, which stands for nothing: give 0 (normal)"),
    ({"load_node": [[NO_FORCE] * 3] * 2, "force_amplitude": [[0.0] * 3] * 2}, "case 0 has no force"),
    ({"load_node": [[10**6] * 3] * 2}, "load_node 1000000 cannot carry load"),
    ({"force_phase": [[np.nan] * 3] * 2}, "force_phase holds nan"),
    ({"force_amplitude": [[1j] * 3] * 2}, "force_amplitude is of type complex128")])
def test_impossible_labels_are_refused(patches, change, say):
    with pytest.raises(ValueError) as refusal:
        patches.read(labelled(patches, **{name: (("case", "force"), v) for name, v in change.items()}))
    assert say in str(refusal.value) and "\n" not in str(refusal.value)


@pytest.mark.parametrize("sites", [(5, 5), (1.5,), "pad", 7, ((1, 2),), (None,)])
def test_impossible_sites_are_refused(small_tip, sites):
    with pytest.raises(ValueError, match="give distinct ids of pad nodes"):
        get_scene("harmonic-patch-forces", small_tip, sites=sites)


def test_a_site_off_the_pad_is_refused(small_tip):
    scene = get_scene("harmonic-patch-forces", small_tip, sites=(int(small_tip.mesh.bone_nodes[0]),))
    with pytest.raises(ValueError, match="is not on the pad"):
        scene.loads  # noqa: B018  # the property refuses, once the mesh is there


def test_an_option_of_another_scene_is_refused(small_tip):
    with pytest.raises(ValueError, match="static-point-forces does not take the option sites"):
        get_scene("static-point-forces", small_tip, sites=(3,))


# ---- loads and identity -------------------------------------------------------------------------------------

def test_unit_loads_are_those_of_the_fingertip(patches):
    assert patches.unit_loads.shape == (patches.n_free, patches.n_loads) == (patches.n_free, 6)
    for j, node in enumerate(map(int, site_nodes(patches))):
        for k, direction in enumerate(DIRECTIONS):
            assert patches.load_index(node, direction) == 3 * j + k
            np.testing.assert_array_equal(patches.unit_loads[:, 3 * j + k],
                                          patches.body.fingertip.patch_force(node, direction))


def test_without_sites_the_fingerprint_centroid_is_loaded(small_tip):
    default = get_scene("harmonic-patch-forces", small_tip)
    named = get_scene("harmonic-patch-forces", small_tip, sites=(small_tip.mesh.fingerprint_centroid,))
    assert default.n_loads == named.n_loads == 3
    assert default.content_hash == named.content_hash
    np.testing.assert_array_equal(default.unit_loads, named.unit_loads)


def test_sites_survive_json_and_tell_scenes_apart(patches):
    again = scene_from_json(patches.to_json())
    assert site_nodes(again).tolist() == site_nodes(patches).tolist()
    assert (again.to_json(), again.content_hash) == (patches.to_json(), patches.content_hash)
    other = get_scene("harmonic-patch-forces", patches.body.fingertip, sites=site_nodes(patches)[::-1].tolist())
    assert other.content_hash != patches.content_hash
    assert json.loads(other.to_json())["options"]["sites"] == site_nodes(patches)[::-1].tolist()


# ---- sampling -----------------------------------------------------------------------------------------------

def test_drawn_cases_are_distinct_combinations(patches):
    arrays = patches.sample(400, 1)
    number = (arrays.force != 0).sum(axis=1)
    assert set(number) == {1, 2, 3}
    assert np.isin(arrays.frequency, np.arange(1, 261)).all() and (arrays.loss_factor == 0.1).all()  # published grid
    singles = [(n, f) for n, f in zip(arrays.node[number == 1, 0], arrays.frequency[number == 1], strict=True)]
    assert len(set(singles)) == len(singles)  # a single force repeated at one frequency would only be scaled
    for node, k in zip(arrays.node, number, strict=True):
        assert len(set(node[:k])) == k
    beyond = patches.sample_beyond(60)
    assert ((beyond.frequency > 260) ^ (beyond.loss_factor != 0.1)).all()
    assert set(patches.hard_region(beyond)) >= {2, 3} and (patches.hard_region(beyond) > 0).sum() >= 60


# ---- linear dynamics, whatever the method --------------------------------------------------------------------

def test_several_forces_answer_as_the_phasor_sum_of_single_ones(patches, model):
    rng = np.random.default_rng(2)
    node = np.stack([rng.permutation(6)[:4] for _ in range(5)])
    force = rng.uniform(0.1, 1.0, node.shape) * np.exp(1j * rng.uniform(-np.pi, np.pi, node.shape))
    point = (rng.uniform(1.0, 260.0, 5), np.full(5, 0.1))
    unit = [model.evaluate(CaseArrays(node[:, [j]], np.ones((5, 1)), *point)) for j in range(4)]
    for outputs, rows in (("field", slice(None)), ("pad", patches.part_rows)):
        expected = sum(force[:, [j]] * unit[j][:, rows] for j in range(4))
        found = model.evaluate(CaseArrays(node, force, *point), outputs)
        assert relative_errors(found, expected).max() < 1e-9  # linearity, to the rounding of a direct solve


def test_a_phase_turns_the_answer(patches, model):
    for phase, factor in ((np.pi, -1.0), (np.pi / 2, 1j), (0.7, np.exp(0.7j))):
        for count in (1, 3):  # the call of one case has a path of its own
            node, point = np.full((count, 1), 4), (np.linspace(40, 260, count), np.full(count, 0.1))
            plain = model.evaluate(CaseArrays(node, np.full((count, 1), 0.1), *point))
            turned = model.evaluate(CaseArrays(node, np.full((count, 1), 0.1 * np.exp(1j * phase)), *point))
            assert relative_errors(turned, factor * plain).max() < 1e-9  # exp(i phase) factors out


def test_patches_answer_each_other(patches, model):
    # Maxwell-Betti: f_a^T u_b = f_b^T u_a, as Z is symmetric (not Hermitian: no conjugate)
    arrays = CaseArrays(np.arange(6)[:, None], np.ones((6, 1)), np.full(6, 137.0), np.full(6, 0.1))
    receptance = model.evaluate(arrays) @ patches.unit_loads
    # each load has Krylov vectors of its own, so the two ways differ by the truncation, four vectors' worth
    limit = 1e-6 if model.name == "modal-krylov" else 1e-9
    np.testing.assert_allclose(receptance, receptance.T, rtol=0, atol=limit * np.abs(receptance).max())


def test_input_equals_dissipation(patches):
    arrays = patches.sample(24, 4)
    full = patches.model
    answers = create("direct-reused", patches).fit().evaluate(arrays)
    for i in range(len(arrays)):
        point = float(arrays.frequency[i]), float(arrays.loss_factor[i])
        force = patches.force_vectors(arrays.take([i]))[:, 0]
        lost = full.dissipated_power(answers[i], *point)
        assert lost > 0
        np.testing.assert_allclose(full.input_power(force, answers[i], point[0]), lost, rtol=1e-8)


def test_the_residual_knows_phases(patches):
    cases = labelled(patches)
    model = create("direct", patches).fit()
    answer = model.predict(cases)
    assert (residuals(patches, cases, answer) < 1e-10).all()
    turned = cases.assign(force_phase=cases["force_phase"] + np.pi)
    np.testing.assert_allclose(residuals(patches, turned, answer), 2.0, rtol=1e-9)  # ||-f - f|| / ||f||


@pytest.mark.parametrize("method", ["modal-static", "modal-krylov"])
def test_the_bound_holds_for_forces_with_phases(patches, method):
    # the theorem, against direct solves in the energy norm
    arrays = patches.sample(40, 6)
    model = create(method, patches, **SETTINGS[method]).fit()
    error = model.evaluate(arrays) - create("direct-reused", patches).fit().evaluate(arrays)
    energy = np.sqrt(np.einsum("cn,cn->c", error.conj(), (patches.model.stiffness @ error.T).T).real)
    bound = model.error_bound(arrays)
    assert (energy <= bound).all()
    turned = CaseArrays(arrays.node, arrays.force * np.exp(1.3j), arrays.frequency, arrays.loss_factor)
    np.testing.assert_allclose(model.error_bound(turned), bound, rtol=1e-6)
    single = arrays.take((arrays.force[:, 1] == 0) & (arrays.force[:, 2] == 0))
    fields = model.evaluate(single)
    norm = np.sqrt(np.einsum("cn,cn->c", fields.conj(), (patches.model.stiffness @ fields.T).T).real)
    np.testing.assert_allclose(model.energy_norm(single), norm, rtol=1e-9)


def test_datasets_keep_directions_and_phases(patches, patches_data):
    arrays = patches.read(patches_data)
    drawn = patches.sample(96, 3)
    np.testing.assert_allclose(arrays.force[:96], np.where(drawn.force == 0, 0, drawn.force), rtol=1e-14)
    assert set(np.unique(patches_data["direction"])) == {*DIRECTIONS, "none"}
    assert (residuals(patches, patches_data, patches_data) < 1e-10).all()
