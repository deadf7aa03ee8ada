import numpy as np
import pytest

from rom.fingertip import TISSUES, Anatomy, MeshDensity, build_mesh
from rom.fingertip.anatomy import DIMENSIONS
from rom.fingertip.surfaces import bone_half_sizes


def test_study_is_the_size_of_the_published_model(study, published):
    mesh, figures = study.mesh, published["digitip"]
    assert (mesh.n_nodes, len(mesh.hexahedra)) == (11817, 10240)  # 9 x (17^2 + 16 x 64), 8 x (16^2 + 16 x 64)
    assert abs(mesh.n_nodes / figures["n_nodes"] - 1) < 0.02
    assert len(mesh.rear_nodes) == figures["n_rear_nodes"]
    assert len(study.free_dofs) == 3 * (mesh.n_nodes - mesh.nodes_per_shell)


def test_study_has_the_published_volume(study, published):
    # calibrated through shape.lower_exponent, so this guards the calibration
    assert study.mesh.volume * 1e9 == pytest.approx(published["digitip"]["volume_mm3"], rel=5e-4)


def test_metamodel_has_the_published_loads(metamodel, published):
    figures = published["metamodel"]
    assert len(metamodel.mesh.pad_nodes) == figures["n_load_nodes"]
    assert abs(metamodel.mesh.n_nodes / figures["n_nodes"] - 1) < 0.005


def test_patch_around_the_centroid_is_about_the_published_one(study, published):
    mesh = study.mesh
    patch = mesh.skin_patch(mesh.fingerprint_centroid)
    assert len(patch) == published["digitip"]["frequency_response"]["n_load_nodes"]
    extent = np.ptp(mesh.nodes[patch], axis=0) * 1e3
    radial_ulnar, distal_proximal = published["digitip"]["frequency_response"]["patch_mm"]
    assert extent[1] == pytest.approx(radial_ulnar, rel=0.2)
    assert extent[0] == pytest.approx(distal_proximal, rel=0.2)
    with pytest.raises(ValueError, match="not on the skin"):
        mesh.skin_patch(mesh.nodes_per_shell)


@pytest.mark.parametrize("model", ["study", "metamodel", "coarse"])
def test_mirror_is_exact(model, request):
    mesh = request.getfixturevalue(model).mesh
    np.testing.assert_array_equal(mesh.nodes[mesh.mirror], mesh.nodes * [1, -1, 1])
    np.testing.assert_array_equal(mesh.mirror[mesh.mirror], np.arange(mesh.n_nodes))
    np.testing.assert_array_equal(mesh.normals[mesh.mirror[mesh.skin_nodes]], mesh.normals * [1, -1, 1])
    assert set(mesh.mirror[mesh.pad_nodes]) == set(mesh.pad_nodes)
    here = {(tuple(sorted(element)), tissue) for element, tissue in zip(mesh.hexahedra, mesh.tissue, strict=True)}
    there = {
        (tuple(sorted(element)), tissue)
        for element, tissue in zip(mesh.mirror[mesh.hexahedra], mesh.tissue, strict=True)
    }
    assert here == there


@pytest.mark.parametrize("model", ["study", "metamodel", "coarse"])
def test_elements_are_upright_and_decent(model, request):
    quality = request.getfixturevalue(model).mesh.quality
    assert quality["min_scaled_jacobian"] > 0.3  # measured .36, .36, .40
    assert quality["max_aspect_ratio"] < 100  # measured 44, 90, 37: thin layers beside the bone


def test_normals_are_unit_and_outward(study):
    mesh = study.mesh
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, rtol=1e-14)
    corners = mesh.nodes[mesh.skin_quads]
    facet = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    facet /= np.linalg.norm(facet, axis=1, keepdims=True)
    # facets and the surface's own normals agree to the angle that one element turns through
    assert np.einsum("qj,qkj->qk", facet, mesh.normals[mesh.skin_quads]).min() > 0.6
    inward = mesh.nodes[mesh.skin_nodes + mesh.nodes_per_shell] - mesh.nodes[mesh.skin_nodes]
    assert (np.einsum("ij,ij->i", inward, mesh.normals) < 0).all()


