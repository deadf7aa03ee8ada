"""felupe, an independent finite-element code, asked for the same section in plane strain."""

import numpy as np
import pytest

from rom.finger_on_glass.finger import OutOfPlane
from rom.finger_on_glass.path import LoadPath, follow
from rom.finger_on_glass.tissue import Tissue

felupe = pytest.importorskip("felupe")


def test_tissue_without_fibres_agrees_with_felupe(coarse):
    """Neo-Hookean limit (k1 -> 0), Q1P0 and the same bulk modulus on both sides.

    The skin is moved as our contact with friction moves it; felupe finds where everything else goes and what it takes
    to hold the skin: our contact tractions, and none elsewhere.
    """
    finger = coarse(tissue=Tissue("radial", k1=1e-12), out_of_plane=OutOfPlane(np.inf, 10.0))
    answer = follow(finger, LoadPath((0.1, 0.2), (0.3, 0.6)))
    assert answer.complete
    seen, mesh = answer.last, finger.mesh
    region = felupe.RegionQuad(felupe.Mesh(mesh.nodes, mesh.quads, "quad"))
    field = felupe.FieldContainer([felupe.FieldPlaneStrain(region, dim=2)])
    body = felupe.SolidBodyNearlyIncompressible(felupe.NeoHooke(mu=2 * finger.tissue.c), field, finger.tissue.bulk)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([mesh.bone_nodes, mesh.skin_nodes]))
    free = np.sort(np.concatenate([2 * inner, 2 * inner + 1]))
    held = np.setdiff1d(np.arange(2 * len(mesh.nodes)), free)
    goal = np.zeros_like(mesh.nodes)
    goal[mesh.skin_nodes] = seen.state.displacement[mesh.skin_nodes]
    values = field[0].values.reshape(-1)  # a view
    for share in np.linspace(0.1, 1, 10):
        for iteration in range(20):
            force = body.assemble.vector(field).toarray().ravel()
            moved = share * goal.ravel()[held] - values[held]
            if iteration and np.abs(force[free]).max() < 1e-13:
                break
            stiffness = body.assemble.matrix(field).toarray()
            values[free] -= np.linalg.solve(stiffness[np.ix_(free, free)],
                                            force[free] + stiffness[np.ix_(free, held)] @ moved)
            values[held] += moved
        else:
            pytest.fail("felupe does not converge")
    found = field[0].values
    scale = np.abs(seen.state.displacement).max()
    assert np.abs(found - seen.state.displacement).max() < 1e-6 * scale
    reaction = force.reshape(-1, 2)[mesh.skin_nodes].sum(axis=0) * finger.out_of_plane.effective_length
    assert reaction[1] == pytest.approx(seen.normal_force, rel=1e-6)
    assert reaction[0] == pytest.approx(seen.tangential_force, rel=1e-6)
    untouched = seen.pressure == 0
    assert np.abs(force.reshape(-1, 2)[mesh.skin_nodes][untouched]).max() < 1e-9
