"""A scene builds nothing that it leaves out, and `import rom` stays cheap; each claim in a process of its own."""

import json
import subprocess
import sys

import pytest

from rom.metamodels import applicable, metamodel_class
from rom.scenes import get_scene

STATIC_RUN = """
import json, sys
import numpy as np
import scipy.sparse.linalg
import rom.fullorder.dynamic_stiffness, rom.fullorder.modes, rom.fullorder.second_order
from rom.fingertip import Fingertip, MeshDensity, elasticity
from rom.fullorder import SecondOrderModel


def forbid(owner, name, what):
    def refuse(*_, **__):
        raise AssertionError(f"a static scene asked for {what}")
    setattr(owner, name, property(refuse) if isinstance(owner, type) and not callable(getattr(owner, name)) else refuse)


for name in ("mass", "mass_by_tissue"):
    forbid(Fingertip, name, "the mass matrix")
forbid(elasticity, "mass_by_tissue", "the mass matrix")
forbid(SecondOrderModel, "mass", "the mass matrix")
for owner, name in ((scipy.sparse.linalg, "eigsh"), (rom.fullorder.modes, "natural_modes"),
                    (rom.fullorder.second_order, "natural_modes"), (SecondOrderModel, "natural_modes")):
    forbid(owner, name, "an eigenproblem")
for name in ("harmonic_factorization", "solve_harmonic", "dynamic_stiffness"):
    forbid(SecondOrderModel, name, "complex numbers")

from rom.datasets import draw_cases
from rom.datasets.schema import dataset_attributes
from rom.metamodels import create
from rom.scenes import get_scene
from rom.scenes.complex_parts import encode_complex

scene = get_scene("static-point-forces", Fingertip(density=MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))))
arrays, cases = draw_cases(scene, 60, 6, seed=1)
train = scene.label(cases, scene.solve(arrays)[0]["displacement"])
train.attrs.update(dataset_attributes(scene))
assert "part" not in encode_complex(train).dims
kinds = {str(train["displacement"].dtype)}
for method, settings in json.loads(sys.argv[1]).items():
    model = create(method, scene, **settings).fit(train)
    for answer in (model.predict(cases)["displacement"].values, model.evaluate(arrays, "pad")):
        kinds.add(str(answer.dtype))
        assert np.isrealobj(answer) and np.linalg.norm(answer) > 0
    kinds.update(str(a.dtype) for a in vars(model).values() if isinstance(a, np.ndarray))
print(json.dumps([sorted(kinds), sorted(sys.modules)]))
"""


def run(code, environment, *words):
    done = subprocess.run([sys.executable, "-c", code, *words], env=environment, capture_output=True, text=True,
                          timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def loaded(modules):
    return {name.split(".")[0] for name in modules}


@pytest.mark.parametrize(("module", "heavy"), [
    ("rom", {"numpy", "scipy", "xarray", "torch", "matplotlib", "skfem", "sklearn", "netCDF4"}),
    ("rom.cli", {"numpy", "scipy", "xarray", "torch", "matplotlib", "skfem", "sklearn", "netCDF4"}),
    ("rom.scenes", {"torch", "matplotlib", "sklearn", "netCDF4"}),
    ("rom.metamodels", {"torch", "matplotlib", "sklearn"}),
    ("rom.comparison", {"torch", "matplotlib", "sklearn"})])
def test_an_import_loads_little(module, heavy, subprocess_environment):
    modules = run(f"import {module}, json, sys; print(json.dumps(sorted(sys.modules)))", subprocess_environment)
    assert not loaded(modules) & heavy


def test_listing_the_methods_of_a_scene_loads_no_torch(subprocess_environment):
    code = "import json, sys; from rom.cli import main; main(['scenes']); print(json.dumps(sorted(sys.modules)))"
    modules = run(code, subprocess_environment)
    assert not loaded(modules) & {"torch", "matplotlib"}


def test_statics_build_nothing_that_the_scene_leaves_out(subprocess_environment):
    # every method but the network, which asks for torch itself, and says so
    scene = get_scene("static-point-forces")
    methods = {name: {"rank": 10} if metamodel_class(name, scene).learns else {}
               for name, reason in applicable(scene).items() if reason is None and name != "transformer"}
    assert {"direct", "direct-reused", "superposition", "pod-galerkin"} <= set(methods)
    kinds, modules = run(STATIC_RUN, subprocess_environment, json.dumps(methods))
    assert kinds == ["float64"]
    assert not loaded(modules) & {"torch", "matplotlib"}


def test_torch_comes_with_the_network_that_asks_for_it(subprocess_environment):
    network = {"transformer": {"rank": 10, "steps": 5, "width": 16, "heads": 2, "precision": "float64"}}
    _, modules = run(STATIC_RUN, subprocess_environment, json.dumps(network))
    assert "torch" in loaded(modules)  # so the test above can fail
    assert "matplotlib" not in loaded(modules)


def test_the_guards_bite(subprocess_environment):
    code = STATIC_RUN.split("scene = get_scene")[0] + """
refused = []
scene = get_scene("harmonic-point-force", Fingertip(density=MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))))
for ask in (lambda: scene.body.fingertip.mass, lambda: scene.model,
            lambda: SecondOrderModel(scene.body.fingertip.stiffness).natural_modes(count=3),
            lambda: SecondOrderModel(scene.body.fingertip.stiffness).solve_harmonic(None, 1.0, 0.1)):
    try:
        ask()
    except AssertionError as error:
        refused.append(str(error))
print(json.dumps(refused))
"""
    refused = run(code, subprocess_environment)
    assert refused == [f"a static scene asked for {what}" for what in
                       ("the mass matrix", "the mass matrix", "an eigenproblem", "complex numbers")]


COMPLEX_TRACE = """
import json
from rom.fullorder.pardiso import Pardiso
from rom.fullorder.superlu import Superlu
from rom.fingertip import Fingertip, MeshDensity
from rom.metamodels import create
from rom.scenes import get_scene

kinds = []
for engine in (Pardiso, Superlu):
    def watch(self, indptr, indices, dtype, begin=engine.__init__):
        kinds.append(str(dtype))
        begin(self, indptr, indices, dtype)
    engine.__init__ = watch
found = {}
for name, method in (("static-point-forces", "superposition"), ("static-point-forces", "direct"),
                     ("harmonic-point-force", "direct")):
    kinds.clear()
    scene = get_scene(name, Fingertip(density=MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))))
    create(method, scene).fit().evaluate(scene.sample(3))
    found[f"{name} {method}"] = sorted(set(kinds))
print(json.dumps(found))
"""


def test_no_complex_matrix_reaches_the_solver_in_statics(subprocess_environment):
    kinds = run(COMPLEX_TRACE, subprocess_environment)
    assert kinds["static-point-forces superposition"] == kinds["static-point-forces direct"] == ["float64"]
    assert kinds["harmonic-point-force direct"] == ["complex128"]  # so the tracer sees what it looks for


def test_import_takes_less_than_three_tenths_of_a_second(subprocess_environment):
    # the interpreter's own start is not counted; the least of five, as a busy machine only adds
    code = "import json, time; t = time.perf_counter(); import rom, rom.cli; print(json.dumps(time.perf_counter() - t))"
    assert min(run(code, subprocess_environment) for _ in range(5)) < 0.3
