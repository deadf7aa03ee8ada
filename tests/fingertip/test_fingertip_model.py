import numpy as np
import pytest
from scipy.sparse.linalg import norm

from rom.fingertip import DIRECTIONS, Anatomy, Fingertip, MeshDensity, elasticity
from rom.fullorder import factorize


def test_statics_never_assembles_the_mass(monkeypatch, coarse):
    def forbidden(*_):
        raise AssertionError("statics asked for the mass")

    monkeypatch.setattr(elasticity, "mass_by_tissue", forbidden)
    monkeypatch.setattr("rom.fingertip.elements.element_mass", forbidden)
    tip = Fingertip(density=coarse.density)
    displacement = factorize(tip.stiffness).solve(tip.normal_force(0))
    assert np.isfinite(displacement).all()
    assert tip.pad_loads.shape == (len(tip.free_dofs), len(tip.mesh.pad_nodes))
    with pytest.raises(AssertionError, match="asked for the mass"):
        _ = tip.mass


def test_matrices_are_on_the_free_dofs(coarse):
    n = len(coarse.free_dofs)
    assert coarse.stiffness.shape == coarse.mass.shape == (n, n)
    assert norm(coarse.stiffness - coarse.stiffness.T) < 1e-12 * norm(coarse.stiffness)
    full = sum(elasticity.stiffness_by_tissue(coarse.mesh, coarse.anatomy).values())
    assert abs(full[coarse.free_dofs][:, coarse.free_dofs] - coarse.stiffness).max() == 0
    # the bone is rigid, and only it is held when the rear is free
    held = np.setdiff1d(np.arange(3 * coarse.mesh.n_nodes), coarse.free_dofs) // 3
    np.testing.assert_array_equal(np.unique(held), coarse.mesh.bone_nodes)


def test_rear_may_be_fixed(coarse):
    fixed = Fingertip(density=coarse.density, rear="fixed")
    assert len(coarse.free_dofs) - len(fixed.free_dofs) == 3 * len(fixed.mesh.rear_nodes)
    assert np.all(fixed.mesh.nodes[fixed.mesh.rear_nodes, 0] == 0)
    assert not np.isin(fixed.mesh.rear_nodes, fixed.mesh.bone_nodes).any()


def test_pad_loads_push_into_the_skin(coarse):
    mesh, loads = coarse.mesh, coarse.pad_loads.toarray()
    np.testing.assert_allclose(np.linalg.norm(loads, axis=0), 1, rtol=1e-14)  # one newton each
    for index in (0, len(mesh.pad_nodes) - 1):
        np.testing.assert_array_equal(loads[:, index], coarse.normal_force(index))
    factor = factorize(coarse.stiffness)
    displacement = factor.solve(loads)
    # positive definite, so each load does work on its own displacement
    assert (np.einsum("ij,ij->j", loads, displacement) > 0).all()
    centre = int(np.flatnonzero(mesh.pad_nodes == mesh.fingerprint_centroid)[0])
    full = np.zeros(3 * mesh.n_nodes)
    full[coarse.free_dofs] = displacement[:, centre]
    assert full[3 * mesh.fingerprint_centroid + 2] > 0  # pressed at the palm, the skin moves dorsally


def test_point_force_sits_on_its_node(coarse):
    node = coarse.mesh.fingerprint_centroid
    force = coarse.point_force(node, [1.0, 2.0, 3.0])
    full = np.zeros(3 * coarse.mesh.n_nodes)
    full[coarse.free_dofs] = force
    np.testing.assert_array_equal(full.reshape(-1, 3)[node], [1, 2, 3])
    assert np.count_nonzero(force) == 3


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda tip: tip.point_force(tip.mesh.bone_nodes[0], [0, 0, 1]), "held"),
        (lambda tip: tip.point_force(tip.mesh.rear_nodes[0], [0, 0, 1]), "held"),
        (lambda tip: tip.point_force(-1, [0, 0, 1]), "does not exist"),
        (lambda tip: tip.point_force(tip.mesh.n_nodes, [0, 0, 1]), "does not exist"),
        (lambda tip: tip.point_force(0, [0, 1]), "three finite"),
        (lambda tip: tip.point_force(0, [0, 0, np.nan]), "three finite"),
        (lambda tip: tip.normal_force(-1), "outside the pad"),
        (lambda tip: tip.normal_force(len(tip.mesh.pad_nodes)), "outside the pad"),
    ],
    ids=["bone", "fixed rear", "below", "above", "two components", "nan", "pad below", "pad above"],
)
def test_impossible_loads_are_refused(coarse, ask, words):
    tip = Fingertip(density=coarse.density, rear="fixed")
    with pytest.raises(ValueError, match=words) as refusal:
        ask(tip)
    assert "\n" not in str(refusal.value)
    assert ":" in str(refusal.value)


def test_pad_on_a_fixed_rear_is_refused(coarse):
    tip = Fingertip(Anatomy().replace_shape(pad_start=0.0), coarse.density, rear="fixed")
    with pytest.raises(ValueError, match="fixed rear"):
        _ = tip.pad_loads


def test_presets_take_overrides():
    tip = Fingertip.preset("metamodel", rear="fixed", anatomy=Anatomy(bone_length=22.0))
    assert tip.density == MeshDensity((14, 16), 6, 4)
    assert (tip.rear, tip.anatomy.bone_length) == ("fixed", 22.0)
    with pytest.raises(ValueError, match="no preset"):
        Fingertip.preset("thumb")
    with pytest.raises(ValueError, match="free or fixed"):
        Fingertip(rear="loose")
    with pytest.raises(ValueError, match="b-bar and full"):
        Fingertip(formulation="reduced")


def test_content_hash_follows_every_part(coarse):
    density = coarse.density
    others = [
        Fingertip(Anatomy().replace_tissue("dermis", elastic_modulus=0.081), density),
        Fingertip(Anatomy(bone_length=22.4), density),
        Fingertip(Anatomy().replace_shape(bone_axis_rise=0.1), density),
        Fingertip(density=density, formulation="full"),
        Fingertip(density=density, rear="fixed"),
        Fingertip(density=density.scaled(0.5)),
    ]
    hashes = {tip.content_hash for tip in [coarse, *others]}
    assert len(hashes) == len(others) + 1
    assert Fingertip(density=density).content_hash == coarse.content_hash


def test_patch_force_is_one_newton_shared_by_nine_nodes():
    tip = Fingertip(density=MeshDensity((8, 8), 4, 4, (1, 1, 1, 1)))
    node = tip.mesh.fingerprint_centroid
    frame = tip.skin_frame(node)
    axes = np.stack([frame[name] for name in DIRECTIONS])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-14)
    assert frame["normal"][2] > 0.8  # into a skin that looks down
    assert frame["distal-proximal"][0] > 0.8
    assert frame["radial-ulnar"][1] == pytest.approx(1.0)  # the centroid lies on the mid-plane
    for name in DIRECTIONS:
        full = np.zeros(3 * tip.mesh.n_nodes)
        full[tip.free_dofs] = tip.patch_force(node, name)
        nodal = full.reshape(-1, 3)
        loaded = np.flatnonzero(np.abs(nodal).max(axis=1))
        np.testing.assert_array_equal(loaded, tip.mesh.skin_patch(node))
        assert len(loaded) == 9
        np.testing.assert_allclose(nodal.sum(axis=0), frame[name], atol=1e-14)


def test_unknown_direction_of_a_patch_is_refused(coarse):
    with pytest.raises(ValueError, match="no direction 'up': choose one of normal"):
        coarse.patch_force(coarse.mesh.fingerprint_centroid, "up")
