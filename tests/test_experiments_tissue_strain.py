"""The tissue strain experiment, coarse and quick, against symmetry, an independent computation, and theory."""

import sys
from pathlib import Path

import meshio
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))

import tissue_strain

from rom.fingertip import strain
from rom.fingertip.strain_measures import tensor
from rom.fullorder import SecondOrderModel
from rom.reporting.experiment import write_experiment


@pytest.fixture(scope="module")
def coarse(small_tip):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tissue_strain.script, "fingertip", lambda *_: small_tip)
        patch.setattr(tissue_strain, "FREQUENCY", (0.0, 250.0))
        yield small_tip


@pytest.fixture(scope="module")
def results(coarse):
    return tissue_strain.main(quick=True)


def test_static_strain_is_that_of_a_static_solve(results, coarse):
    # another route: static solve, eigenvalues by LAPACK; of both signs of the load the one with the larger tension
    full = np.zeros(3 * coarse.mesh.n_nodes)
    load = coarse.patch_force(coarse.mesh.fingerprint_centroid, "distal-proximal")
    full[coarse.free_dofs] = SecondOrderModel(coarse.stiffness).solve_static(tissue_strain.FORCE * load)
    for k, (_, depth, side) in enumerate(tissue_strain.receptor_depths(coarse)):
        values = strain.apply(strain.strain_operator(coarse, depth * 1e-3, side), full)
        expected = np.abs(np.linalg.eigvalsh(tensor(values))).max(axis=1)
        found = results["principal_strain"].sel(frequency=0.0, direction="distal-proximal").isel(depth=k)
        np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_maps_have_the_symmetry_of_the_finger(results, coarse):
    # mesh and loads mirror about y = 0, up to a sign that the cycle does not know
    centre = coarse.mesh.nodes[coarse.mesh.skin_quads[results["pad_skin_quad"].values]].mean(axis=1)
    mirrored = np.argmin(np.linalg.norm(centre[:, None] - centre * [1, -1, 1], axis=2), axis=1)
    assert (mirrored != np.arange(len(centre))).all()
    for name in ("principal_strain", "energy_density"):
        values = results[name].values
        np.testing.assert_allclose(values[..., mirrored], values, rtol=1e-5)


def test_no_instant_exceeds_the_cycle(results):
    # up to the sampling of the cycle, 1 - cos(1 degree)
    assert (results["principal_strain"] <= results["cycle_principal_strain"] * (1 + 2e-4)).all()


def test_the_profile_goes_from_skin_to_bone_through_the_tissues(results):
    depth, tissue = results["profile_depth"].values, list(results["profile_tissue"].values)
    assert depth[0] == 0 and (np.diff(depth) > -1e-9).all()
    assert list(dict.fromkeys(tissue)) == ["stratum corneum", "epidermis", "dermis", "hypodermis"]


def test_load_dependent_vectors_make_statics_exact_and_vibration_better_and_better(results):
    # the first Krylov vector is the static response; each further one matches two more moments
    own = [label for label in results["method"].values if label.startswith(("modal-static", "modal-krylov"))]
    for name in ("strain_error", "displacement_error"):
        assert (results[name].sel({"frequency": 0.0, "method": own}) < 1e-7).all()
    krylov = results["strain_error"].sel(
        {"method": [label for label in own if "krylov" in label], "frequency": 250.0})
    assert (np.diff(krylov.max(("direction", "depth")).values) < 0).all()


def test_the_folder_is_whole(results, coarse, tmp_path):
    given = results.assign_attrs(quick="1")
    files = tissue_strain.extra(given, tmp_path)
    figures, tables = tissue_strain.draw(given), tissue_strain.tables(given)
    sentences = tissue_strain.findings(given)
    page = write_experiment(tmp_path, "tissue-strain", "How?", sentences, figures, tables, files, given.attrs)
    text = page.read_text(encoding="utf-8")
    for figure in figures:
        assert f'src="{figure.file}"' in text and (tmp_path / figure.file).stat().st_size > 10_000
    assert not any(word in "".join((*sentences, *tables)) for word in ("nan", "inf", "unbounded"))
    field = meshio.read(files[0])
    assert {"principal_strain_normal", "energy_density_normal_J_per_m3", "tissue"} <= set(field.cell_data)
    assert tissue_strain.extra(given.assign_attrs(content_hash="another"), tmp_path) == []
