"""Recovered strain against fields whose strain is known, and against the stiffness that assembly made."""

from dataclasses import replace

import numpy as np
import pytest

from rom.fingertip import Fingertip, MeshDensity, strain
from rom.fingertip.anatomy import TISSUES
from rom.fingertip.elasticity import stiffness_by_tissue
from rom.fingertip.strain_measures import energy_density, mean_energy_density, tensor
from rom.fullorder import SecondOrderModel

MILLIMETRE = 1e-3
DEPTHS = (0.0, 0.2, 0.5, 1.0, 1.7, 2.0)  # [mm], inside layers and on their borders
GRADIENT = np.array([[1.0, -2.0, 0.3], [0.7, 0.4, -1.1], [2.2, 0.9, -0.6]])
EXACT = (GRADIENT + GRADIENT.T) / 2


@pytest.fixture(scope="module", params=["b-bar", "full"])
def tip(request):
    return Fingertip(density=MeshDensity((4, 4), 2, 2, (1, 1, 2, 2)), formulation=request.param)


def linear_field(mesh, gradient):
    return mesh.nodes @ gradient.T + np.array([0.1, 0.2, -0.3])


@pytest.mark.parametrize("side", ["deep", "shallow"])
@pytest.mark.parametrize("factor", [1.0, 0.4 - 1.3j])
def test_a_linear_displacement_has_its_constant_strain_at_every_depth(tip, side, factor):
    # the patch test: trilinear elements hold linear fields exactly, whatever their shape
    for depth in DEPTHS:
        operator = strain.strain_operator(tip, depth * MILLIMETRE, side)
        found = strain.apply(operator, factor * linear_field(tip.mesh, GRADIENT))
        np.testing.assert_allclose(tensor(found), np.broadcast_to(factor * EXACT, (len(found), 3, 3)), atol=1e-12)
        assert np.iscomplexobj(found) == isinstance(factor, complex)


def test_it_has_so_at_element_centres_and_gauss_points_too(tip):
    for points in (strain.element_centres(tip.mesh), strain.gauss_points(tip.mesh)[0]):
        found = strain.apply(strain.operator_at(tip, points), linear_field(tip.mesh, GRADIENT))
        np.testing.assert_allclose(tensor(found), np.broadcast_to(EXACT, (len(points), 3, 3)), atol=1e-12)


def test_a_rigid_motion_strains_nothing(tip):
    spin = np.array([[0.0, -3.0, 2.0], [3.0, 0.0, -1.0], [-2.0, 1.0, 0.0]])
    for depth in DEPTHS:
        found = strain.apply(strain.strain_operator(tip, depth * MILLIMETRE), linear_field(tip.mesh, spin))
        assert np.abs(found).max() < 1e-12


def test_energy_densities_add_up_to_the_energy_of_the_stiffness(tip):
    # for any field, so for one that excites every element mode; wrong in either formulation if the other's were used
    u = np.random.default_rng(1).standard_normal((tip.mesh.n_nodes, 3))
    points, volume = strain.gauss_points(tip.mesh)
    density = energy_density(strain.apply(strain.operator_at(tip, points), u), *points.moduli(tip))
    by_tissue = stiffness_by_tissue(tip.mesh, tip.anatomy, tip.formulation)
    tissue = tip.mesh.tissue[points.element]
    for index, name in enumerate(TISSUES):
        exact = u.ravel() @ (by_tissue[name] @ u.ravel()) / 2
        assert (density * volume)[tissue == index].sum() == pytest.approx(exact, rel=1e-10)
    other = replace(tip, formulation="full" if tip.formulation == "b-bar" else "b-bar")
    wrong = energy_density(strain.apply(strain.operator_at(other, points), u), *points.moduli(tip))
    assert abs(wrong @ volume / (density @ volume) - 1) > 0.01
    np.testing.assert_allclose(volume.sum(), tip.mesh.volume, rtol=1e-12)


def test_the_mean_energy_of_a_cycle_is_a_quarter_of_the_hermitian_form(tip):
    rng = np.random.default_rng(2)
    u = rng.standard_normal(3 * tip.mesh.n_nodes) + 1j * rng.standard_normal(3 * tip.mesh.n_nodes)
    points, volume = strain.gauss_points(tip.mesh)
    mean = mean_energy_density(strain.apply(strain.operator_at(tip, points), u), *points.moduli(tip))
    stiffness = sum(stiffness_by_tissue(tip.mesh, tip.anatomy, tip.formulation).values())
    assert mean @ volume == pytest.approx((u.conj() @ (stiffness @ u)).real / 4, rel=1e-10)


