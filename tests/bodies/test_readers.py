"""Every format read back gives the matrices and the names that were written, or says in a sentence why not."""

import model_files
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from rom.bodies import read_body
from rom.bodies.readers import found


def check(body, block, relative=1e-15, names=True):
    """The same matrices, row by row of the same name."""
    order = np.arange(block.model.n)
    if names:
        place = {name: i for i, name in enumerate(body.dof_names.tolist())}
        order = np.array([place[name] for name in block.dof_names.tolist()])
        assert len(place) == block.model.n
    for read, given in ((body.model.stiffness, block.model.stiffness), (body.model.mass, block.model.mass)):
        assert abs(read[order][:, order] - given).max() <= relative * abs(given).max()


@pytest.fixture
def matrices(block):
    return block.model.stiffness, block.model.mass


def test_matrix_market_with_the_mass_beside_it(tmp_path, block, matrices):
    for name, matrix in zip("KM", matrices, strict=True):
        scipy.io.mmwrite(tmp_path / f"{name}.mtx", matrix, symmetry="symmetric", precision=17)
    check(read_body(tmp_path / "K.mtx", mass="M.mtx"), block, names=False)
    alone = read_body(tmp_path / "K.mtx")
    assert any("no mass" in note for note in alone.notes)
    with pytest.raises(ValueError, match="has no mass matrix"):
        _ = alone.model.mass


def test_archives_of_numpy_scipy_and_matlab(tmp_path, block, matrices):
    stiffness, mass = matrices
    sp.save_npz(tmp_path / "stiff.npz", stiffness)
    sp.save_npz(tmp_path / "mass.npz", mass)
    check(read_body(tmp_path / "stiff.npz", mass="mass.npz"), block, names=False)
    np.savez(tmp_path / "both.npz", K=stiffness.toarray(), M=mass.toarray(), info=np.arange(3))
    check(read_body(tmp_path / "both.npz"), block, names=False)
    scipy.io.savemat(tmp_path / "odd.mat", {"A": mass, "S1": stiffness * 0.25, "S2": -3 * stiffness, "unused": mass})
    with pytest.raises(ValueError, match=r"does not say which matrix is the stiffness.*A \(81 x 81\)"):
        read_body(tmp_path / "odd.mat")
    body = read_body(tmp_path / "odd.mat", stiffness={"skin": "S1", "bone": "-0.25*S2"}, mass="A")
    check(body, block, names=False)
    assert list(body.stiffness_by_region) == ["skin", "bone"]
    np.testing.assert_array_equal(body.stiffness_by_region["bone"].toarray(), (0.75 * stiffness).toarray())
    assert [note for note in body.notes if "unused (81 x 81)" in note]


def test_complex_stiffness_and_viscous_damping(tmp_path, block, matrices):
    stiffness, mass = matrices
    scipy.io.savemat(tmp_path / "lossy.mat", {"K": stiffness * (1 + 0.04j), "M": mass, "D": -2j * mass,
                                              "noisy": stiffness * (1 + 1e-10j)})
    body = read_body(tmp_path / "lossy.mat", viscous="-imag(D)")
    check(body, block, names=False)
    np.testing.assert_allclose(body.model.loss_stiffness.toarray(), 0.04 * stiffness.toarray(), rtol=1e-12)
    np.testing.assert_allclose(body.viscous.toarray(), 2 * mass.toarray())
    assert any("loss factors of 0.04 to 0.04" in note for note in body.notes)
    noisy = read_body(tmp_path / "lossy.mat", stiffness="noisy")
    assert noisy.model.loss_stiffness is None and any("is rounding, 1e-10" in note for note in noisy.notes)
    with pytest.raises(ValueError, match=r"viscous matrix is complex.*viscous='imag\(D\)'"):
        read_body(tmp_path / "lossy.mat", viscous="D")


