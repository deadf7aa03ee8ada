"""Labels in and out: what is refused in one sentence, what comes back as it went in."""

import numpy as np
import pytest
import xarray as xr

from rom.scenes import NO_FORCE, SCENES, get_scene, scene_from_json


@pytest.fixture
def cases(harmonic):
    return harmonic.cases_from(harmonic.sample(12, 1))


@pytest.fixture
def static_cases(static):
    return static.cases_from(static.sample(12, 1))


def changed(cases, name, value, at=3):
    """The cases with one value put in."""
    other = cases.copy(deep=True)
    values = other[name].values.astype(float) if isinstance(value, float) else other[name].values
    values[at] = value
    return other.assign({name: (other[name].dims, values)})


def refused(scene, cases, *words):
    with pytest.raises(ValueError) as refusal:
        scene.read(cases)
    text = str(refusal.value)
    assert "\n" not in text
    for word in words:
        assert word in text, text


def test_arrays_come_back(harmonic, static, cases, static_cases):
    for scene, labelled in ((harmonic, cases), (static, static_cases)):
        arrays = scene.read(labelled)
        xr.testing.assert_identical(scene.cases_from(arrays), labelled)


def test_single_forces_need_no_force_dimension(harmonic, cases):
    flat = cases.isel(force=0)
    for a, b in zip(harmonic.read(flat), harmonic.read(cases), strict=True):
        np.testing.assert_array_equal(a, b)


def test_dimensions_may_come_in_any_order(static, static_cases):
    for a, b in zip(static.read(static_cases.transpose()), static.read(static_cases), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["force_amplitude", "frequency", "loss_factor"])
def test_values_that_are_not_finite_are_refused(harmonic, cases, name, value):
    refused(harmonic, changed(cases, name, value), name, str(value), "finite")


@pytest.mark.parametrize("name", ["frequency", "loss_factor"])
def test_negative_points_are_refused(harmonic, cases, name):
    refused(harmonic, changed(cases, name, -2.5), name, "-2.5", "negative")


def test_nodes_off_the_pad_are_refused(harmonic, cases):
    mesh = harmonic.body.fingertip.mesh
    skin = np.setdiff1d(mesh.skin_nodes, mesh.pad_nodes)[0]
    for node in (int(mesh.bone_nodes[0]), int(skin), len(mesh.nodes), 10**9, -2):
        refused(harmonic, changed(cases, "load_node", node), f"load_node {node} cannot carry load",
                f"the {harmonic.n_loads} of this scene's loads")


def test_nodes_that_are_no_whole_numbers_are_refused(harmonic, cases):
    pad = float(harmonic.body.fingertip.mesh.pad_nodes[0])
    refused(harmonic, changed(cases, "load_node", pad + 0.5), "load_node", "whole number")
    refused(harmonic, changed(cases, "load_node", np.nan), "no load_node: give both, or neither")
    words = cases.assign(load_node=(("case", "force"), np.full((12, 1), "thumb")))
    refused(harmonic, words, "load_node 'thumb' cannot carry load")
    arrays = harmonic.read(cases.assign(load_node=cases["load_node"].astype(float)))
    np.testing.assert_array_equal(arrays.node, harmonic.read(cases).node)


@pytest.mark.parametrize("name", ["load_node", "force_amplitude", "frequency", "loss_factor"])
def test_missing_variables_are_named(harmonic, cases, name):
    refused(harmonic, cases.drop_vars(name), f"lack the variable '{name}'")


def test_values_that_are_no_numbers_are_refused(harmonic, cases):
    refused(harmonic, cases.assign(frequency=("case", ["fast"] * 12)), "frequency", "real number of Hz")
    refused(harmonic, cases.assign(loss_factor=cases["loss_factor"] * 1j), "loss_factor", "real number")


def test_shapes_that_do_not_fit_are_refused(harmonic, static, cases, static_cases):
    refused(harmonic, cases.assign(frequency=("force", [100.0])), "frequency", "('case',)")
    refused(harmonic, cases.isel(case=slice(0)), "no case")
    refused(static, static_cases.assign(force_amplitude=static_cases["force_amplitude"].isel(force=0)),
            "one value for each of the 3 forces")
    refused(static, static_cases.assign(load_node=static_cases["load_node"].expand_dims(hand=2)), "load_node")


