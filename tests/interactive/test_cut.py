import numpy as np
import pytest

from rom.interactive.cut import plane_section, section


def bricks(counts, lengths):
    """A box of bricks at the origin: nodes (n, 3) and hexahedra (e, 8) in VTK's order."""
    axes = [np.linspace(0, length, count + 1) for count, length in zip(counts, lengths, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape([count + 1 for count in counts])
    i, j, k = (part.ravel() for part in np.meshgrid(*map(np.arange, counts), indexing="ij"))
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    return nodes, np.stack([number[i + a, j + b, k + c] for a, b, c in corners], axis=1)


def area(found):
    a, b, c = found.vertices[found.triangles].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("place", [0.1, 0.37, 0.5, 0.999])
def test_a_box_is_cut_in_its_section(axis, place):
    lengths = np.array([2.0, 3.0, 5.0])
    nodes, hexahedra = bricks((4, 2, 6), lengths)
    found = plane_section(nodes, hexahedra, np.arange(len(hexahedra)), axis, place * lengths[axis])
    assert area(found) == pytest.approx(np.delete(lengths, axis).prod(), rel=1e-12)
    np.testing.assert_allclose(found.vertices[:, axis], place * lengths[axis], rtol=0, atol=1e-14)


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_a_plane_through_nodes_counts_each_face_once(tilt):
    nodes, hexahedra = bricks((4, 4, 4), (1.0, 1.0, 1.0))
    sheared = nodes + tilt * nodes[:, [1]] * [0.0, 0.0, 1.0]  # leaves x alone
    found = plane_section(sheared, hexahedra, np.zeros(len(hexahedra), int), 0, 0.5)
    assert area(found) == pytest.approx(1.0, rel=1e-12)


def test_a_cylinder_is_cut_in_a_circle():
    nodes, hexahedra = bricks((1, 64, 3), (1.0, 2 * np.pi, 2.0))
    radius, angle = 1.0 + nodes[:, 2], nodes[:, 1]
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), nodes[:, 0]])
    found = plane_section(ring, hexahedra, np.zeros(len(hexahedra), int), 2, 0.25)
    polygon = 64 / 2 * np.sin(2 * np.pi / 64)  # of a circle of radius one
    assert area(found) == pytest.approx(polygon * (3.0**2 - 1.0), rel=1e-12)
    assert area(found) == pytest.approx(np.pi * 8, rel=2e-3)


def test_a_linear_field_is_carried_exactly(small_tip):
    slope, start = np.array([[0.3, -2.0, 1.1], [0.0, 4.0, -0.7]]), np.array([0.2, -5.0])
    nodal = small_tip.mesh.nodes @ slope.T + start
    for axis, place in (("x", 14.0), ("y", 0.0), ("z", -3.21)):
        found = section(small_tip.mesh, axis, place)
        np.testing.assert_allclose(found.field(nodal), found.vertices @ slope.T + start, rtol=1e-13, atol=1e-13)
        np.testing.assert_allclose(found.vertices[:, "xyz".index(axis)], place * 1e-3, rtol=0, atol=1e-15)


def test_sections_of_the_fingertip_add_up_to_its_volume(small_tip):
    edges = np.linspace(0, 28.0, 141)
    middles = (edges[1:] + edges[:-1]) / 2
    areas = [area(section(small_tip.mesh, "x", x)) for x in middles]
    assert sum(areas) * 0.2e-3 == pytest.approx(small_tip.mesh.volume, rel=5e-3)


def test_a_plane_beside_the_tissue_finds_nothing(small_tip):
    found = section(small_tip.mesh, "z", 500.0)
    assert found.triangles.shape == (0, 3)
    assert found.field(np.zeros((small_tip.mesh.n_nodes, 3), complex)).shape == (0, 3)


def test_triangles_know_their_tissue():
    nodes, hexahedra = bricks((2, 1, 1), (2.0, 1.0, 1.0))
    found = plane_section(nodes, hexahedra, np.array([4, 7]), 2, 0.5)
    middle = found.vertices[found.triangles].mean(axis=1)[:, 0]
    np.testing.assert_array_equal(found.tissue, np.where(middle < 1.0, 4, 7))
