"""Bodies from meshes: the matrices of scikit-fem's own assembly, regions, held places, and refusals."""

import math

import meshio
import numpy as np
import pytest
import skfem
from brick_models import STEEL, bricks
from skfem.models.elasticity import lame_parameters, linear_elasticity

from rom.bodies import Body, Material, body_from_mesh, read_body
from rom.bodies.elements import KINDS, local_nodes, shape

SOFT = Material(young=1e6, poisson=0.3, density=1000.0, loss_factor=0.2)
# of a brick, such that facing sides are cut alike
TETRAHEDRA = [(0, 1, 2, 6), (0, 5, 1, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 4, 5, 6), (0, 7, 4, 6)]


def quadratic(kind, bend=0.0):
    """A mesh of one kind over the box of bricks, its mid-side nodes on a bent surface if asked for."""
    nodes, cells = bricks((2, 1, 1))
    if kind.startswith("tetra"):
        cells = np.concatenate([cells[:, list(corners)] for corners in TETRAHEDRA])
    linear = "tetra" if kind.startswith("tetra") else "hexahedron"
    weight = shape_at_nodes(linear, local_nodes(kind))
    points, where = np.unique(np.round(np.einsum("ml,eld->emd", weight, nodes[cells]).reshape(-1, 3), 12), axis=0,
                              return_inverse=True)
    points = points + bend * np.column_stack([0 * points[:, 0], points[:, 0] ** 2, 0 * points[:, 0]])
    return meshio.Mesh(points, [(kind, where.reshape(-1, len(weight)))])


def shape_at_nodes(kind, where):
    element = getattr(skfem, KINDS[kind][0])()
    distance = np.abs(local_nodes(kind)[:, None] - element.doflocs[None]).max(axis=2)
    return np.stack([element.lbasis(where.T, int(i))[0] * np.ones(len(where)) for i in distance.argmin(axis=1)], axis=1)


@pytest.mark.parametrize("kind", KINDS)
def test_shape_functions_are_one_at_their_own_node_and_sum_to_one(kind):
    np.testing.assert_allclose(shape_at_nodes(kind, local_nodes(kind)), np.eye(len(local_nodes(kind))), atol=1e-14)
    value, gradient, weight = shape(kind)
    np.testing.assert_allclose(value.sum(axis=1), 1)
    np.testing.assert_allclose(gradient.sum(axis=1), 0, atol=1e-13)
    np.testing.assert_allclose(weight.sum(), 1 / 6 if kind.startswith("tetra") else 1)


@pytest.mark.parametrize(("kind", "mesh_class", "element", "bend"), [
    ("tetra", skfem.MeshTet1, skfem.ElementTetP1, 0), ("tetra10", skfem.MeshTet2, skfem.ElementTetP2, 0),
    ("hexahedron", skfem.MeshHex1, skfem.ElementHex1, 0.3), ("hexahedron27", skfem.MeshHex2, skfem.ElementHex2, 0)])
def test_matrices_are_those_of_scikit_fems_own_forms(kind, mesh_class, element, bend):
    """Eigenvalues of K and M do not know the order of the nodes."""
    from skfem.io.meshio import from_meshio

    mesh = quadratic(kind, bend)
    ours = body_from_mesh(mesh, STEEL, formulation="full").model
    theirs = from_meshio(mesh)
    assert isinstance(theirs, mesh_class)
    basis = skfem.Basis(theirs, skfem.ElementVector(element()), intorder=KINDS[kind][1])
    mass = skfem.BilinearForm(lambda u, v, w: STEEL.density * sum(u[i] * v[i] for i in range(3)))
    elastic = linear_elasticity(*lame_parameters(STEEL.young, STEEL.poisson))
    for mine, form in ((ours.stiffness, elastic), (ours.mass, mass)):
        expected = np.linalg.eigvalsh(form.assemble(basis).toarray())
        np.testing.assert_allclose(np.linalg.eigvalsh(mine.toarray()), expected, atol=1e-12 * expected[-1])