def test_harwell_boeing(tmp_path, block, matrices):
    for name, matrix in zip("KM", matrices, strict=True):
        model_files.write_harwell_boeing(tmp_path / f"{name}.rsa", matrix)
    body = read_body(tmp_path / "K.rsa", mass="M.rsa")
    check(body, block, names=False)
    assert "stiffness: one triangle is stored, the other was added" in body.notes
    (tmp_path / "cut.rsa").write_text("\n".join((tmp_path / "K.rsa").read_text().splitlines()[:-5]))
    with pytest.raises(ValueError, match="cut off"):
        read_body(tmp_path / "cut.rsa")


def test_abaqus_coordinates_find_their_neighbours(tmp_path, block, matrices):
    stiffness, mass = matrices
    model_files.write_coordinates(tmp_path / "job_STIF2.mtx", stiffness)
    model_files.write_coordinates(tmp_path / "job_MASS2.mtx", mass)
    model_files.write_coordinates(tmp_path / "job_DMPV2.mtx", 3 * mass)
    body = read_body(tmp_path / "job_STIF2.mtx")
    check(body, block, names=False)
    np.testing.assert_allclose(body.viscous.toarray(), 3 * mass.toarray())
    assert set(body.origin["files"]) == {"job_STIF2.mtx", "job_MASS2.mtx", "job_DMPV2.mtx"}  # whose sha256 are kept


def test_abaqus_matrix_input_keeps_labels_and_leaves_out_held_rows(tmp_path, block, matrices):
    names, held = model_files.labels(block), [(900, 1), (900, 2), (3, 3)]
    for kind, matrix in zip(("STIF", "MASS"), matrices, strict=True):
        model_files.write_matrix_input(tmp_path / f"job_{kind}1.mtx", matrix, names, held if kind == "STIF" else ())
    body = read_body(tmp_path / "job_STIF1.mtx")
    check(body, block)
    assert "3 rows of held degrees of freedom are left out: 3 z, 900 x, 900 y" in body.notes


@pytest.mark.parametrize("long_fields", [True, False])
def test_nastran_punch(tmp_path, block, matrices, long_fields):
    stiffness, mass = matrices
    light = sp.csr_array(mass.multiply(np.arange(81)[:, None] >= 2).multiply(np.arange(81)[None, :] >= 2))
    model_files.write_punch(tmp_path / "job.pch1", {"KAAX": stiffness, "MAAX": light, "K4AAX": 0.1 * stiffness},
                        model_files.labels(block), long_fields)
    body = read_body(tmp_path / "job.pch1")
    # long fields hold ten digits
    tolerance = 1e-9 if long_fields else 1e-15
    assert abs(body.model.stiffness - stiffness).max() <= tolerance * abs(stiffness).max()
    assert abs(body.model.mass - light).max() <= tolerance * abs(light).max()
    assert abs(body.model.loss_stiffness - 0.1 * stiffness).max() <= tolerance * abs(stiffness).max()
    assert body.dof_names.tolist() == block.dof_names.tolist()
    assert "2 degrees of freedom have no mass" in body.notes


def test_an_independent_reader_of_punch_files_agrees(tmp_path, block, matrices):
    bulk = pytest.importorskip("pyyeti.nastran.bulk")
    model_files.write_punch(tmp_path / "job.pch", {"KAAX": matrices[0]}, model_files.labels(block))
    theirs = bulk.rddmig(str(tmp_path / "job.pch"))["kaax"]
    ours = read_body(tmp_path / "job.pch").model.stiffness.toarray()
    np.testing.assert_array_equal(ours, theirs.to_numpy())


@pytest.mark.parametrize("binary", [True, False])
def test_nastran_op4(tmp_path, block, matrices, binary):
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    dense, sparse = matrices[0].toarray(), sp.csc_matrix(matrices[1])
    op4.write(str(tmp_path / "job.op4"), {"KAA": dense, "MAA": sparse}, binary=binary)
    check(read_body(tmp_path / "job.op4"), block, 1e-15, names=False)


def test_calculix(tmp_path, block, matrices):
    model_files.write_calculix(tmp_path / "job", *matrices, model_files.labels(block))
    check(read_body(tmp_path / "job.sti"), block)
    (tmp_path / "job.dof").write_text("1.1\n1.2\n")
    with pytest.raises(ValueError, match="names 2 degrees of freedom and the matrices have more"):
        read_body(tmp_path / "job.sti")


