"""A plan is true: what it says is built is built, what it says is left out is not, for every scene and method."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from rom.bodies import Body, Loads
from rom.cli import main
from rom.comparison.plan import explain, plan
from rom.comparison.plan_counts import Matrices
from rom.fingertip import FingertipBody
from rom.fingertip.fingertip import PRESETS
from rom.fullorder import factorize
from rom.fullorder.pardiso import load_library
from rom.metamodels import METHODS, applicable, create
from rom.scenes import LinearScene, get_scene

SCENES = ("static-point-forces", "harmonic-point-force", "harmonic-patch-forces")
OBSERVED = ("mesh", "second mesh", "stiffness", "mass", "real factorization", "complex factorization", "modes",
            "static responses", "snapshots", "scikit-learn", "torch", "complex answer", "full field online",
            "sensitivities", "figures")
"""Steps that stand for an event which can be watched, unlike those that only count."""

SMALL_SETTINGS = {
    "transformer": {"rank": 5, "steps": 3, "width": 16, "heads": 2}, "mlp": {"rank": 5, "steps": 3, "width": 16},
    "mlp-residual": {"modes": 5, "rank": 5, "steps": 3, "width": 16},
    "pole-network": {"rank": 5, "poles": 4, "steps": 3}, "modal-krylov": {"modes": 6, "vectors": 2},
    "modal-static": {"modes": 6}, "modal": {"modes": 6}, "pod-galerkin": {"rank": 8},
    "pod-regression": {"rank": 8, "width": 0.6, "ridge": 1e-6}, "coarse-fem": {"scale": 0.5},
    "lookup-table": {"modes": 6, "vectors": 2, "frequencies": 5, "loss_factors": 4}}
NETWORKS = ("transformer", "mlp", "mlp-residual", "pole-network")

TRACE = """
import json, sys, tracemalloc
import numpy as np
import rom.fingertip.fingertip as fingertip_module
from rom.comparison.plan import plan
from rom.datasets import draw_cases
from rom.datasets.schema import dataset_attributes
from rom.fingertip import Fingertip, MeshDensity, elasticity
from rom.fullorder import SecondOrderModel, second_order
from rom.fullorder.factorization import Factorization
from rom.fullorder.pardiso import Pardiso
from rom.fullorder.superlu import Superlu
from rom.metamodels import create
from rom.scenes import get_scene

events = []


def watch(owner, name, say):
    original = getattr(owner, name)
    def watched(*words, **options):
        events.append(say(*words))
        return original(*words, **options)
    setattr(owner, name, watched)


watch(fingertip_module, "build_mesh", lambda *_: "mesh")
watch(elasticity, "stiffness_by_tissue", lambda *_: "stiffness")
watch(elasticity, "mass_by_tissue", lambda *_: "mass")
for engine in (Pardiso, Superlu):
    watch(engine, "factorize", lambda self, _: "complex factor" if self.dtype.kind == "c" else "real factor")
watch(second_order, "natural_modes", lambda *_: "modes")
watch(SecondOrderModel, "solve_static", lambda self, force: ("columns", np.atleast_2d(force.T).shape[0]))
watch(Factorization, "solve", lambda self, b: ("size", self.n))


def fresh(name, outputs="field"):
    return get_scene(name, Fingertip(density=MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))), outputs)


def happened():
    return {"mesh": "mesh" in events, "second mesh": events.count("mesh") > 1,
            "stiffness": "stiffness" in events, "mass": "mass" in events,
            "real factorization": "real factor" in events, "complex factorization": "complex factor" in events}


