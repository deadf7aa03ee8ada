import numpy as np
import pytest

from rom.finger_on_glass.section import Section, mesh_section
from rom.finger_on_glass.tissue import PUBLISHED_K1, Tissue, fibre_directions


def test_published_properties(published_contact):
    assert Tissue().c == pytest.approx(1e-3 * published_contact["c_kpa"])
    assert Tissue().k2 == published_contact["k2"]
    for variant, k1 in published_contact["k1_kpa"].items():
        assert Tissue(variant).k1 == PUBLISHED_K1[variant] == pytest.approx(1e-3 * k1)


@pytest.fixture(scope="module")
def published_contact():
    import tomllib
    from pathlib import Path

    tables = tomllib.loads((Path(__file__).parents[2] / "data" / "published.toml").read_text())
    return next(table for table in tables.values() if isinstance(table, dict) and "k1_kpa" in table)


def test_fibres_are_unit_vectors_across_or_along_the_radial_ones():
    section, mesh = Section(), mesh_section(Section(), 40, 4)
    radial, around, random = (fibre_directions(Tissue(v), section, mesh) for v in (
        "radial", "circumferential", "random"))
    assert radial.shape == around.shape == (160, 4, 1, 2)
    assert random.shape == (160, 4, 3, 2)
    assert np.abs((radial * around).sum(axis=-1)).max() < 1e-12
    for fibres in (radial, around, random):
        assert np.abs(np.linalg.norm(fibres, axis=-1) - 1).max() < 1e-12


def test_three_families_are_isotropic_at_every_point():
    """sum a a^T = 3/2 1 for three directions 120 degrees apart."""
    fibres = fibre_directions(Tissue("random", seed=4), Section(), mesh_section(Section(), 40, 4))
    assert np.abs(np.einsum("eqni,eqnj->eqij", fibres, fibres) - 1.5 * np.eye(2)).max() < 1e-12


def test_seed_decides_the_random_fibres():
    section, mesh = Section(), mesh_section(Section(), 40, 4)
    one, same, other = (fibre_directions(Tissue("random", seed=s), section, mesh) for s in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.allclose(one, other)


@pytest.mark.parametrize(("changes", "words"), [
    ({"variant": "spiral"}, "choose one of radial"), ({"c": 0.0}, "above 0"),
    ({"k1": -1.0}, "above 0 and at most 1000"),
    ({"k2": float("nan")}, "finite number"), ({"bulk_ratio": 0.5}, "above 1"), ({"seed": 1.5}, "whole number"),
    ({"seed": -1}, "whole number from 0 up")])
def test_impossible_tissue_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        Tissue(**changes)
