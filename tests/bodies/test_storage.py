"""A body's file gives the same body back, and says when it is not what was written."""

import netCDF4
import numpy as np
import pytest
import scipy.sparse as sp
from brick_models import STEEL, bricks

from rom.bodies import Body, Material, body_from_mesh, read_body
from rom.errors import SchemaError


@pytest.fixture
def rich():
    """Two regions, loss, viscous damping, a held face, sets, doubts."""
    import meshio

    nodes, cells = bricks()
    left = nodes[cells].mean(axis=1)[:, 0] < 0.15
    mesh = meshio.Mesh(nodes, [("hexahedron", cells)], point_sets={"tip": np.array([35, 34])},
                       cell_sets={"bone": [np.flatnonzero(left)], "skin": [np.flatnonzero(~left)]})
    body = body_from_mesh(mesh, {"bone": STEEL, "skin": Material(1e6, 0.49, 1000, loss_factor=0.2)}, held=["x=min"],
                          formulation="full", name="two regions")
    return Body(body.stiffness_by_region, body.model.mass, loss_stiffness=body.model.loss_stiffness,
                viscous=sp.csr_array(2 * body.model.mass), dof_names=body.dof_names, grid=body.grid, name=body.name,
                doubts=body.doubts, origin={"format": "mesh", "notes": ["a note"]})


def test_round_trip(tmp_path, rich):
    rich.write(tmp_path / "rich.nc")
    back = read_body(tmp_path / "rich.nc")
    assert back.content_hash == rich.content_hash
    for one, other in ((back.model.stiffness, rich.model.stiffness), (back.model.mass, rich.model.mass),
                       (back.model.loss_stiffness, rich.model.loss_stiffness), (back.viscous, rich.viscous)):
        assert abs(one - other).max() == 0
    assert list(back.stiffness_by_region) == ["bone", "skin"] == list(back.grid.region_names)
    assert (back.name, back.doubts, back.origin) == (rich.name, rich.doubts, rich.origin) and len(back.doubts) == 1
    assert back.dof_names.tolist() == rich.dof_names.tolist() and back.grid.node_names.tolist() == list(range(1, 37))
    np.testing.assert_array_equal(back.grid.skin, rich.grid.skin)
    np.testing.assert_array_equal(back.grid.region["hexahedron"], rich.grid.region["hexahedron"])
    np.testing.assert_array_equal(back.grid.sets["tip"], [35, 34])


def test_a_body_of_matrices_alone(tmp_path):
    body = Body(sp.csr_array(np.array([[2.0, -1.0], [-1.0, 2.0]])))
    body.write(tmp_path / "plain.nc")
    back = read_body(tmp_path / "plain.nc")
    assert back.content_hash == body.content_hash and back.grid is None and not back.has_mass
    assert back.dof_names.tolist() == [0, 1]


def test_refusals(tmp_path, rich):
    with pytest.raises(ValueError, match=r"end the name in \.nc"):
        rich.write(tmp_path / "rich.h5")
    rich.write(tmp_path / "rich.nc")
    with netCDF4.Dataset(tmp_path / "rich.nc", "a") as file:
        file["mass_value"][0] *= 1 + 1e-15
    with pytest.raises(SchemaError, match="was changed after it was written"):
        read_body(tmp_path / "rich.nc")
    (tmp_path / "short.nc").write_bytes((tmp_path / "rich.nc").read_bytes()[:4000])
    with pytest.raises(SchemaError, match="damaged at its end"):
        read_body(tmp_path / "short.nc")
    with netCDF4.Dataset(tmp_path / "foreign.nc", "w") as file:
        file.createDimension("dof", 3)
    with pytest.raises(SchemaError, match="no body of version"):
        read_body(tmp_path / "foreign.nc")
    with pytest.raises(SchemaError, match="does not exist"):
        read_body(tmp_path / "absent.nc")


def test_another_matrix_name_or_region_is_another_content(rich):
    def other(**changes):
        given = {"stiffness": rich.stiffness_by_region, "mass": rich.model.mass, "viscous": rich.viscous,
                 "loss_stiffness": rich.model.loss_stiffness, "dof_names": rich.dof_names, "grid": rich.grid} | changes
        return Body(given.pop("stiffness"), given.pop("mass"), **given).content_hash

    assert other() == rich.content_hash
    changed = [other(viscous=None), other(mass=2 * rich.model.mass), other(stiffness=rich.model.stiffness),
               other(dof_names=rich.dof_names[::-1]), other(grid=None), other(loss_stiffness=None)]
    assert len({rich.content_hash, *changed}) == 7
