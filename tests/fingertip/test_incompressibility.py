"""The element near nu = 1/2: orders of convergence against a manufactured solution, and the fingertip's first mode.

The solution on the unit cube, held on its surface, is u = curl (0, 0, psi) + (mu / lambda) grad phi with
psi = S(x) S(y) S(z), S = sin^2(pi x), and phi = sin(pi x) sin(pi y) sin(pi z): free of divergence but for the second
part, whose pressure stays of order mu as nu -> 1/2. From div sigma = mu lap(curl psi) + (lambda + 2 mu) grad lap phi',
the body force is f = -mu lap(curl psi) + 3 pi^2 (mu / lambda) (lambda + 2 mu) grad phi.
"""

from dataclasses import replace

import numpy as np
import pytest
import skfem

from rom.fingertip import MeshDensity
from rom.fingertip.elements import assemble, element_stiffness
from rom.fullorder import SecondOrderModel, factorize

_TO_SKFEM = [0, 4, 3, 1, 7, 5, 2, 6]  # scikit-fem's local vertex k is this vertex of the VTK order


def wave(x):
    """S and its first three derivatives."""
    a = 2 * np.pi * x
    return (1 - np.cos(a)) / 2, np.pi * np.sin(a), 2 * np.pi**2 * np.cos(a), -4 * np.pi**3 * np.sin(a)


def manufactured(points, mu, lam):
    """Displacement, gradient and body force at points (3, ...)."""
    x, y, z = (wave(p) for p in points)
    s, c = np.sin(np.pi * points), np.pi * np.cos(np.pi * points)
    part = mu / lam
    slope = np.array([c[0] * s[1] * s[2], s[0] * c[1] * s[2], s[0] * s[1] * c[2]])
    phi = s[0] * s[1] * s[2]
    hessian = np.empty((3, 3, *phi.shape))
    for i in range(3):
        hessian[i, i] = -np.pi**2 * phi
        j, k = (i + 1) % 3, (i + 2) % 3
        hessian[j, k] = hessian[k, j] = s[i] * c[j] * c[k]
    u = np.array([x[0] * y[1] * z[0], -x[1] * y[0] * z[0], 0 * phi]) + part * slope
    gradient = part * hessian
    gradient[0] += [x[1] * y[1] * z[0], x[0] * y[2] * z[0], x[0] * y[1] * z[1]]
    gradient[1] -= [x[2] * y[0] * z[0], x[1] * y[1] * z[0], x[1] * y[0] * z[1]]
    laplacian = np.array([x[2] * y[1] * z[0] + x[0] * y[3] * z[0] + x[0] * y[1] * z[2],
                          -x[3] * y[0] * z[0] - x[1] * y[2] * z[0] - x[1] * y[0] * z[2], 0 * phi])
    return u, gradient, -mu * laplacian + 3 * np.pi**2 * part * (lam + 2 * mu) * slope


