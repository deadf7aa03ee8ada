"""What comes from outside the package: a method of twenty lines, and a plate that is two matrices with two named dofs."""

import json

import numpy as np
import pytest
import scipy.sparse as sp

import rom
from rom.bodies import Body, Loads
from rom.comparison import chosen_curves, compare, write_results
from rom.metamodels import Metamodel, Needs, Stored, applicable, registry
from rom.metamodels.basis import room
from rom.reporting import write_report
from rom.scenes import LinearScene, get_scene
from rom.testing import check_metamodel


class QuasiStatic(Metamodel):
    """Static answers, turned by the loss factor."""

    name, summary, colour = "quasi-static", "leaves inertia out", "#123456"
    stored = (Stored("responses", ("load", "dof"), "displacement under a unit force", "m N-1"),)

    @classmethod
    def why_not(cls, scene):
        return None if isinstance(scene, LinearScene) and scene.harmonic else "leaves out inertia, which must be there"

    @classmethod
    def needs(cls, scene):
        return Needs(responses=True)

    def _fit(self, train):
        self.responses = self.scene.model.solve_static(self.scene.unit_loads).T

    def _evaluate(self, cases, outputs, out):
        rows = slice(None) if outputs == "field" else self.scene.part_rows
        fields = np.einsum("cf,cfn->cn", cases.force, self.responses[cases.node][..., rows])
        out = room(out, *fields.shape, self.scene.dtype)
        out[:] = fields / (1.0 + 1j * cases.loss_factor[:, None])
        return out


class MeanPath(Metamodel):
    """The mean of all training paths."""

    name, summary, learns = "mean-path", "answers with the mean of all training paths", True
    stored = (Stored("mean", ()),)

    @classmethod
    def why_not(cls, scene):
        return None if scene.name == "finger-on-glass" else "needs load paths"

    def _fit(self, train):
        self.mean = {name: values.mean(axis=0) for name, values in self.scene.values(train).items()}

    def _evaluate(self, cases, outputs, out):
        wanted = [name for name in self.mean if outputs == "field" or name not in ("displacement", "stretch_z")]
        return {name: np.repeat(self.mean[name][None], len(cases), axis=0) for name in wanted}


