import numpy as np
import pytest

from rom.fingertip import Anatomy, MeshDensity, build_mesh, interpolation_from

FINE = MeshDensity((20, 16), 9, 7, (1, 1, 3, 5))


@pytest.fixture(scope="module")
def fine():
    return build_mesh(Anatomy(), FINE)


@pytest.mark.parametrize("density", [MeshDensity((4, 4), 2, 2, (1, 1, 1, 1)), MeshDensity((14, 16), 6, 4)])
def test_partition_of_unity(fine, density):
    coarse = build_mesh(Anatomy(), density)
    matrix = interpolation_from(coarse, fine)
    assert matrix.shape == (fine.n_nodes, coarse.n_nodes)
    assert matrix.data.min() >= 0
    np.testing.assert_allclose(matrix @ np.ones(coarse.n_nodes), 1, rtol=1e-14)
    # logical coordinates are themselves linear in every cell of cap and layers
    cap = np.abs(fine.logical[:, :2]).max(axis=1) <= 0.5
    np.testing.assert_allclose((matrix @ coarse.logical)[cap], fine.logical[cap], atol=1e-12)
    np.testing.assert_allclose((matrix @ coarse.logical)[:, 2], fine.logical[:, 2], atol=1e-12)
    radial = np.abs(coarse.logical[:, :2]).max(axis=1)
    np.testing.assert_allclose((matrix @ radial)[~cap], np.abs(fine.logical[~cap, :2]).max(axis=1), atol=1e-12)


def test_same_mesh_gives_the_identity(fine):
    difference = interpolation_from(fine, fine).tocoo()
    assert difference.nnz == fine.n_nodes
    np.testing.assert_array_equal(difference.row, difference.col)


def test_nested_nodes_keep_their_values():
    # with a nail bed as deep as the skin beside it: the nail's edge, which differs by density, then moves no node
    anatomy = Anatomy().replace_shape(nail_bed_thickness=1.6)
    coarse = build_mesh(anatomy, MeshDensity().scaled(0.5))
    fine = build_mesh(anatomy, MeshDensity())
    matrix = interpolation_from(coarse, fine)
    single = np.flatnonzero(np.diff(matrix.indptr) == 1)
    assert len(single) > coarse.n_nodes / 2
    # one map for all densities: where a fine node is a coarse node, both stand at the same place
    np.testing.assert_allclose((matrix @ coarse.nodes)[single], fine.nodes[single], atol=1e-12)


def test_smooth_fields_converge_at_second_order(fine):
    def field(mesh):
        x, y, z = mesh.nodes.T * 100
        return np.sin(x) + np.cos(1.5 * y) * np.exp(z)

    exact, errors = field(fine), []
    for size in (4, 8, 16):
        coarse = build_mesh(Anatomy(), MeshDensity((size, size), size // 2, size // 2, (1, 1, 2, size // 2)))
        errors.append(np.sqrt(np.mean((interpolation_from(coarse, fine) @ field(coarse) - exact) ** 2)))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 1.7).all()  # two, less what the surfaces' own kink at z = 0 costs
