"""A third party's method and scene come in by entry points, without touching the package."""

import subprocess
import sys
import textwrap

METHOD_AND_SCENE = """
    import numpy as np
    import scipy.sparse as sp
    import rom


    class Rigid(rom.Metamodel):
        name = "rigid"
        summary = "answers that nothing moves"

        def _fit(self, train):
            pass

        def _evaluate(self, cases, outputs, out):
            return np.zeros((len(cases), self.scene.n_outputs(outputs)), dtype=self.scene.dtype)


    def spring(outputs="field"):
        body = rom.Body(sp.csr_array([[2.0, -1.0], [-1.0, 1.0]]), name="spring")
        return rom.LinearScene(body, rom.Loads.named([[0.0], [1.0]], ["tip"]), name="two-springs", outputs=outputs)
"""


def test_entry_points_are_found(tmp_path, subprocess_environment):
    (tmp_path / "somebody.py").write_text(textwrap.dedent(METHOD_AND_SCENE), encoding="utf-8")
    info = tmp_path / "somebody-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: somebody\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[rom.metamodels]\nrigid = somebody:Rigid\n\n[rom.scenes]\n"
                                           "two-springs = somebody:spring\n", encoding="utf-8")
    script = """
        import rom
        from rom.metamodels import applicable, method_names
        from rom.scenes import scene_from_json, scene_names
        assert "two-springs" in scene_names() and "rigid" in method_names()
        scene = rom.scene("two-springs")
        assert applicable(scene)["rigid"] is None
        cases = scene.sample(2, seed=0)
        model = rom.create("rigid", scene).fit()
        model.save("rigid.nc")
        again = rom.load("rigid.nc")
        assert again.scene.content_hash == scene.content_hash == scene_from_json(scene.to_json()).content_hash
        print(again.evaluate(cases).shape)
    """
    path = f"{tmp_path}:{':'.join(part for part in sys.path if part)}"
    run = subprocess.run([sys.executable, "-W", "error", "-c", textwrap.dedent(script)], cwd=tmp_path, text=True,
                         capture_output=True, env={**subprocess_environment, "PYTHONPATH": path})
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == "(2, 2)"
