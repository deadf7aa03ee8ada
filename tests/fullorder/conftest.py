"""Small bodies with known answers: rods (analytic) and elastic blocks (dense reference)."""

import functools

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from rom.fullorder import available_backends


class Rod:
    """Rod of linear elements with consistent mass, both ends held: all modes are known in closed form.

    lambda_j = 6 E / (rho h^2) (1 - cos a) / (2 + cos a), a = j pi / (n + 1), phi_j(i) ~ sin(i a): by insertion in
    the three-term recurrence of K = E / h tri(-1, 2, -1), M = rho h / 6 tri(1, 4, 1), at unit area.
    """

    def __init__(self, n, modulus=3e4, density=1.1e3, length=0.05):
        self.n, h = n, length / (n + 1)
        ones = np.ones(n - 1)
        self.spring = modulus / h
        self.stiffness = sp.diags_array([-ones, 2 * np.ones(n), -ones], offsets=[-1, 0, 1], format="csr") * self.spring
        self.mass = sp.diags_array([ones, 4 * np.ones(n), ones], offsets=[-1, 0, 1], format="csr") * (density * h / 6)
        angle = np.arange(1, n + 1) * np.pi / (n + 1)
        self.eigenvalue = 6 * modulus / (density * h**2) * (1 - np.cos(angle)) / (2 + np.cos(angle))
        shape = np.sin(np.outer(np.arange(1, n + 1), angle))
        self.shape = shape / np.sqrt(np.sum(shape * (self.mass @ shape), axis=0))

    @property
    def frequency_hz(self):
        return np.sqrt(self.eigenvalue) / (2 * np.pi)

    def green(self, j):
        """Displacement under a unit force at dof j: two straight lines."""
        i = np.arange(1, self.n + 1)
        return np.minimum(i, j + 1) * (self.n + 1 - np.maximum(i, j + 1)) / ((self.n + 1) * self.spring)


@functools.cache
def elastic_block(divisions=(6, 4, 3), size=(0.03, 0.018, 0.015), held=True):
    """Stiffness and mass of a soft block (E 50 kPa, nu .45, rho 1000 kg/m3), clamped at x = 0 if held."""
    mesh = skfem.MeshHex.init_tensor(
        *(np.linspace(0, length, k + 1) for length, k in zip(size, divisions, strict=True))
    )
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=2)
    stiffness = skfem.asm(linear_elasticity(*lame_parameters(5e4, 0.45)), basis)
    mass = skfem.asm(skfem.BilinearForm(lambda u, v, w: 1e3 * dot(u, v)), basis)
    if held:
        free = basis.complement_dofs(basis.get_dofs(lambda x: x[0] == 0).all())
        stiffness, mass = stiffness[free][:, free], mass[free][:, free]
    return stiffness.tocsr(), mass.tocsr()


@pytest.fixture
def rod():
    return Rod


@pytest.fixture
def block():
    return elastic_block


@pytest.fixture(params=["pardiso", "superlu"])
def backend(request):
    if request.param not in available_backends():
        pytest.skip("no oneMKL runtime here")
    return request.param


@pytest.fixture
def rng():
    return np.random.default_rng(20)
