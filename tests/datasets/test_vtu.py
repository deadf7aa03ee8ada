"""What is written for ParaView is what a reader finds, in VTK's order, whole or not at all."""

import meshio
import numpy as np
import pytest

from rom.datasets.vtu import write_vtu
from rom.fingertip.elements import element_volumes

# VTK's documentation of vtkHexahedron: parametric coordinates of its eight points, in order
VTK_CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


@pytest.fixture
def mesh(small_tip):
    return small_tip.mesh


def complex_field(shape, seed=0):
    rng = np.random.default_rng(seed)
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def test_the_mesh_comes_back_with_its_tissues(mesh, tmp_path):
    read = meshio.read(write_vtu(tmp_path / "a.vtu", mesh, {}))
    np.testing.assert_array_equal(read.points, mesh.nodes)
    np.testing.assert_array_equal(read.cells_dict["hexahedron"], mesh.hexahedra)
    np.testing.assert_array_equal(read.cell_data["tissue"][0], mesh.tissue)


def test_fields_come_back_with_complex_ones_in_three_parts(mesh, tmp_path):
    scalar, vector = complex_field(mesh.n_nodes), complex_field((mesh.n_nodes, 3), seed=1)
    real, flag = vector.real.copy(), mesh.nodes[:, 2] < 0
    energy, phase = mesh.element_volumes, complex_field(len(mesh.hexahedra), seed=2)
    path = write_vtu(tmp_path / "a.vtu", mesh, {"p": scalar, "u": vector, "shape": real, "palmar": flag},
                     {"energy": energy, "phase": phase})
    read = meshio.read(path)
    assert set(read.point_data) == {"shape", "palmar", *(f"{a}_{b}" for a in "pu" for b in
                                                         ("real", "imag", "magnitude"))}
    np.testing.assert_array_equal(read.point_data["u_real"] + 1j * read.point_data["u_imag"], vector)
    np.testing.assert_array_equal(read.point_data["p_magnitude"], np.abs(scalar))
    # the amplitude's length squared is the sum of squares of all its real and imaginary parts
    np.testing.assert_allclose(read.point_data["u_magnitude"] ** 2, (vector.real ** 2 + vector.imag ** 2).sum(axis=1))
    np.testing.assert_array_equal(read.point_data["shape"], real)
    np.testing.assert_array_equal(read.point_data["palmar"], flag)
    np.testing.assert_array_equal(read.cell_data["energy"][0], energy)
    np.testing.assert_array_equal(read.cell_data["phase_imag"][0], phase.imag)


def test_corners_stand_in_the_order_of_vtk(mesh, tmp_path):
    # with VTK's own corner functions every element has a positive Jacobian and the volume that assembly uses
    read = meshio.read(write_vtu(tmp_path / "a.vtu", mesh, {}))
    corners = read.points[read.cells_dict["hexahedron"]]
    volume = np.zeros(len(corners))
    points = 0.5 + np.array([-1, 1]) / np.sqrt(12)  # Gauss points of [0, 1]
    for place in np.stack(np.meshgrid(points, points, points), axis=-1).reshape(-1, 3):
        factors = np.where(VTK_CORNERS == 1, place, 1 - place)
        sign = np.where(VTK_CORNERS == 1, 1.0, -1.0)
        gradient = np.stack([sign[:, i] * np.delete(factors, i, axis=1).prod(axis=1) for i in range(3)], axis=1)
        jacobian = np.linalg.det(np.einsum("eni,nj->eij", corners, gradient))
        assert (jacobian > 0).all()
        volume += jacobian / 8
    np.testing.assert_allclose(volume, element_volumes(mesh.nodes, mesh.hexahedra), rtol=1e-12)


def test_the_file_is_smaller_than_its_numbers(mesh, tmp_path):
    field = np.tile(mesh.nodes[:, :1], (1, 3))
    path = write_vtu(tmp_path / "a.vtu", mesh, {f"u{i}": field for i in range(8)})
    assert path.stat().st_size < 8 * field.nbytes


@pytest.mark.parametrize(("points", "cells", "words"), [
    ({"u": np.zeros(7)}, {}, r"u has the shape \(7,\)"),
    ({"u": np.zeros((534, 3, 3))}, {}, "one row for each node"),
    ({"u": np.zeros((534, 0))}, {}, "k from 1 to 9"),
    ({"u": np.full((534, 3), np.nan)}, {}, "u holds nan at node 0"),
    ({"u": np.full(534, 1j * np.inf)}, {}, "every value must be finite"),
    ({"u": ["a"] * 534}, {}, "only numbers"),
    ({"u": np.zeros(534, complex), "u_real": np.zeros(534)}, {}, "'u_real', but names must differ"),
    ({}, {"e": np.zeros(534)}, "one row for each element"),
    ({}, {"tissue": np.zeros(400)}, "'tissue', but names must differ")])
def test_bad_fields_are_refused_and_leave_no_file(mesh, tmp_path, points, cells, words):
    assert mesh.n_nodes == 534 and len(mesh.hexahedra) == 400
    with pytest.raises(ValueError, match=words):
        write_vtu(tmp_path / "a.vtu", mesh, points, cells)
    assert not list(tmp_path.iterdir())


def test_another_ending_is_refused(mesh, tmp_path):
    with pytest.raises(ValueError, match=r"end it in \.vtu"):
        write_vtu(tmp_path / "a.vtk", mesh, {})


def test_a_failed_write_keeps_the_old_file(mesh, tmp_path, monkeypatch):
    path = write_vtu(tmp_path / "a.vtu", mesh, {})
    before = path.read_bytes()

    def full(*_, **__):
        raise OSError("disk full")

    monkeypatch.setattr(meshio, "write", full)
    with pytest.raises(OSError, match="disk full"):
        write_vtu(path, mesh, {"x": mesh.nodes[:, 0]})
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.vtu"]
