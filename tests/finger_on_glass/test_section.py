import numpy as np
import pytest

from rom.finger_on_glass.element import shape_gradients
from rom.finger_on_glass.section import Section, mesh_section


def test_radial_directions_agree_with_brute_force():
    """The nearest of 20,000 points of the bone."""
    section = Section(bone_width=9.0, bone_height=3.5, bone_offset=0.7)
    rng = np.random.default_rng(3)
    angle = rng.uniform(0, 2 * np.pi, 60)
    points = section.bone_outline(angle) + rng.uniform(0.05, 3.0, 60)[:, None] * section.bone_normals(angle)
    fine = np.linspace(0, 2 * np.pi, 20_001)
    outline = section.bone_outline(fine)
    nearest = outline[[int(np.argmin(((outline - p) ** 2).sum(axis=1))) for p in points]]
    expected = (points - nearest) / np.linalg.norm(points - nearest, axis=1)[:, None]
    found = section.radial_directions(points)
    # spacing of the points on the bone 1.4e-3 mm, over the smallest distance of 0.05 mm
    assert np.abs(found - expected).max() < 0.5 * 1.5e-3 / 0.05
    assert np.abs(np.linalg.norm(found, axis=1) - 1).max() < 1e-12


def test_radial_directions_on_the_axes():
    """By symmetry."""
    section = Section()
    points = np.array([[0.0, -6.0], [0.0, 7.0], [7.0, section.bone_offset], [-7.0, section.bone_offset]])
    assert np.allclose(section.radial_directions(points), [[0, -1], [0, 1], [1, 0], [-1, 0]], atol=1e-12)


@pytest.mark.parametrize(("rays", "layers"), [(16, 2), (40, 4), (100, 12)])
def test_mesh_fills_the_ring(rays, layers):
    """Areas of ellipses: pi a b; polygons stay inside, with an error of the second order in the rays."""
    section = Section()
    mesh = mesh_section(section, rays, layers)
    assert (mesh.rays, mesh.layers, len(mesh.nodes)) == (rays, layers, rays * (layers + 1))
    area = shape_gradients(mesh.nodes[mesh.quads])[1].sum()
    exact = np.pi / 4 * (section.width * section.height - section.bone_width * section.bone_height)
    assert 0 < exact - area < 40 / rays**2 * exact
    skin, bone = mesh.nodes[mesh.skin_nodes], mesh.nodes[mesh.bone_nodes]
    assert np.allclose((skin[:, 0] / 9) ** 2 + (skin[:, 1] / 7.5) ** 2, 1)
    assert np.allclose((bone[:, 0] / 4.3) ** 2 + ((bone[:, 1] - 1) / 2.1) ** 2, 1)
    assert np.argmin(skin[:, 1]) == 0


def test_mesh_is_symmetric():
    mesh = mesh_section(Section(), 40, 4)
    skin = mesh.nodes[mesh.skin_nodes]
    mirrored = np.roll(skin[::-1], 1, axis=0)
    assert np.abs(mirrored[:, 0] + skin[:, 0]).max() < 1e-6
    assert np.abs(mirrored[:, 1] - skin[:, 1]).max() < 1e-6


def test_mesh_lines_are_the_radial_directions():
    section = Section()
    mesh = mesh_section(section, 40, 4)
    lines = mesh.nodes.reshape(40, 5, 2)
    direction = (lines[:, -1] - lines[:, 0]) / np.linalg.norm(lines[:, -1] - lines[:, 0], axis=1)[:, None]
    assert np.abs(section.radial_directions(lines[:, 2]) - direction).max() < 1e-6


@pytest.mark.parametrize(("changes", "words"), [
    ({"bone_offset": 6.0}, "reaches out of a skin"), ({"bone_width": 20.0}, "reaches out of a skin"),
    ({"width": 0.0}, "above 0"), ({"height": float("nan")}, "finite number above 0"),
    ({"bone_height": True}, "finite number above 0")])
def test_impossible_sections_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        Section(**changes)


@pytest.mark.parametrize(("rays", "layers"), [(3, 4), (40, 1), (40.5, 4), (True, 4)])
def test_impossible_meshes_are_refused(rays, layers):
    with pytest.raises(ValueError, match="give a whole number from"):
        mesh_section(Section(), rays, layers)


def test_inverted_elements_are_refused():
    mesh = mesh_section(Section(), 16, 2)
    with pytest.raises(ValueError, match="turned inside out"):
        shape_gradients(mesh.nodes[mesh.quads[:, ::-1]])