def errors(n, nu, formulation):
    """Relative errors of displacement (L2) and strain (L2, the shear energy norm) on n^3 distorted hexahedra."""
    mu, lam = 1 / (2 * (1 + nu)), nu / ((1 + nu) * (1 - 2 * nu))
    grid = np.stack(np.meshgrid(*3 * [np.linspace(0, 1, n + 1)], indexing="ij"))
    grid = grid + 0.05 * np.array([1, 0.7, -0.5])[:, None, None, None] * np.prod(np.sin(np.pi * grid), axis=0)
    nodes = np.ascontiguousarray(grid.reshape(3, -1).T)
    i = np.arange(len(nodes)).reshape(3 * [n + 1])
    a, b = slice(None, -1), slice(1, None)
    corners = ((a, a, a), (b, a, a), (b, b, a), (a, b, a), (a, a, b), (b, a, b), (b, b, b), (a, b, b))
    hexahedra = np.stack([i[corner].ravel() for corner in corners], axis=1)
    stiffness = assemble(hexahedra, element_stiffness(nodes, hexahedra, mu, lam + 2 / 3 * mu, formulation), len(nodes))
    mesh = skfem.MeshHex(np.ascontiguousarray(nodes.T), np.ascontiguousarray(hexahedra[:, _TO_SKFEM].T))
    basis = skfem.Basis(mesh, skfem.ElementHex1(), intorder=5)
    exact, slope, force = manufactured(np.asarray(basis.global_coordinates()), mu, lam)
    local = [(hexahedra[:, k], one[0]) for k, one in zip(_TO_SKFEM, basis.basis, strict=True)]
    load, u = np.zeros((len(nodes), 3)), np.zeros((len(nodes), 3))
    for at, shape in local:
        np.add.at(load, at, (force * np.asarray(shape) * basis.dx).sum(axis=-1).T)
    held = np.any((nodes < 1e-12) | (nodes > 1 - 1e-12), axis=1)
    u[held] = manufactured(nodes[held].T, mu, lam)[0].T
    free = np.flatnonzero(np.repeat(~held, 3))
    left = (load.ravel() - stiffness @ u.ravel())[free]
    u.reshape(-1)[free] = factorize(stiffness[free][:, free]).solve(left)
    found = sum(u[at].T[:, :, None] * np.asarray(shape) for at, shape in local)
    strain = sum(u[at].T[:, None, :, None] * shape.grad for at, shape in local)

    def norm(field):
        return np.sqrt(np.sum(field**2 * basis.dx))

    def symmetric(field):
        return field + field.swapaxes(0, 1)

    return norm(found - exact) / norm(exact), norm(symmetric(strain - slope)) / norm(symmetric(slope))


@pytest.mark.parametrize("nu", [0.3, 0.48, 0.4999, 0.49999])
def test_b_bar_keeps_its_orders(nu):
    # trilinear displacements: 2 in L2, 1 in energy (Hughes 1980; Brenner and Scott, chapter 11, for the locking)
    coarse, fine = errors(6, nu, "b-bar"), errors(12, nu, "b-bar")
    displacement, energy = np.log2(np.divide(coarse, fine))
    assert displacement > 1.9 and energy > 0.95
    assert fine[0] < 0.03 and fine[1] < 0.18


def test_full_integration_locks():
    """At nu = .4999 it finds a tenth of the displacement at most, and refining once hardly helps."""
    coarse, fine = errors(6, 0.4999, "full"), errors(12, 0.4999, "full")
    assert fine[0] > 0.9 and np.log2(coarse[0] / fine[0]) < 0.1
    displacement, energy = np.log2(np.divide(errors(6, 0.3, "full"), errors(12, 0.3, "full")))
    assert displacement > 1.9 and energy > 0.95


def rise(tip, formulation):
    """Relative change of f1 from nu = .48 to .4999 of dermis and hypodermis."""
    frequency = []
    for nu in (0.48, 0.4999):
        anatomy = tip.anatomy
        for tissue in ("dermis", "hypodermis"):
            anatomy = anatomy.replace_tissue(tissue, poisson_ratio=nu)
        one = replace(tip, anatomy=anatomy, formulation=formulation)
        frequency.append(SecondOrderModel(one.stiffness, one.mass).natural_modes(1).frequency_hz[0])
    return frequency[1] / frequency[0] - 1


def test_the_first_frequency_hardly_moves_towards_incompressibility(small_tip):
    """B-bar's rise falls with the square of the mesh size towards what the body itself does, about 0.6 %.

    3.1, 1.2, 0.8, 0.7 % at 534, 3,033, 6,705 and 11,817 nodes; full integration rises by 174, 118, 94 %.
    """
    finer = replace(small_tip, density=MeshDensity((8, 8), 4, 4, (1, 1, 2, 4)))
    coarse, fine = rise(small_tip, "b-bar"), rise(finer, "b-bar")
    assert 0.003 < fine < 0.013 and fine < coarse / 2
    assert 0.003 < (4 * fine - coarse) / 3 < 0.007  # Richardson
    assert rise(small_tip, "full") > 1.5