@pytest.mark.parametrize("kind", KINDS)
def test_patch_test_on_bent_cells(kind):
    """A linear displacement has the energy of its constant strain in any mesh, and rigid motions have none."""
    mesh = quadratic(kind, bend=0.2)
    body = body_from_mesh(mesh, STEEL, formulation="full")
    volume = body.model.mass.sum() / 3 / STEEL.density
    gradient = np.array([[1.0, 0.4, 0.2], [0.1, -0.5, 0.3], [0.7, 0.0, 0.2]])
    u = (mesh.points @ gradient.T).ravel()
    strain = (gradient + gradient.T) / 2
    lame, mu = lame_parameters(STEEL.young, STEEL.poisson)
    energy = volume * (lame * np.trace(strain) ** 2 + 2 * mu * np.sum(strain**2))
    np.testing.assert_allclose(u @ (body.model.stiffness @ u), energy, rtol=1e-12)
    spin = (mesh.points @ np.array([[0, 1.0, 2.0], [-1.0, 0, 0.5], [-2.0, -0.5, 0]]).T).ravel()
    assert abs(spin @ (body.model.stiffness @ spin)) < 1e-12 * energy


def test_bars_first_frequency_is_that_of_a_beam():
    """A cantilever after Euler and Bernoulli: 1.8751^2 sqrt(E I / rho A) / (2 pi L^2); slender, so within .2 %."""
    nodes, cells = bricks((12, 1, 1), size=(1.0, 0.03, 0.05))
    nodes[:, 2] -= 0.1 * nodes[:, 0]
    nodes[:, 1] -= 0.05 * nodes[:, 2]
    weight = shape_at_nodes("hexahedron", local_nodes("hexahedron20"))
    points, where = np.unique(np.round(np.einsum("ml,eld->emd", weight, nodes[cells]).reshape(-1, 3), 12), axis=0,
                              return_inverse=True)
    cork = Material(1e9, 0.0, 1000.0)  # which does not stiffen where it is held
    body = Body.from_mesh(meshio.Mesh(points, [("hexahedron20", where.reshape(-1, 20))]), cork, held=["x=min"])
    exact = 1.87510407**2 / (2 * math.pi) * math.sqrt(cork.young * 0.03**2 / 12 / cork.density)
    np.testing.assert_allclose(body.model.natural_modes(count=1).frequency_hz, exact, rtol=0.002)


def test_regions_by_name_from_a_file_survive(tmp_path):
    nodes, cells = bricks()
    left = nodes[cells].mean(axis=1)[:, 0] < 0.15
    blocks = [("hexahedron", cells[left]), ("hexahedron", cells[~left]), ("quad", cells[left][:1, [0, 4, 7, 3]])]
    mesh = meshio.Mesh(nodes, blocks, cell_data={
        "gmsh:physical": [np.full(len(one), tag) for (_, one), tag in zip(blocks, (4, 9, 4), strict=True)],
        "gmsh:geometrical": [np.ones(len(one), dtype=int) for _, one in blocks]},
                       field_data={"bone": np.array([4, 3]), "skin": np.array([9, 3]), "clamp": np.array([4, 2])})
    meshio.write(tmp_path / "two.msh", mesh, file_format="gmsh22", binary=False)
    body = read_body(tmp_path / "two.msh", materials={"bone": STEEL, "skin": SOFT}, held=["clamp", "x=max:y"], scale=2)
    assert body.grid.region_names == ("bone", "skin") and list(body.stiffness_by_region) == ["bone", "skin"]
    assert body.model.n == 3 * 36 - 3 * 4 - 9
    np.testing.assert_array_equal(body.model.loss_stiffness.toarray(), 0.2 * body.stiffness_by_region["skin"].toarray())
    np.testing.assert_allclose(np.ptp(body.grid.nodes[:, 0]), 0.6)
    assert body.dof_names[0] == f"{body.grid.node_names[body.grid.free[0] // 3]} {'xyz'[body.grid.free[0] % 3]}"
    with pytest.raises(ValueError, match="region 'skin' has no material"):
        read_body(tmp_path / "two.msh", materials={"bone": STEEL})
    with pytest.raises(ValueError, match="region 'bone' has no material: the mesh has the regions bone, skin"):
        read_body(tmp_path / "two.msh")