found, trained = [], {}
for name, method, settings in json.loads(sys.argv[1]):
    for outputs in ("field", "pad"):
        learns = plan(fresh(name), method, outputs, **settings).step("snapshots").built
        if learns and name not in trained:
            events.clear()
            scene = fresh(name)
            arrays, data = draw_cases(scene, 40, seed=1)
            data = scene.label(data, scene.solve(arrays)[0]["displacement"], "field")
            data.attrs.update(dataset_attributes(scene))
            trained[name] = data, happened()
        train, before = trained[name] if learns else (None, {})
        events.clear()
        scene = fresh(name, outputs)
        model = create(method, scene, **settings).fit(train)
        cases = scene.sample(16, seed=5)
        offline = len(events)
        answer = model.evaluate(cases.take(slice(0, 1)))
        online = events[offline:]
        loads = [e[1] for e in events if isinstance(e, tuple) and e[0] == "columns" and e[1] == scene.n_loads]
        seen = {**happened(), "modes": "modes" in events, "static responses": bool(loads),
                "snapshots": train is not None, "scikit-learn": "sklearn" in sys.modules,
                "torch": "torch" in sys.modules, "complex answer": bool(np.iscomplexobj(answer)),
                "full field online": answer.shape[1] == scene.n_free or ("size", scene.n_free) in online,
                "sensitivities": "rom.vibration.matrix_derivatives" in sys.modules,
                "figures": "matplotlib" in sys.modules}
        peak = 0.0
        if outputs == "pad":
            model.evaluate(cases)  # warm
            tracemalloc.start()
            model.evaluate(cases)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        found.append([name, method, outputs, seen, before, sum(loads), model.model_bytes,
                      peak / (len(cases) * scene.n_free * scene.dtype.itemsize)])
