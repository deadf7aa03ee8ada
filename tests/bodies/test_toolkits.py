"""Models of other Python toolkits, both ways."""

import math

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from brick_models import STEEL
from skfem.models.elasticity import lame_parameters, linear_elasticity

from rom.bodies import Body
from rom.bodies.toolkits import from_pymor, from_scikit_fem, to_pymor

TIP = ["36 y", "36 z"]


def test_pymor_both_ways(block):
    pytest.importorskip("pymor.models.iosys")
    body = Body(block.model.stiffness, block.model.mass, viscous=sp.csr_array(1e-4 * block.model.stiffness),
                dof_names=block.dof_names, name="block")
    theirs = to_pymor(body, TIP, TIP)
    omega = 2 * math.pi * 300
    at = [body.dof_names.tolist().index(name) for name in TIP]
    z = (body.model.stiffness * (1 + 1e-4j * omega) - omega**2 * body.model.mass).toarray()
    exact = np.linalg.inv(z)[np.ix_(at, at)]
    np.testing.assert_allclose(theirs.transfer_function.eval_tf(1j * omega), exact, rtol=1e-9)
    back, loads = from_pymor(theirs)
    for one, other in ((back.model.stiffness, body.model.stiffness), (back.model.mass, body.model.mass),
                       (back.viscous, body.viscous)):
        assert abs(one - other).max() == 0
    np.testing.assert_array_equal(loads.columns[at], np.eye(2))
    assert loads.names == ["input 1", "input 2"]
    lossy = Body(block.model.stiffness, block.model.mass, loss_stiffness=0.1 * block.model.stiffness)
    with pytest.raises(ValueError, match="pyMOR's models are real"):
        to_pymor(lossy, "3", "3")


@pytest.mark.parametrize("element", [skfem.ElementTetP1(), skfem.ElementTetP2()])
def test_scikit_fems_matrices_keep_places_and_names(element):
    mesh = skfem.MeshTet().refined(1).with_boundaries({"floor": lambda x: x[2] == 0})
    basis = skfem.Basis(mesh, skfem.ElementVector(element))
    stiffness = linear_elasticity(*lame_parameters(STEEL.young, STEEL.poisson)).assemble(basis)
    mass = skfem.BilinearForm(lambda u, v, w: STEEL.density * sum(u[i] * v[i] for i in range(3))).assemble(basis)
    held = basis.get_dofs("floor").flatten()
    body = from_scikit_fem(basis, stiffness, mass, held=held)
    free = basis.complement_dofs(held)
    assert abs(body.model.stiffness - stiffness[free][:, free]).max() == 0
    # every degree of freedom lies where scikit-fem says, and points along its component
    node, component = np.divmod(body.grid.free, 3)
    np.testing.assert_allclose(body.grid.nodes[node], basis.doflocs.T[free])
    assert body.dof_names.tolist() == [f"{n} {'xyz'[c]}" for n, c in zip(node, component, strict=True)]
    linear = np.array([1.0, -2.0, 0.5])
    field = basis.project(lambda x: np.stack([linear[i] * x[0] for i in range(3)]))
    np.testing.assert_allclose(field[free], linear[component] * body.grid.nodes[node, 0], atol=1e-9)
    assert len(body.grid.skin) == 6 * 2 * 4  # a cube whose sides are cut into 2 x 4 triangles