@pytest.mark.parametrize("side", ["deep", "shallow"])
def test_points_lie_at_their_depth_below_their_quadrilateral(tip, side):
    mesh = tip.mesh
    quads = mesh.skin_quads[strain.pad_quads(mesh)]
    for depth in DEPTHS:
        points = strain.points_at_depth(mesh, depth * MILLIMETRE, side)
        # skin to point along each corner's straight line to the bone, to the same depth, then the mean of the four
        inward = mesh.nodes[mesh.bone_nodes] - mesh.nodes[mesh.skin_nodes]
        room = -np.sum(inward * mesh.normals, axis=1)
        expected = (mesh.nodes[mesh.skin_nodes] + depth * MILLIMETRE * inward / room[:, None])[quads].mean(axis=1)
        np.testing.assert_allclose(points.positions(mesh), expected, atol=1e-12)


def test_the_sides_of_a_border_belong_to_two_tissues(tip):
    anatomy, mesh = tip.anatomy, tip.mesh
    bottoms = np.cumsum([anatomy.stratum_corneum_thickness, anatomy.epidermis_thickness, anatomy.dermis_thickness])
    for k, bottom in enumerate(bottoms):
        for side, tissue in (("shallow", TISSUES[k]), ("deep", TISSUES[k + 1])):
            points = strain.points_at_depth(mesh, bottom * MILLIMETRE, side)
            assert set(mesh.tissue[points.element]) == {TISSUES.index(tissue)}
            shear, _ = points.moduli(tip)
            np.testing.assert_allclose(shear, anatomy.tissue(tissue).shear_modulus * 1e6)


def test_traction_passes_a_border_better_than_strain(coarse):
    # equilibrium: the normal traction is continuous across a border of two tissues, the strain is not
    depth = (coarse.anatomy.stratum_corneum_thickness + coarse.anatomy.epidermis_thickness) * MILLIMETRE
    node = coarse.mesh.fingerprint_centroid
    u = np.zeros(3 * coarse.mesh.n_nodes)
    u[coarse.free_dofs] = SecondOrderModel(coarse.stiffness).solve_static(coarse.patch_force(node, "radial-ulnar"))
    sides = {}
    for side in ("shallow", "deep"):
        points = strain.points_at_depth(coarse.mesh, depth, side)
        shear, _ = points.moduli(coarse)
        sides[side] = strain.apply(strain.operator_at(coarse, points), u), shear[:, None]
    normal = coarse.mesh.normals[coarse.mesh.skin_quads[strain.pad_quads(coarse.mesh)]].mean(axis=1)
    normal /= np.linalg.norm(normal, axis=1)[:, None]

    def slip(values):  # what a strain shears along the border
        along = np.einsum("pab,pb->pa", tensor(values), normal)
        return along - np.sum(along * normal, axis=1)[:, None] * normal

    def jump(a, b):
        return np.linalg.norm(a - b) / np.linalg.norm(a)

    (above, stiff), (below, soft) = sides["shallow"], sides["deep"]
    assert jump(stiff * slip(above), soft * slip(below)) < 0.7 * jump(slip(above), slip(below))


def test_batches_bases_and_free_dofs_give_what_single_answers_give(tip):
    rng = np.random.default_rng(3)
    operator = strain.strain_operator(tip, 1 * MILLIMETRE)
    basis = rng.standard_normal((len(tip.free_dofs), 4))
    weights = rng.standard_normal((2, 5, 4)) + 1j * rng.standard_normal((2, 5, 4))
    fields = np.zeros((2, 5, 3 * tip.mesh.n_nodes), dtype=complex)
    fields[..., tip.free_dofs] = weights @ basis.T
    full = strain.apply(operator, fields.reshape(2, 5, -1, 3))
    free = operator[:, tip.free_dofs]
    modes = strain.apply(free, basis.T)
    np.testing.assert_allclose(np.tensordot(weights, modes, axes=(2, 0)), full, atol=1e-9 * np.abs(full).max())
    np.testing.assert_allclose(strain.apply(free, fields[1, 2][tip.free_dofs]), full[1, 2],
                               atol=1e-12 * np.abs(full).max())


@pytest.mark.parametrize(("depth", "side", "words"), [
    (-1e-4, "deep", "must be zero or more"), (np.nan, "deep", "must be zero or more"), (1.0, "deep", "stay above it"),
    (1e-3, "left", "only has deep and shallow")])
def test_a_depth_or_side_that_does_not_exist_is_refused(tip, depth, side, words):
    with pytest.raises(ValueError, match=words):
        strain.strain_operator(tip, depth, side)


def test_a_field_of_another_length_is_refused(tip):
    with pytest.raises(ValueError, match="take the operator's columns"):
        strain.apply(strain.strain_operator(tip, 1e-3), np.zeros(len(tip.free_dofs)))