print(json.dumps(found))
"""


ANSWER = {name: [method for method, reason in applicable(get_scene(name)).items() if reason is None] for name in SCENES}
"""Methods by the scene that they answer; nothing is built to know it."""


def pairs(networks):
    """Every scene and method; what loads a library that the others must not load stands last."""
    order = sorted(METHODS, key=lambda name: name == "pod-regression")
    return [(scene, method, SMALL_SETTINGS.get(method, {})) for method in order for scene in SCENES
            if method in ANSWER[scene] and (method in NETWORKS) == networks]


@pytest.fixture(scope="module")
def traced(subprocess_environment):
    """What each scene and method did, in processes that start with nothing loaded."""
    running = [subprocess.Popen([sys.executable, "-c", TRACE, json.dumps(pairs(networks))], env=subprocess_environment,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
               for networks in (False, True)]
    found = {}
    for process in running:
        out, error = process.communicate(timeout=120)
        assert process.returncode == 0, error
        found.update({tuple(row[:3]): row[3:] for row in json.loads(out.splitlines()[-1])})
    return found


@pytest.mark.parametrize("outputs", ["field", "pad"])
@pytest.mark.parametrize(("name", "method", "settings"), pairs(False) + pairs(True))
def test_a_plan_says_what_happens(traced, tiny_tip, name, method, settings, outputs):
    said = plan(get_scene(name, tiny_tip), method, outputs, **settings)
    seen, before, solved, model_bytes, peak = traced[name, method, outputs]
    assert {step: said.step(step).built for step in OBSERVED} == seen
    assert {step: said.step(step).snapshots for step in before} == (before or {})
    assert solved == said.step("static responses").counts.get("solves", 0)  # one call a Lanczos step, counted in theory
    online = said.step("online model").counts
    if "fields" in online:  # fields are most of what is held; participation factors are the rest
        assert online["bytes"] <= model_bytes <= 1.1 * online["bytes"]
    if not said.step("full field online").built and not said.step("second mesh").built:
        assert peak < 0.5  # by the allocations themselves: no room for one full field a case was taken


def test_every_method_is_traced(traced):
    assert {(name, method) for name, method, _ in traced} == {
        (name, method) for name in SCENES for method in ANSWER[name]}
    both = {step: {row[0][step] for row in traced.values()} for step in OBSERVED}
    for step, states in both.items():  # so that a comparison can fail: each event was seen, and seen to be absent
        assert states == {"mesh": {True}, "sensitivities": {False}, "figures": {False}}.get(step, {True, False}), step


def test_counts_are_those_of_the_matrices(small_tip):
    counted = Matrices(FingertipBody(small_tip))
    for matrix, by_tissue, said in ((small_tip.stiffness, small_tip.stiffness_by_tissue, counted.stiffness),
                                    (small_tip.mass, small_tip.mass_by_tissue, counted.mass)):
        assert said["dofs"] == matrix.shape[0]
        assert matrix.nnz <= said["entries"] <= 1.01 * matrix.nnz  # entries that vanish exactly may be dropped
        real = sum(m.data.nbytes + m.indices.nbytes + m.indptr.nbytes for m in [matrix, *by_tissue.values()])
        assert said["bytes"] == pytest.approx(real, rel=0.02)


def test_the_factor_is_counted_without_its_numbers(small_tip):
    said = Matrices(FingertipBody(small_tip)).factor(complex_=False)
    if load_library() is None:
        assert said == {}
        return
    with factorize(small_tip.stiffness) as factor:
        n, held = factor.n, factor.memory_bytes
    # the lower triangle of K must fit in, and the factor's own memory (indices and work space too) must hold it
    assert small_tip.stiffness.nnz / 2 < said["entries"] < n * (n + 1) / 2
    assert said["bytes"] < held
    # operations of L D L^T: sum of squared column lengths, so between the mean's square and the largest's
    assert said["entries"] ** 2 / n < said["flop"] < said["entries"] * n
    assert Matrices(FingertipBody(small_tip)).factor(complex_=True)["flop"] == 4 * said["flop"]


@pytest.mark.parametrize("name", SCENES)
def test_explain_prints_the_plan(capsys, monkeypatch, name, tiny_tip):
    monkeypatch.setitem(PRESETS, "metamodel", tiny_tip.density)
    assert main(["explain", name]) == 0
    out, error = capsys.readouterr()
    scene = get_scene(name, tiny_tip)
    assert error == "" and out.startswith(f"{name} by {scene.recommended}, recommended; outputs: field")
    said = plan(scene)
    head, left = out.split("left out\n")
    for step, part in [(s, head) for s in said.built] + [(s, left) for s in said.skipped]:
        assert f"  {step.name} " in part and step.why in part
    for key, reason in scene.leaves_out.items():  # what the scene declares is among the reasons
        if key in ("mass matrix", "torch"):
            assert reason in left


def test_a_plan_builds_nothing_but_the_mesh_and_its_unit_loads(tiny_tip):
    scene = get_scene("harmonic-point-force", replace(tiny_tip))
    plan(scene, "modal-krylov")
    built = set(vars(scene.body.fingertip))
    assert "model" not in vars(scene.body)
    assert not built & {"stiffness", "mass", "stiffness_by_tissue", "mass_by_tissue"}
    assert "mesh" in built


def test_a_body_of_matrices_has_a_plan_too():
    n = 40
    stiffness = sp.diags_array([-np.ones(n - 1), 2.1 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]).tocsr()
    scene = LinearScene(Body(stiffness, sp.eye_array(n)), Loads.named(np.eye(n)[:, :3], ["a", "b", "c"]))
    said = plan(scene, "modal-krylov", modes=5, vectors=2)
    assert not said.step("mesh").built and said.step("modes").built
    assert said.step("stiffness").counts["entries"] == 3 * n - 2 and said.step("mass").counts["entries"] == n
    assert said.step("static responses").counts == {"loads": 3, "solves": 9}  # one to start Lanczos, two vectors
    assert not said.step("complex factorization").built and plan(scene, "direct").step("complex factorization").built


def test_the_finger_on_glass_says_what_is_followed_and_what_is_left_out():
    scene = get_scene("finger-on-glass", rays=16, layers=2)
    direct, reduced, learned = (plan(scene, method) for method in ("direct", "pod-galerkin", "interpolation"))
    assert [step.name for step in direct.built] == ["section", "path", "contact"]
    assert reduced.recommended and reduced.step("path").why.startswith("in reduced coordinates: Newton")
    assert not learned.step("path").built and learned.step("path").snapshots and learned.step("snapshots").built
    for said in (direct, reduced, learned):
        assert {step.name for step in said.skipped} >= {"three dimensions", "mass matrix", "modes", "torch"}
        assert explain(said).count("left out") == 1
    assert plan(scene, "mlp").step("torch").built
    assert "mesh" in vars(scene) and "finger" not in vars(scene)


def test_refusals(static, harmonic):
    with pytest.raises(ValueError, match="modal does not apply to static-point-forces: a static answer has no"):
        plan(static, "modal")
    with pytest.raises(ValueError, match="'magic' is no method"):
        plan(static, "magic")
    with pytest.raises(ValueError, match="outputs='nail' is unknown"):
        plan(static, outputs="nail")
    with pytest.raises(ValueError, match="does not take the settings colour"):
        plan(harmonic, "modal", colour=3)


def test_the_recommended_methods_meet_their_gates(scene_of):
    for scene in scene_of.values():
        method = scene.recommended
        cases = scene.sample(12, seed=7)
        truth = create("direct-reused", scene).fit().evaluate(cases)
        answer = create(method, scene, **plan(scene).settings).fit().evaluate(cases)
        error = np.linalg.norm(answer - truth, axis=1) / np.linalg.norm(truth, axis=1)
        assert error.max() < scene.gate