def test_a_mesh_of_scikit_fem_with_its_own_names():
    mesh = skfem.MeshTet().refined(2).with_boundaries({"floor": lambda x: x[2] == 0}) \
        .with_subdomains({"left": lambda x: x[0] < 0.5, "right": lambda x: x[0] > 0.5})
    body = Body.from_mesh(mesh, {"left": STEEL, "right": SOFT}, held=["floor"])
    floor = np.flatnonzero(body.grid.nodes[:, 2] == 0)
    assert body.model.n == 3 * (mesh.nvertices - len(floor)) and len(body.stiffness_by_region) == 2


def test_tetrahedra_inside_out_are_turned_round_and_the_skin_looks_outwards():
    mesh = quadratic("tetra10")
    flipped = mesh.cells[0].data[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    body, other = (body_from_mesh(meshio.Mesh(mesh.points, [("tetra10", cells)]), STEEL)
                   for cells in (mesh.cells[0].data, flipped))
    assert abs(body.model.stiffness - other.model.stiffness).max() < 1e-12 * abs(body.model.stiffness).max()
    for grid in (body.grid, other.grid):
        faces = grid.nodes[grid.skin[:, :3]]
        normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
        assert len(faces) == 20  # ten square sides of the two bricks, two triangles each
        # divergence theorem: the volume, that of the box, as shear does not change it
        np.testing.assert_allclose(np.einsum("fi,fi->", normal, faces.mean(axis=1)) / 6, 0.3 * 0.1 * 0.08)


def test_refusals_and_doubts():
    nodes, cells = bricks()
    mesh = meshio.Mesh(nodes, [("hexahedron", cells)])
    with pytest.raises(ValueError, match="inside out"):
        body_from_mesh(meshio.Mesh(nodes, [("hexahedron", cells[:, [4, 5, 6, 7, 0, 1, 2, 3]])]), STEEL)
    with pytest.raises(ValueError, match="cells of the kind 'quad'"):
        body_from_mesh(meshio.Mesh(nodes, [("quad", cells[:, :4])]), STEEL)
    with pytest.raises(ValueError, match="no material"):
        body_from_mesh(mesh)
    with pytest.raises(ValueError, match=r"no node lies in 'z>5'.*reaches from 0 0 0 to 0\.3"):
        body_from_mesh(mesh, STEEL, held=["z>5"])
    with pytest.raises(ValueError, match="'roof' is no place"):
        body_from_mesh(mesh, STEEL, held=["roof"])
    with pytest.raises(ValueError, match="component q"):
        body_from_mesh(mesh, STEEL, held=["x=min:q"])
    with pytest.raises(ValueError, match="nothing is left"):
        body_from_mesh(mesh, STEEL, held=["x>=min"])
    with pytest.raises(ValueError, match=r"poisson=0\.5 cannot be"):
        Material(1e6, 0.5, 1000)
    rubber = Material(1e6, 0.4999, 1000)
    assert not body_from_mesh(mesh, rubber).doubts
    assert "lock at Poisson's ratio 0.4999" in body_from_mesh(mesh, rubber, formulation="full").doubts[0]


def test_labels_of_an_abaqus_deck_join_matrices_and_mesh(tmp_path, block):
    import model_files

    nodes, cells = bricks()
    lines = ["*Node", *(f"{10 * (i + 1)}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(nodes.tolist())),
             "*Element, type=C3D8",
             *(", ".join(map(str, [k + 1, *(10 * (cell + 1)).tolist()])) for k, cell in enumerate(cells)),
             "*Nset, nset=tip", "360, 350"]
    (tmp_path / "job.inp").write_text("\n".join(lines) + "\n")
    names = [(10 * node, dof) for node, dof in model_files.labels(block)]
    model_files.write_matrix_input(tmp_path / "job_STIF1.mtx", block.model.stiffness, names)
    body = read_body(tmp_path / "job_STIF1.mtx", mesh=tmp_path / "job.inp", held=["tip:x", "100 z"])
    assert body.model.n == 81 - 3 and "360 y" in body.dof_names and "360 x" not in body.dof_names
    node = body.grid.free[body.dof_names.tolist().index("360 y")] // 3
    np.testing.assert_allclose(body.grid.nodes[node], nodes[35])
    own = body_from_mesh(tmp_path / "job.inp", STEEL, held=["x=min"], formulation="full")
    assert abs(own.model.stiffness - block.model.stiffness).max() < 1e-9 * abs(block.model.stiffness).max()
    assert own.dof_names[0] == "100 x"