def test_a_case_without_a_force_is_refused(static, static_cases):
    silent = changed(changed(static_cases, "load_node", NO_FORCE, at=5), "force_amplitude", 0.0, at=5)
    refused(static, silent, "case 5 has no force")


def test_amplitudes_where_no_force_acts_are_refused_or_missing(static, static_cases):
    empty = static_cases["load_node"].values == NO_FORCE
    loud = static_cases.assign(force_amplitude=static_cases["force_amplitude"].where(~empty, 9.0))
    refused(static, loud, "has the amplitude 9 N but no load_node")
    missing = static_cases.assign(force_amplitude=static_cases["force_amplitude"].where(~empty))
    np.testing.assert_array_equal(static.read(missing).force, static.read(static_cases).force)


def test_labels_hold_the_whole_mesh_and_its_held_bone(harmonic, cases):
    mesh = harmonic.body.fingertip.mesh
    values = np.arange(12 * harmonic.n_free).reshape(12, -1) * (1 - 2j)
    answer = harmonic.label(cases, values)
    assert answer["displacement"].shape == (12, mesh.n_nodes, 3)
    np.testing.assert_array_equal(harmonic.values(answer), values)
    assert (answer["displacement"].values[:, mesh.bone_nodes] == 0).all()
    np.testing.assert_array_equal(np.stack([answer[f"node_{axis}"] for axis in "xyz"], axis=1), mesh.nodes)
    assert answer["node_x"].attrs["units"] == answer["displacement"].attrs["units"] == "m"


def test_pad_labels_hold_the_pad(harmonic, harmonic_data):
    scene = get_scene(harmonic.name, harmonic.body.fingertip, outputs="pad")
    pad = harmonic.body.fingertip.mesh.pad_nodes
    stored = harmonic_data.isel(case=slice(3))  # carries the whole mesh's nodes
    answer = scene.label(stored, harmonic.values(stored)[:, scene.part_rows])
    np.testing.assert_array_equal(answer["node"], pad)
    xr.testing.assert_equal(answer["displacement"].drop_vars("case"),
                            stored["displacement"].isel(node=pad).drop_vars("case"))


def test_pad_rows_loads_and_normals_belong_together(harmonic):
    # a unit inward force has no other entries than -n at its node's three rows
    for j in (0, 9, harmonic.n_loads - 1):
        load = harmonic.unit_loads[:, j]
        rows = harmonic.part_rows[3 * j:3 * j + 3]
        np.testing.assert_allclose(load[rows], -harmonic.loads.direction[j], rtol=1e-12)
        assert np.count_nonzero(np.delete(load, rows)) == 0
    np.testing.assert_allclose(np.linalg.norm(harmonic.loads.direction, axis=1), 1.0, rtol=1e-12)


def test_force_vectors_superpose(static):
    cases = static.sample(20, 2)
    vectors = static.force_vectors(cases)
    expected = sum(static.unit_loads[:, cases.node[:, j]] * cases.force[:, j] for j in range(3))
    np.testing.assert_allclose(vectors, expected, atol=1e-15)


def test_scenes_come_back_from_json(static, harmonic):
    for scene in (static, harmonic):
        again = scene_from_json(scene.to_json())
        assert type(again) is type(scene)
        assert (again.to_json(), again.content_hash) == (scene.to_json(), scene.content_hash)


@pytest.mark.parametrize("name", ["four words of nonsense", "", "static", "Harmonic-Point-Force"])
def test_unknown_scenes_are_refused(name):
    with pytest.raises(ValueError, match="is no scene: choose one of static-point-forces, harmonic-point-force"):
        get_scene(name)


def test_unknown_outputs_are_refused(small_tip):
    with pytest.raises(ValueError, match="outputs='nail' is unknown"):
        get_scene("static-point-forces", small_tip, outputs="nail")


@pytest.mark.parametrize("name", SCENES)
def test_scenes_say_what_they_need_and_leave_out(name):
    scene = get_scene(name)
    assert scene.needs and scene.leaves_out and scene.inputs and scene.regions
    assert not set(scene.needs) & set(scene.leaves_out)
    assert 0 < scene.gate < 0.1
