"""Matrices of the whole fingertip: symmetry, rigid bodies, masses, published frequencies, locking."""

import numpy as np
import pytest
from scipy.sparse.linalg import norm

from rom.fingertip import TISSUES, Anatomy, Fingertip, MeshDensity
from rom.fingertip.elasticity import mass_by_tissue, stiffness_by_tissue
from rom.fullorder import natural_modes


def rigid_motions(nodes):
    """Three translations and three rotations about the body's middle: (3n, 6) ndarray."""
    offset = nodes - nodes.mean(axis=0)
    turns = [np.cross(axis, offset) for axis in np.eye(3)]
    return np.stack([*(np.tile(axis, (len(nodes), 1)) for axis in np.eye(3)), *turns], axis=-1).reshape(-1, 6)


@pytest.mark.parametrize("formulation", ["full", "b-bar"])
def test_rigid_motions_need_no_force(coarse, formulation):
    mesh = coarse.mesh
    stiffness = sum(stiffness_by_tissue(mesh, coarse.anatomy, formulation).values())
    assert norm(stiffness - stiffness.T) < 1e-12 * norm(stiffness)
    motions = rigid_motions(mesh.nodes)
    force = np.linalg.norm(stiffness @ motions, axis=0)
    assert (force < 1e-12 * norm(stiffness) * np.linalg.norm(motions, axis=0)).all()


@pytest.mark.parametrize("formulation", ["full", "b-bar"])
def test_exactly_six_modes_are_rigid(formulation):
    tip = Fingertip(density=MeshDensity((2, 2), 2, 1, (1, 1, 1, 1)))
    stiffness = sum(stiffness_by_tissue(tip.mesh, tip.anatomy, formulation).values())
    # scaled by the diagonal, so that the stiff nail does not hide the softest tissue
    scale = 1 / np.sqrt(stiffness.diagonal())
    values = np.linalg.eigvalsh(stiffness.toarray() * scale[:, None] * scale)
    assert (np.abs(values[:6]) < 1e-13).all()
    assert values[6] > 1e-8


def test_mass_of_each_tissue(coarse):
    mesh, anatomy = coarse.mesh, coarse.anatomy
    masses = mass_by_tissue(mesh, anatomy)
    rigid = rigid_motions(mesh.nodes)[:, 0]
    for index, name in enumerate(TISSUES):
        volume = mesh.element_volumes[mesh.tissue == index].sum()
        assert volume > 0
        # 1 g/cm3 is 1000 kg/m3
        assert rigid @ masses[name] @ rigid == pytest.approx(volume * anatomy.tissue(name).density * 1e3, rel=1e-12)
    total = sum(masses.values())
    assert norm(total - total.T) < 1e-12 * norm(total)


def test_fingertip_weighs_a_few_grams(study):
    # by hand: 4.08 cm3 at .92 to 1.30 g/cm3
    mass = sum(mass_by_tissue(study.mesh, study.anatomy).values())
    rigid = rigid_motions(study.mesh.nodes)[:, 0]
    assert 4.08e-3 * 0.92 < rigid @ mass @ rigid < 4.09e-3 * 1.30


def test_matrices_are_mirror_symmetric(coarse):
    mesh = coarse.mesh
    dofs = (3 * mesh.mirror[:, None] + np.arange(3)).ravel()
    sign = np.tile([1.0, -1.0, 1.0], mesh.n_nodes)
    for matrices in (stiffness_by_tissue(mesh, coarse.anatomy), mass_by_tissue(mesh, coarse.anatomy)):
        matrix = sum(matrices.values())
        mirrored = matrix[dofs][:, dofs].multiply(sign[:, None]).multiply(sign[None, :])
        assert norm(matrix - mirrored) < 1e-12 * norm(matrix)


def test_published_frequencies(study, published):
    """Full integration, as published; the surface shape is calibrated on these figures among others."""
    figures = published["digitip"]["natural_frequency_hz"]
    frequency = natural_modes(study.stiffness, study.mass, count=7).frequency_hz
    assert frequency[0] == pytest.approx(figures["mode_1"], rel=0.025)
    assert frequency[1] == pytest.approx(figures["mode_2"], rel=0.025)
    assert frequency[6] == pytest.approx(figures["mode_7"], rel=0.025)


def test_presets_agree(metamodel):
    # the coarser preset against `study` with the same elements: 120.5 and 162.4 Hz, computed with this code
    frequency = natural_modes(metamodel.stiffness, metamodel.mass, count=2).frequency_hz
    np.testing.assert_allclose(frequency, [120.5, 162.4], rtol=0.005)


def lowest_frequency(nu, formulation):
    anatomy = Anatomy().replace_tissue("dermis", poisson_ratio=nu).replace_tissue("hypodermis", poisson_ratio=nu)
    tip = Fingertip(anatomy, MeshDensity().scaled(0.75), formulation)
    return natural_modes(tip.stiffness, tip.mass, count=1).frequency_hz[0]


def test_mean_dilatation_does_not_lock():
    b_bar = [lowest_frequency(nu, "b-bar") for nu in (0.48, 0.4999)]
    full = [lowest_frequency(nu, "full") for nu in (0.48, 0.4999)]
    assert b_bar[1] == pytest.approx(b_bar[0], rel=0.01)
    assert full[1] > 1.3 * full[0]  # and the test can see locking where it is


def test_softer_tissue_means_lower_frequency(coarse):
    # stiffness is linear in a tissue's modulus at fixed nu
    softer = Fingertip(coarse.anatomy.replace_tissue("hypodermis", elastic_modulus=0.017), coarse.density)
    half = softer.stiffness_by_tissue["hypodermis"]
    whole = coarse.stiffness_by_tissue["hypodermis"]
    assert norm(2 * half - whole) < 1e-12 * norm(whole)
