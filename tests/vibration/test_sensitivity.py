"""Derivatives of natural frequencies against similarity laws, re-solved models and split double roots."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sla

from rom.fullorder import SecondOrderModel
from rom.vibration import matrix_derivatives
from rom.vibration.matrix_derivatives import STEP, projected_derivatives
from rom.vibration.parameters import parameters, with_parameter
from rom.vibration.sensitivity import CLUSTER, clusters, eigenvalue_derivatives, frequency_sensitivity

MODES = 5

#: Of a re-solved frequency's logarithmic derivative: 1e-4 of it is asked for, and rounding of two eigenvalues (1e-11)
#: over the step is allowed.
TOLERANCE = {"rtol": 1e-4, "atol": 5e-7}
#: Small against the distance of close modes (some 1e-3), where frequencies turn away from each other.
RESOLVE_STEP = 1e-5


def modes_of(tip, count=MODES):
    return SecondOrderModel(tip.stiffness, tip.mass).natural_modes(count=count)


def same_modes(other, modes, mass):
    """Frequencies of another model's modes in the order of these, by their shapes: close modes may change places."""
    found = modes_of(other, MODES + 2)
    return found.frequency_hz[np.abs(modes.shape.T @ (mass @ found.shape)).argmax(axis=1)]


@pytest.fixture(scope="module", params=[("b-bar", "free"), ("full", "fixed")], ids="-".join)
def tip(request, tiny_tip):
    formulation, rear = request.param
    return replace(tiny_tip, formulation=formulation, rear=rear)


@pytest.fixture(scope="module")
def modes(tip):
    return modes_of(tip)


@pytest.fixture(scope="module")
def sensitivity(tip, modes):
    return frequency_sensitivity(tip, modes)


def test_similarity(sensitivity):
    """Analytic: f = sqrt(E / rho) / L g(ratios, Poisson's ratios): logarithmic slopes add up to 1/2, -1/2 and -1."""
    value = sensitivity["parameter_value"] * sensitivity["derivative"] / sensitivity["frequency"]
    name = sensitivity["parameter"].str
    for some, total in (
        (name.endswith("elastic_modulus"), 0.5),
        (name.endswith("density"), -0.5),
        (sensitivity["parameter_unit"] == "mm", -1.0),
    ):
        np.testing.assert_allclose(value.where(some, 0.0).sum("parameter"), total, atol=1e-5)


@pytest.mark.parametrize("seed", [1, 2])
def test_all_parameters_at_once_against_resolved_models(tip, modes, sensitivity, seed):
    """Along a random direction of all parameters: independent, by central differences of two eigensolves."""
    rng = np.random.default_rng(seed)
    count = sensitivity.sizes["parameter"]
    direction = rng.uniform(0.3, 1.0, count) * rng.choice([-1, 1], count)
    ends = []
    for sign in (-1, 1):
        other = tip
        for one, weight in zip(parameters(tip), direction, strict=True):
            other = with_parameter(other, one.name, one.value + sign * RESOLVE_STEP * weight * one.scale)
        assert np.array_equal(other.mesh.tissue, tip.mesh.tissue)
        ends.append(same_modes(other, modes, tip.mass))
    slope = (ends[1] - ends[0]) / (2 * RESOLVE_STEP) / sensitivity["frequency"].values
    np.testing.assert_allclose(direction @ sensitivity["logarithmic"].values, slope, **TOLERANCE)


@pytest.mark.parametrize("name", [
    "fingertip_height", "bone_length", "nail_plate_thickness", "shape.lower_exponent", "shape.bone_axis_rise",
    "hypodermis.poisson_ratio", "nail_plate.elastic_modulus", "dermis.density"])
def test_each_parameter_against_resolved_models(tip, modes, sensitivity, name):
    one, = parameters(tip, [name])
    step = RESOLVE_STEP * one.scale
    low, high = (same_modes(with_parameter(tip, name, one.value + s), modes, tip.mass) for s in (-step, step))
    slope = (high - low) / (2 * RESOLVE_STEP) / sensitivity["frequency"].values
    np.testing.assert_allclose(sensitivity["logarithmic"].sel(parameter=name), slope, **TOLERANCE)


def test_other_combinations_of_formulation_and_rear(tiny_tip):
    for formulation, rear in (("full", "free"), ("b-bar", "fixed")):
        tip, names = replace(tiny_tip, formulation=formulation, rear=rear), ["fingertip_width", "dermis.poisson_ratio"]
        modes = modes_of(tip)
        found = frequency_sensitivity(tip, modes, names)
        for one in parameters(tip, names):
            step = RESOLVE_STEP * one.scale
            ends = [with_parameter(tip, one.name, one.value + s) for s in (-step, step)]
            low, high = (same_modes(end, modes, tip.mass) for end in ends)
            slope = (high - low) / (2 * step)
            np.testing.assert_allclose(found["derivative"].sel(parameter=one.name), slope, rtol=1e-4)


