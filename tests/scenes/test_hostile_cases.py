"""Hostile case datasets are answered with finite numbers or refused in one sentence."""


import numpy as np
import pytest
import xarray as xr
from hostile import HOSTILE, numbers, one_line, refuses_or_makes, things
from hypothesis import given, settings
from hypothesis import strategies as st

from rom.errors import RomError
from rom.metamodels import create
from rom.scenes import get_scene, scene_from_json

METHODS = {"static-point-forces": {"superposition": {}, "direct-reused": {}},
           "harmonic-point-force": {"modal-krylov": {"modes": 8, "vectors": 3}, "direct-reused": {}},
           "harmonic-patch-forces": {"modal-static": {"modes": 8}}}
KINDS = [float, np.float32, np.float16, int, np.int8, np.uint64, complex, object, "U8", "S8", bool, "M8[ns]", "m8[s]"]

amplitudes = st.one_of(st.sampled_from([1e308, -1e308, 1e99, -1e99, 1e-99, 5e-324, 1e155, 0.0, -0.0, np.nan, np.inf]),
                       st.floats(allow_nan=True, allow_infinity=True))
points = st.one_of(st.sampled_from([0.0, 1e-300, 1e9, 1e10, 1e308, -1.0, np.nan, np.inf, 1e6]), st.floats())


@pytest.fixture(scope="module")
def models(scene_of):
    """Cheap methods of each scene, fitted."""
    return {name: [create(method, scene_of[name], **options).fit() for method, options in METHODS[name].items()]
            for name in METHODS}


def good(scene, count=3):
    return scene.cases_from(scene.sample(count, seed=4))


def answer(model, cases):
    """Finite, or refused or doubted in one sentence."""
    found = refuses_or_makes(lambda: model.predict(cases), ValueError, RomError)
    if found is not None:
        assert np.isfinite(found["displacement"].values).all()
    return found


@pytest.mark.filterwarnings("ignore::rom.metamodels.validity.ValidityWarning")
@pytest.mark.filterwarnings("ignore::rom.fullorder.IllConditionedWarning")
@pytest.mark.parametrize("name", METHODS)
@settings(HOSTILE, max_examples=20)
@given(data=st.data())
def test_numbers_of_every_size(scene_of, models, name, data):
    # numbers in the right places: huge ones may not become silent infinities
    scene = scene_of[name]
    cases = good(scene, 2)
    for variable in data.draw(st.sets(st.sampled_from([v for v in cases.data_vars if v != "direction"]), min_size=1)):
        values = np.array(cases[variable].values, dtype=float)
        values.flat[data.draw(st.integers(0, values.size - 1))] = data.draw(
            amplitudes if variable == "force_amplitude" else points)
        cases[variable] = (cases[variable].dims, values)
    for model in models[name]:
        answer(model, cases)


@pytest.mark.filterwarnings("ignore::rom.metamodels.validity.ValidityWarning")
@pytest.mark.parametrize("name", METHODS)
@settings(HOSTILE, max_examples=40)
@given(data=st.data())
def test_datasets_of_every_form(scene_of, models, name, data):
    scene = scene_of[name]
    cases = good(scene)
    variable = data.draw(st.sampled_from(list(cases.data_vars)))
    kind = data.draw(st.sampled_from(["missing", "dims", "type", "thing", "shape", "empty", "extra"]))
    if kind == "missing":
        cases = cases.drop_vars(variable)
    elif kind == "dims":
        dims = data.draw(st.lists(st.sampled_from(["case", "force", "node", "x"]), min_size=1, max_size=3, unique=True))
        cases[variable] = (dims, np.ones([cases.sizes.get(dim, 2) for dim in dims]))
    elif kind == "type":
        values = cases[variable].values
        made = data.draw(st.sampled_from(KINDS))
        with np.errstate(all="ignore"):
            try:
                cases[variable] = (cases[variable].dims, values.real.astype(made) if values.dtype.kind != "U"
                                   else np.full(values.shape, "x").astype("S" if made == "S8" else object))
            except (TypeError, ValueError):
                return
    elif kind == "thing":
        values = np.full(cases[variable].shape, None, dtype=object)
        for i in range(values.size):
            values.flat[i] = data.draw(things)
        cases[variable] = (cases[variable].dims, values)
    elif kind == "shape":
        size = data.draw(st.integers(0, 5))
        cases = cases.drop_dims("force", errors="ignore") if data.draw(st.booleans()) else cases
        cases = cases.assign({variable: (("case", "forces"), np.ones((cases.sizes["case"], size)))})
    elif kind == "empty":
        cases = cases.isel({data.draw(st.sampled_from(list(cases.dims))): slice(0, 0)})
    else:
        cases["colour"] = ("case", np.arange(cases.sizes["case"]))
    for model in models[name]:
        answer(model, cases)


@pytest.mark.parametrize("name", METHODS)
@settings(HOSTILE, max_examples=30)
@given(value=things)
def test_what_is_no_dataset(models, name, value):
    for thing in (value, xr.Dataset(), xr.Dataset({"load_node": 3}), None):
        with pytest.raises(ValueError) as caught:
            models[name][0].predict(thing)
        one_line(caught.value)


@settings(HOSTILE, max_examples=30)
@given(things, things)
def test_scenes_are_made_or_refused(tiny_tip, first, second):
    for make in (lambda: get_scene(first), lambda: get_scene("static-point-forces", tiny_tip, first),
                 lambda: get_scene("static-point-forces", first), lambda: get_scene("static-point-forces", sites=first),
                 lambda: get_scene("harmonic-patch-forces", tiny_tip, sites=first).unit_loads,
                 lambda: scene_from_json(first), lambda: create(first, second),
                 lambda: create("modal", get_scene("harmonic-point-force", tiny_tip), modes=first),
                 lambda: create("modal-krylov", get_scene("harmonic-point-force", tiny_tip), vectors=second),
                 lambda: create("pod-galerkin", get_scene("harmonic-point-force", tiny_tip), rank=first),
                 lambda: create("coarse-fem", get_scene("static-point-forces", tiny_tip), scale=first),
                 lambda: create("superposition", get_scene("static-point-forces", tiny_tip), precision=first)):
        refuses_or_makes(make, ValueError)


@settings(HOSTILE, max_examples=20)
@given(value=st.one_of(things, numbers))
def test_tolerances(models, scene_of, value):
    model = models["static-point-forces"][0]
    refuses_or_makes(lambda: model.predict(good(scene_of["static-point-forces"], 1), tolerance=value), ValueError)


def test_an_answer_scales_to_the_largest_force(models, scene_of):
    # linear: 1e99 N gives 1e99 times the answer of 1 N, to rounding, and nothing overflows on the way
    for name in ("static-point-forces", "harmonic-point-force"):
        one = good(scene_of[name], 2)
        for model in models[name]:
            large = model.predict(one.assign(force_amplitude=1e99 * one["force_amplitude"]))["displacement"].values
            small = model.predict(one)["displacement"].values
            np.testing.assert_allclose(large / 1e99, small, rtol=1e-9, atol=1e-12 * np.abs(small).max())
