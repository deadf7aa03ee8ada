"""The element by itself: patch test, rigid bodies, and benchmarks on converging meshes."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from rom.fingertip.elements import assemble, element_mass, element_stiffness, element_volumes
from rom.fullorder import factorize, natural_modes

FORMULATIONS = ("full", "b-bar")


def moduli(elastic_modulus, nu):
    return elastic_modulus / (2 * (1 + nu)), elastic_modulus / (3 * (1 - 2 * nu))


@pytest.fixture(scope="module")
def distorted(brick):
    nodes, hexahedra = brick((3, 2, 2), (3.0, 2.0, 2.0))
    inside = ((nodes > 0) & (nodes < [3, 2, 2])).all(axis=1)
    nodes[inside] += np.random.default_rng(1).uniform(-0.3, 0.3, (inside.sum(), 3))
    return nodes, hexahedra, inside


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_patch_test_is_exact(distorted, formulation):
    """A linear displacement given on the boundary is found inside (Irons' patch test), here at nu = .45."""
    nodes, hexahedra, inside = distorted
    exact = nodes @ np.random.default_rng(2).normal(size=(3, 3)).T
    stiffness = assemble(hexahedra, element_stiffness(nodes, hexahedra, *moduli(3.0, 0.45), formulation), len(nodes))
    free = np.flatnonzero(np.repeat(inside, 3))
    held = np.flatnonzero(~np.repeat(inside, 3))
    found = spsolve(stiffness[free][:, free].tocsc(), -stiffness[free][:, held] @ exact.ravel()[held])
    np.testing.assert_allclose(found, exact.ravel()[free], rtol=0, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_uniform_strain_has_its_energy(distorted, formulation):
    # analytic: V (mu |dev eps|^2 + kappa tr(eps)^2 / 2); V = 12 and nu = .45
    nodes, hexahedra, _ = distorted
    mu, kappa = moduli(3.0, 0.45)
    gradient = np.array([[0.1, 0.3, 0.0], [-0.2, 0.2, 0.4], [0.1, 0.0, -0.15]])
    strain = (gradient + gradient.T) / 2
    deviator = strain - np.trace(strain) / 3 * np.eye(3)
    energy = 12.0 * (mu * (deviator**2).sum() + kappa * np.trace(strain) ** 2 / 2)
    stiffness = assemble(hexahedra, element_stiffness(nodes, hexahedra, mu, kappa, formulation), len(nodes))
    field = (nodes @ gradient.T).ravel()
    assert field @ stiffness @ field / 2 == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_exactly_six_rigid_modes(distorted, formulation):
    # the free body has three translations and three rotations; hourglass modes would add zeros
    nodes, hexahedra, _ = distorted
    stiffness = assemble(hexahedra, element_stiffness(nodes, hexahedra, *moduli(3.0, 0.45), formulation), len(nodes))
    values = np.linalg.eigvalsh(stiffness.toarray())
    assert (np.abs(values[:6]) < 1e-12 * values[-1]).all()
    assert values[6] > 1e-4 * values[-1]


def test_volume_and_mass_of_a_distorted_box(distorted):
    nodes, hexahedra, _ = distorted
    assert element_volumes(nodes, hexahedra).sum() == pytest.approx(12.0, rel=1e-13)  # 3 x 2 x 2
    mass = assemble(hexahedra, element_mass(nodes, hexahedra, 2.5), len(nodes))
    assert mass.sum() == pytest.approx(30.0, rel=1e-13)
    assert np.linalg.eigvalsh(mass.toarray())[0] > 0


def test_unknown_formulation_is_refused(distorted):
    nodes, hexahedra, _ = distorted
    with pytest.raises(ValueError, match="b-bar and full"):
        element_stiffness(nodes, hexahedra, 1.0, 1.0, "reduced")


def line_mass(count, size):
    """Consistent mass matrix of `count` linear line elements over `size`."""
    mass = np.zeros((count + 1, count + 1))
    for k in range(count):
        mass[k : k + 2, k : k + 2] += size / count / 6 * np.array([[2, 1], [1, 2]])
    return mass


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_pure_bending_converges_at_second_order(brick, formulation):
    """A beam under end moments does the work M^2 L / (E I), exact in three dimensions at any nu, here .45.

    Full integration is too stiff and mean dilatation less so on coarse meshes: both must converge as h^2.
    """
    length, height, half_width, elastic_modulus = 2.0, 1.0, 0.5, 7.0
    inertia = 2 * half_width * height**3 / 12
    errors = []
    for refinement in (1, 2, 4):
        counts = (6 * refinement, 2 * refinement, 4 * refinement)
        nodes, hexahedra = brick(counts, (length, half_width, height))
        z = np.linspace(0, height, counts[2] + 1) - height / 2
        # traction z / I on the end face: a unit moment, half of it on the half beam that y >= 0 is
        share = np.outer(line_mass(counts[1], half_width).sum(axis=1), line_mass(counts[2], height) @ z) / inertia
        force = np.zeros((len(nodes), 3))
        force[nodes[:, 0] == length, 0] = share.ravel()
        held = np.stack([nodes[:, 0] == 0, nodes[:, 1] == 0, (nodes == [0, 0, height / 2]).all(axis=1)], axis=1)
        free = np.flatnonzero(~held.ravel())
        local = element_stiffness(nodes, hexahedra, *moduli(elastic_modulus, 0.45), formulation)
        stiffness = assemble(hexahedra, local, len(nodes))[free][:, free]
        work = 2 * force.ravel()[free] @ factorize(stiffness).solve(force.ravel()[free])
        errors.append(abs(work * elastic_modulus * inertia / length - 1))
    assert errors[-1] < 0.02
    assert np.log2(errors[1] / errors[2]) > 1.8


def plate_matrices(nodes, hexahedra, formulation):
    """Stiffness and mass with the material of NAFEMS FV52: E 200 GPa, nu .3, 8000 kg/m3."""
    local = element_stiffness(nodes, hexahedra, *moduli(200e9, 0.3), formulation)
    scalar_mass = assemble(hexahedra, element_mass(nodes, hexahedra, 8000.0), len(nodes))
    return assemble(hexahedra, local, len(nodes)), sparse.kron(scalar_mass, np.eye(3), format="csr")


def quarter_plate(brick, formulation, refinement, size, held):
    """Matrices on the dofs that `held` leaves free, of a plate 1 m thick."""
    nodes, hexahedra = brick((8 * refinement, 8 * refinement, 4 * refinement), (*size, 1.0))
    free = np.flatnonzero(~held(nodes).ravel())
    return [matrix[free][:, free].tocsc() for matrix in plate_matrices(nodes, hexahedra, formulation)]


# modes 4, 5 and 7: half waves along x and y
@pytest.mark.parametrize(("index", "waves"), [(0, (1, 1)), (1, (2, 1)), (3, (2, 2))])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_nafems_fv52_bending(brick, published, formulation, index, waves):
    """Bending modes of the simply supported thick plate converge to NAFEMS' reference frequencies.

    The reference is thick-plate theory with edges that neither deflect nor slip along themselves, so the side faces
    are held so; the symmetric quarter of one half wave is meshed.  Holding u_z on the lower edges alone, as in
    the benchmark's own model, is a line support of a solid: its reaction is singular, and frequencies sink below
    the reference as the mesh is refined.
    """
    size = [10.0 / count / 2 for count in waves]

    def held(nodes):
        x, y = nodes[:, 0], nodes[:, 1]
        side_x, side_y, middle_x, middle_y = x == 0, y == 0, x == size[0], y == size[1]
        return np.stack([side_y | middle_x, side_x | middle_y, side_x | side_y], axis=1)

    reference = published["checks"]["nafems_fv52_hz"][index]
    found = []
    for refinement in (1, 2):
        stiffness, mass = quarter_plate(brick, formulation, refinement, size, held)
        found.append(natural_modes(stiffness, mass, count=1).frequency_hz[0])
    # finer meshes come to rest within half a per cent of the reference, which is a plate theory's
    assert found[1] == pytest.approx(reference, rel=0.02)
    assert found[1] == pytest.approx(found[0], rel=0.04)


def test_nafems_fv52_in_plane(brick, published):
    """Mode 8 shears the plate in its plane, out of reach of the support: held on the lower edges as published."""
    counts = (16, 16, 2)
    nodes, hexahedra = brick(counts, (10.0, 10.0, 1.0))
    stiffness, mass = plate_matrices(nodes, hexahedra, "full")
    edge = (nodes[:, 2] == 0) & ((nodes[:, :2] == 0) | (nodes[:, :2] == 10)).any(axis=1)
    free = np.setdiff1d(np.arange(3 * len(nodes)), 3 * np.flatnonzero(edge) + 2)
    # three rigid motions in the plane stay free, so the spectrum is shifted off zero
    shift = (2 * np.pi * 20.0) ** 2
    held = stiffness[free][:, free] + shift * mass[free][:, free]
    modes = natural_modes(held.tocsc(), mass[free][:, free].tocsc(), count=10)
    frequency = np.sqrt(np.maximum(modes.eigenvalue - shift, 0)) / (2 * np.pi)
    assert (frequency[:3] < 0.1).all()
    assert frequency[7] == pytest.approx(published["checks"]["nafems_fv52_hz"][4], rel=0.02)