@pytest.fixture(scope="module", autouse=True)
def registered():
    """Both methods, known for as long as this module's tests run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "_REGISTERED", dict(registry._REGISTERED))
        for kind in (QuasiStatic, MeanPath):
            rom.metamodels.register(kind)
        yield


def plate(harmonic=True):
    """A square plate of 12 x 12 points, simply supported: the five-point Laplacian squared; two dofs have names."""
    n = 12
    one = sp.diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    laplacian = sp.kron(one, sp.eye_array(n)) + sp.kron(sp.eye_array(n), one)
    names = np.array([f"point-{i}" for i in range(n * n)])
    body = Body(1e3 * (laplacian @ laplacian), sp.eye_array(n * n) * 1e-3 if harmonic else None, dof_names=names,
                name="plate")
    columns = np.zeros((n * n, 2))
    columns[[5 * n + 6, 2 * n + 3], [0, 1]] = 1.0
    # the first two natural frequencies lie at 18 and 45 Hz
    return LinearScene(body, Loads.named(columns, ["centre", "corner"]), name="plate-forces", frequency=(1.0, 60.0),
                       part=["point-66", "point-27"])


@pytest.fixture(scope="module")
def results():
    return compare(plate(), cases=80, quick=True)


def test_the_plates_natural_frequencies_are_those_of_its_laplacian():
    # eigenvalues of the Laplacian on the grid: 4 sin^2(i pi / 26) + 4 sin^2(j pi / 26)
    first = (8 * np.sin(np.pi / 26) ** 2) ** 2
    found = plate().model.natural_modes(count=1).frequency_hz[0]
    assert found == pytest.approx(np.sqrt(1e6 * first) / (2 * np.pi), rel=1e-9)


def test_every_method_that_applies_is_compared_and_the_others_say_why(results):
    reasons = applicable(plate())
    assert set(results["method"].values) == {name for name, reason in reasons.items() if reason is None}
    assert {"direct", "direct-reused", "modal-krylov", "pod-galerkin", "quasi-static"} <= set(results["method"].values)
    told = json.loads(results.attrs["not_applicable"])
    assert told == {name: reason for name, reason in reasons.items() if reason is not None} and all(told.values())
    # two loads span few directions: no rank of the quick curve is there, so that pod-galerkin runs at its defaults
    assert all(text.startswith("pod-galerkin rank=") for text in json.loads(results.attrs["omitted"]))
    assert str(results["setting"].values[list(results["method"].values).index("pod-galerkin")]) == ""


def test_errors_of_the_plate_are_what_the_methods_can(results):
    error = dict(zip(results["method"].values, results["error_max"].sel(split="published").values, strict=True))
    assert error["direct"] < 1e-10 and error["direct-reused"] < 1e-10
    assert error["modal-krylov"] < 1e-3
    # past a resonance a quasi-static answer has the wrong sign
    assert 1.0 < error["quasi-static"] < np.inf
    for name in ("error_max", "online_seconds", "predict_seconds", "output_seconds", "batch_seconds", "offline_seconds"):
        assert np.isfinite(results[name].max()), name


def test_the_plates_report_is_written(results, tmp_path):
    write_results(results, tmp_path)
    page = write_report(results, tmp_path).read_text(encoding="utf-8")
    assert "quasi-static" in page and "leaves inertia out" in page
    assert json.loads(results.attrs["not_applicable"])["coarse-fem"] in page
    assert json.loads(results.attrs["method_colours"])["quasi-static"] == "#123456"


def test_a_plate_at_rest_is_compared_too():
    found = compare(plate(harmonic=False), cases=40, quick=True)
    error = dict(zip(found["method"].values, found["error_max"].sel(split="published").values, strict=True))
    assert error["superposition"] < 1e-12  # exact: the one factor's rounding
    assert "quasi-static" not in error
    assert not np.iscomplexobj(plate(harmonic=False).solve(plate(harmonic=False).sample(1))[0]["displacement"])


def test_a_method_from_outside_stands_in_the_comparison_of_the_fingertip(tiny_tip):
    found = compare("harmonic-point-force", methods=["quasi-static"], cases=60, quick=True, fingertip=tiny_tip)
    assert list(found["method"].values) == ["direct", "direct-reused", "quasi-static"]
    mine = found.isel(entry=2)
    assert mine["headline"] and float(mine["speedup_direct"]) > 0 and float(mine["snapshot_seconds"]) == 0


def test_a_method_from_outside_stands_in_the_comparison_of_the_finger_on_glass():
    scene = get_scene("finger-on-glass", rays=16, layers=2)
    found = compare(scene, methods=["mean-path"], cases=15, quick=True)
    assert list(found["method"].values) == ["direct", "mean-path"]
    assert found["position_error"].dims == ("entry", "split", "case", "position")
    error = found["error_max"].sel(split="published").values
    # the truth solved again, to the last bit; the mean of light and heavy presses is far off for the light ones
    assert error[0] == 0.0 and 0.1 < error[1] < 100.0
    assert (found["contact_error_max"].sel(split="published").values[0] == 0.0).all()
    assert float(found["snapshot_seconds"][1]) > 0


@pytest.mark.parametrize(("name", "settings"), [("quasi-static", {}), ("mean-path", {})])
def test_methods_from_outside_pass_the_conformance_suite(name, settings, harmonic, harmonic_data, glass_file):
    if name == "quasi-static":
        check_metamodel(rom.metamodels.create(name, harmonic, **settings), harmonic_data)
    else:
        data = rom.datasets.read_dataset(glass_file)
        check_metamodel(rom.metamodels.create(name, rom.scenes.scene_from_json(data.attrs["scene_parameters"])), data)


def test_a_method_that_does_not_apply_says_why():
    with pytest.raises(ValueError, match="mean-path does not apply to plate-forces: needs load paths"):
        chosen_curves(plate(), ["mean-path"], True)
