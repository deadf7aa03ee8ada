"""`rom body`: summaries, one file, exports, and refusals in one sentence."""

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from rom.bodies import read_body
from rom.cli import main


@pytest.fixture
def chain(tmp_path):
    """Five masses on springs, one triangle stored."""
    stiffness = sp.diags_array([np.full(5, 2e4), np.full(4, -1e4)], offsets=[0, -1]).tocsc()
    scipy.io.savemat(tmp_path / "chain.mat", {"K": stiffness, "M": sp.eye_array(5).tocsc() * 0.1, "soft": stiffness / 4,
                                              "hard": stiffness * 0.75})
    return tmp_path / "chain.mat"


def test_summary_and_one_file(chain, tmp_path, capsys):
    assert main(["body", str(chain), "--output", str(tmp_path / "chain.nc")]) == 0
    said = capsys.readouterr().out
    assert "chain: 5 degrees of freedom (0, 1, 2 ...)" in said and "0.5 kg on the diagonal" in said
    assert "note: stiffness: one triangle is stored, the other was added" in said and "left unused: soft" in said
    body = read_body(tmp_path / "chain.nc")
    assert body.name == "chain" and body.content_hash[:24] in said
    assert main(["body", str(tmp_path / "chain.nc")]) == 0


def test_regions_and_held(chain, tmp_path, capsys):
    given = ["--stiffness", "a=soft", "--stiffness", "b=hard", "--hold", "4", "--output", str(tmp_path / "chain.nc")]
    assert main(["body", str(chain), *given]) == 0
    assert "in the regions a, b" in capsys.readouterr().out
    assert read_body(tmp_path / "chain.nc").model.n == 4


def test_a_mesh_with_materials(tmp_path, capsys):
    (tmp_path / "cell.tet").write_text("v 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 0 20\nt 0 1 2 3\n")
    given = ["--material", "1e6,0.3,1000", "--scale", "1e-3", "--hold", "z=min"]
    assert main(["body", str(tmp_path / "cell.tet"), *given]) == 0
    said = capsys.readouterr().out
    assert "3 degrees of freedom (3 x, 3 y, 3 z ...)" in said and "4 nodes from 0 0 0 to 0.02 0.02 0.02 m" in said


def test_exports(chain, tmp_path, capsys):
    given = [str(chain), "--superelement", str(tmp_path / "s.pch"), "--interface", "0", "--interface", "4",
             "--inputs", "0", "--outputs", "4", "--state-space", str(tmp_path / "s.npz"), "--band", "60"]
    assert main(["body", *given]) == 0
    said = capsys.readouterr().out
    # all of the chain's natural frequencies (26 to 97 Hz) lie below twice the band
    assert "superelement: 2 interface degrees of freedom" in said and "1 displacements, 10 states" in said
    assert read_body(tmp_path / "s.pch").dof_names[0] == "0"
    assert np.load(tmp_path / "s.npz")["A"].shape == (10, 10)


@pytest.mark.parametrize(("words", "reason"), [
    (["--superelement", "a.pch"], "no --interface"), (["--fmu", "a.fmu", "--inputs", "0"], "--inputs and --outputs"),
    (["--fmu", "a.txt"], "must end in .fmu"),
    (["--state-space", "a.txt", "--inputs", "0", "--outputs", "1", "--modes", "2"], "must end in .npz, .mat"),
    (["--superelement", "a.pch", "--interface", "0"], "--band HZ or --modes N"),
    (["--stiffness", "a=K", "--stiffness", "hard"], "REGION=NAME"), (["--material", "1,2"], "E,NU,RHO"),
    (["--mass", "nosuch"], "neither a matrix of chain.mat"), (["--hold", "z=min"], "names no degree of freedom"),
    (["--stiffness", "K", "--scale", "2"], "belongs to a mesh")])
def test_refusals(chain, capsys, words, reason):
    assert main(["body", str(chain), *words]) == 2
    said = capsys.readouterr().err
    assert reason in said and said.count("\n") == 1