def test_forms_are_those_of_the_assembled_matrices(tiny_tip):
    """Independent: derivatives of sparse matrices, exact for a property, by differences for a length."""
    v = np.random.default_rng(3).standard_normal((len(tiny_tip.free_dofs), 3))
    found = projected_derivatives(tiny_tip, v, ["dermis.elastic_modulus", "hypodermis.density", "fingertip_width"])
    by_tissue = tiny_tip.stiffness_by_tissue
    for t, name in enumerate(by_tissue):
        np.testing.assert_allclose(found.tissue_stiffness[t], v.T @ (by_tissue[name] @ v), rtol=1e-9, atol=1e-6)
    modulus, density, width = (one.value for one in found.parameters)
    np.testing.assert_allclose(found.stiffness[0].sum(0), v.T @ (by_tissue["dermis"] @ v) / modulus, rtol=1e-9)
    mass = tiny_tip.mass_by_tissue["hypodermis"]
    np.testing.assert_allclose(found.mass[1], v.T @ (mass @ v) / density, rtol=1e-9, atol=1e-18)
    assert not found.mass[0].any() and not found.stiffness[1].any()
    ends = [with_parameter(tiny_tip, "fingertip_width", width + s) for s in (-STEP * width, STEP * width)]
    slope = v.T @ ((ends[1].stiffness - ends[0].stiffness) @ v) / (2 * STEP * width)
    np.testing.assert_allclose(found.stiffness[2].sum(0), slope, rtol=1e-6, atol=1e-7 * abs(slope).max())


def test_a_split_double_root():
    """Modes of one frequency have no shapes of their own: theirs are turned at random, the derivatives stay."""
    rng = np.random.default_rng(4)
    k = np.diag([1.0, 4.0, 4.0, 4.0, 9.0])
    change_k, change_m = (one + one.T for one in rng.standard_normal((2, 5, 5)))
    shape = np.eye(5)
    shape[1:4, 1:4] = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    value = np.diag(k)
    cluster = clusters(value)
    assert cluster.tolist() == [0, 1, 1, 1, 2]
    found = eigenvalue_derivatives(value, cluster, shape.T @ change_k @ shape, shape.T @ change_m @ shape)
    step = 1e-8  # one-sided, as the roots cross at zero; independent
    slope = (sla.eigvalsh(k + step * change_k, np.eye(5) + step * change_m) - value) / step
    np.testing.assert_allclose(found, slope, atol=1e-5)
    apart = eigenvalue_derivatives(value, np.arange(5), shape.T @ change_k @ shape, shape.T @ change_m @ shape)
    assert np.max(np.abs(apart - slope)) > 0.1  # what ignoring the cluster would give


def test_clusters_are_chains_of_close_eigenvalues():
    assert clusters([1.0, 1 + 0.4 * CLUSTER, 1 + 0.8 * CLUSTER, 1 + 3 * CLUSTER, 2.0]).tolist() == [0, 0, 0, 1, 2]
    assert clusters([3.0]).tolist() == [0]


def jumping(monkeypatch, tip, distance):
    """Meshes in which one element changes its tissue as the width grows by more than a distance."""
    build = matrix_derivatives.build_mesh

    def mesh_of(anatomy, density):
        mesh = build(anatomy, density)
        tissue = mesh.tissue.copy()
        if anatomy.fingertip_width - tip.anatomy.fingertip_width > distance:
            tissue[0] = (tissue[0] + 1) % 4
        return replace(mesh, tissue=tissue)

    monkeypatch.setattr(matrix_derivatives, "build_mesh", mesh_of)


def test_a_step_across_the_nails_edge_is_halved(tiny_tip, monkeypatch):
    modes, name = modes_of(tiny_tip), "fingertip_width"
    smooth = frequency_sensitivity(tiny_tip, modes, [name])["derivative"].values
    step = STEP * tiny_tip.anatomy.fingertip_width
    jumping(monkeypatch, tiny_tip, 0.3 * step)
    np.testing.assert_allclose(frequency_sensitivity(tiny_tip, modes, [name])["derivative"], smooth, rtol=1e-5)


def test_an_element_on_the_nails_edge_is_refused(tiny_tip, monkeypatch):
    jumping(monkeypatch, tiny_tip, 0.0)
    with pytest.raises(ValueError, match=r"fingertip_width is .* mm.*nail's edge"):
        frequency_sensitivity(tiny_tip, modes_of(tiny_tip), ["fingertip_width"])


def test_refusals(tiny_tip, small_tip):
    with pytest.raises(ValueError, match=r"vectors have shape .* one row a free dof"):
        frequency_sensitivity(tiny_tip, modes_of(small_tip))
    with pytest.raises(ValueError, match="no parameter"):
        frequency_sensitivity(tiny_tip, modes_of(tiny_tip), ["dermis.colour"])