def test_ansys(tmp_path, block, matrices):
    pytest.importorskip("ansys.mapdl.reader.full")
    held = [(node, dof) for node in range(1, 10) for dof in (1, 2, 3)]
    model_files.write_full(tmp_path / "file.full", *matrices, model_files.labels(block), held)
    body = read_body(tmp_path / "file.full")
    check(body, block)
    assert any(note.startswith("27 rows of held") for note in body.notes)


@pytest.mark.parametrize(("name", "content", "words"), [
    ("x.foo", b"", "is no mesh that meshio reads"), ("x.mtx", b"hello world\n", "neither Matrix Market nor of Abaqus"),
    ("x.mtx", b"1 2 3 4\n", "lines of 4 numbers"), ("x.mtx", b"%%MatrixMarket matrix nonsense\n", "is damaged"),
    ("x.mtx", b"** nothing\n", "holds no entries"), ("x.npz", b"junk", "no readable archive"),
    ("x.mat", b"junk" * 50, "no readable MATLAB file"), ("x.rsa", b"junk\n1 2 3\n", "no readable Harwell-Boeing"),
    ("x.pch", b"GRID,1\n", "holds no square DMIG matrix"), ("x.pch", b"DMIG,K,1,1,,1,1,abc\n", "'abc' in a DMIG card"),
    ("x.sti", b"1 1\n", "2 numbers a line"), ("x.full", b"junk" * 200, "no readable .full file"),
    ("x.tet", b"v 1 2 3\nt 0 1 2 3\n", "a tetrahedron without its nodes")])
def test_what_cannot_be_read_is_refused_in_a_sentence(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=words):
        read_body(tmp_path / name)


def test_missing_files_names_and_extras(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match="does not exist"):
        read_body(tmp_path / "absent.mtx")
    np.savez(tmp_path / "one.npz", K=np.eye(3), M=np.eye(4))
    with pytest.raises(ValueError, match=r"neither a matrix of one\.npz"):
        read_body(tmp_path / "one.npz", mass="Q")
    with pytest.raises(ValueError, match="K has 3 rows and M 4"):
        read_body(tmp_path / "one.npz")
    monkeypatch.setattr(found.importlib, "import_module", _no_extras(found.importlib.import_module))
    (tmp_path / "x.op4").write_bytes(b"")
    with pytest.raises(ValueError, match=r"needs pyyeti: install it with `pip install 'fingertip-rom\[nastran\]'`"):
        read_body(tmp_path / "x.op4")


def _no_extras(real):
    def load(name):
        if not name.startswith("rom."):
            raise ImportError(name)
        return real(name)
    return load


def test_signs_held_rows_and_held_names(tmp_path, matrices):
    stiffness, mass = matrices
    eye = sp.eye_array(2)
    np.savez(tmp_path / "a.npz", K=sp.block_diag([stiffness, eye]).toarray(), M=sp.block_diag([mass, eye]).toarray())
    body = read_body(tmp_path / "a.npz", held=["5"])
    assert body.model.n == 80 and 5 not in body.dof_names
    assert "2 rows of held degrees of freedom are left out: 81, 82" in body.notes
    with pytest.raises(ValueError, match="names no degree of freedom"):
        read_body(tmp_path / "a.npz", held=["z=min"])
    np.savez(tmp_path / "b.npz", K=-stiffness.toarray(), M=mass.toarray())
    with pytest.raises(ValueError, match="give stiffness='-K'"):
        read_body(tmp_path / "b.npz")
    assert abs(read_body(tmp_path / "b.npz", stiffness="-K").model.stiffness - stiffness).max() == 0


def test_a_model_of_oscillators_alone_is_kept(tmp_path):
    np.savez(tmp_path / "modal.npz", K=np.diag([1.0, 4.0, 9.0]), M=np.eye(3))  # the first has as much mass as stiffness
    assert read_body(tmp_path / "modal.npz").model.n == 3