def test_outer_dimensions_are_those_of_table_1(study):
    anatomy, mesh = study.anatomy, study.mesh
    skin = mesh.nodes[mesh.skin_nodes] * 1e3
    assert np.ptp(skin, axis=0) == pytest.approx([28.0, 18.0, 15.0], rel=1e-12)
    bone = mesh.nodes[mesh.bone_nodes] * 1e3
    assert bone[:, 0].max() == pytest.approx(22.5, rel=1e-12)
    joint = bone[bone[:, 0] == 0]
    assert np.ptp(joint, axis=0) == pytest.approx([0, 13.0, 8.0], rel=1e-12)
    # t_stj = 2.9: from the bone's dorsal side to the skin's
    assert skin[:, 2].max() - joint[:, 2].max() == pytest.approx(2.9, rel=1e-12)
    width, height = bone_half_sizes(anatomy, np.array([14.1]))  # neck at l_b - l_bd
    assert (2 * width[0], 2 * height[0]) == pytest.approx((5.3, 3.8), rel=1e-12)


def test_layers_have_their_thickness(study):
    # between the bone's base and the tip nothing squeezes the layers: measured along the normal they are as thick
    # as published
    mesh = study.mesh
    pad = mesh.pad_nodes
    depth = [
        -np.einsum("ij,ij->i", mesh.nodes[pad + shell * mesh.nodes_per_shell] - mesh.nodes[pad], mesh.normals[pad])
        for shell in (1, 2, 4)
    ]
    np.testing.assert_allclose(np.array(depth) * 1e3, np.array([[0.4], [0.5], [2.0]]) * np.ones(len(pad)), rtol=1e-9)


def test_nail_plate_may_differ_from_stratum_corneum(coarse):
    mesh = build_mesh(Anatomy(nail_plate_thickness=0.6), coarse.density)
    plate = coarse.mesh.tissue == TISSUES.index("nail_plate")
    ratio = mesh.element_volumes[plate].sum() / coarse.mesh.element_volumes[plate].sum()
    assert ratio == pytest.approx(1.5, rel=0.05)  # 0.6 mm over 0.4 mm, on a curved surface


def test_pad_is_palmar_and_away_from_edge_and_nail(metamodel):
    mesh, anatomy = metamodel.mesh, metamodel.anatomy
    pad = mesh.nodes[mesh.pad_nodes] * 1e3
    assert (pad[:, 2] < -0.3 * anatomy.palmar_height).all()
    assert (pad[:, 0] > 5).all()
    assert mesh.fingerprint_centroid in mesh.pad_nodes
    assert mesh.nodes[mesh.fingerprint_centroid, 1] == 0


def test_volume_converges_with_density():
    sizes = [build_mesh(Anatomy(), MeshDensity().scaled(factor)).volume for factor in (0.5, 1, 2)]
    assert abs(sizes[2] - sizes[1]) < abs(sizes[1] - sizes[0]) / 2.5  # second order would give 4


@pytest.mark.parametrize("factor", [0.9, 1.1])
@pytest.mark.parametrize("name", DIMENSIONS)
def test_every_dimension_may_change_by_a_tenth(coarse, name, factor):
    anatomy = Anatomy()
    mesh = build_mesh(anatomy.replace(**{name: factor * getattr(anatomy, name)}), coarse.density)
    assert mesh.quality["min_scaled_jacobian"] > 0.1


def test_hash_follows_the_content(coarse):
    again = build_mesh(Anatomy(), coarse.density)
    other = build_mesh(Anatomy(bone_length=22.4), coarse.density)
    assert again.mesh_hash == coarse.mesh.mesh_hash != other.mesh_hash


def test_arrays_are_read_only(coarse):
    with pytest.raises(ValueError, match="read-only"):
        coarse.mesh.nodes[0] = 0


def test_density_round_trips_and_scales():
    density = MeshDensity((14, 16), 6, 4)
    assert MeshDensity.from_dict(density.to_dict()) == density
    assert MeshDensity().scaled(0.5) == MeshDensity((8, 8), 4, 4, (1, 1, 1, 2))
