"""The same model on another mesh: identical at scale one, converging, carrying loads consistently."""

import numpy as np
import pytest

from rom.fingertip import Fingertip, MeshDensity
from rom.metamodels import create
from rom.relative import relative_errors
from rom.scenes import CaseArrays, get_scene


@pytest.fixture(scope="module")
def scene():
    return get_scene("static-point-forces", Fingertip(density=MeshDensity((6, 6), 3, 3, (1, 1, 1, 2))))


@pytest.fixture(scope="module")
def unit(scene):
    return CaseArrays(np.arange(scene.n_loads)[:, None], np.ones((scene.n_loads, 1)))


def test_scale_one_is_the_model_itself(scene, unit):
    answers = create("coarse-fem", scene, scale=1.0).fit().evaluate(unit)
    assert relative_errors(answers, create("direct", scene).fit().evaluate(unit)).max() <= 1e-9


def test_errors_fall_with_the_mesh(scene, unit):
    truth = create("direct", scene).fit().evaluate(unit)
    median = [np.median(relative_errors(create("coarse-fem", scene, scale=scale).fit().evaluate(unit), truth))
              for scale in (1 / 3, 2 / 3)]
    # a point load's own neighbourhood converges slowly: half the element size, at least a quarter off the error
    assert 0.01 < median[1] < 0.75 * median[0]


def test_compliance_grows_as_the_mesh_is_refined(scene, unit):
    # the average compliance under distributed pressure rises with refinement of a displacement method that locks
    # nowhere (Rayleigh-Ritz); B-bar and a curved boundary keep it from being strict, so the ends are compared
    pressure = CaseArrays(np.arange(scene.n_loads)[None], np.ones((1, scene.n_loads)))
    load = scene.force_vectors(pressure)[:, 0]
    coarse, fine = (create("coarse-fem", scene, scale=scale).fit().evaluate(pressure)[0] @ load
                    for scale in (1 / 3, 1.0))
    assert 0 < coarse < fine


@pytest.mark.parametrize("scale", [0.05, 5.0, float("nan")])
def test_impossible_scales_are_refused(scene, scale):
    with pytest.raises(ValueError, match="scale"):
        create("coarse-fem", scene, scale=scale)
