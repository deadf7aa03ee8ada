"""Where nothing is proven, every bound is infinite, and that is all: no warning but the method's own, no NaN."""

import numpy as np
import pytest
import scipy.sparse as sp

from rom.bodies import Body, Loads
from rom.fullorder.energy_norm import EnergyNorm
from rom.metamodels import ValidityWarning, create
from rom.metamodels.residual_bound import residual_bound
from rom.scenes import LinearScene


def row_of_springs(harmonic, **options):
    n = 12
    stiffness = 1e3 * sp.diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    mass = sp.diags_array(np.full(n, 1e-3)) if harmonic else None
    words = {"frequency": (1.0, 60.0)} if harmonic else {}
    return LinearScene(Body(stiffness, mass, **options), Loads.named(np.eye(n)[:, [2, 7]], ["left", "right"]), **words)


@pytest.mark.parametrize(("name", "settings"), [
    ("superposition", {}), ("superposition", {"precision": "float32"}), ("modal", {"modes": 3}),
    ("modal-static", {"modes": 3}), ("modal-krylov", {"modes": 3, "vectors": 2}),
    ("modal-krylov", {"modes": 12, "vectors": 2, "precision": "float32"})])
def test_no_floor_no_bound(monkeypatch, name, settings):
    monkeypatch.setattr(EnergyNorm, "floor", 0.0)
    scene = row_of_springs(name != "superposition")
    model, cases = create(name, scene, **settings).fit(), scene.sample(4, 1)
    assert np.isposinf(model.error_bound(cases)).all()
    with pytest.warns(ValidityWarning, match="relative error is 1 or more"):
        answer = model.predict(scene.cases_from(cases))
    assert np.isposinf(answer["error_estimate"].values).all()
    assert np.isfinite(answer["displacement"].values).all()


@pytest.mark.parametrize("harmonic", [False, True])
def test_no_floor_no_residual_bound(monkeypatch, harmonic):
    monkeypatch.setattr(EnergyNorm, "floor", 0.0)
    scene = row_of_springs(harmonic)
    cases = scene.sample(3, 1)
    assert np.isposinf(residual_bound(scene).bound(cases, scene.solve(cases)[0]["displacement"])).all()


def test_beside_a_loss_stiffness_only_the_loss_factor_is_sure():
    rng = np.random.default_rng(3)
    loss = sp.diags_array(np.r_[0.0, np.full(11, 300.0)])
    scene = row_of_springs(True, loss_stiffness=loss)
    cases, stiffness = scene.sample(6, 2), scene.model.stiffness
    truth = scene.solve(cases)[0]["displacement"]
    answer = truth * (1.0 + 1e-3 * rng.standard_normal(truth.shape))
    miss, size = (np.sqrt(np.einsum("cn,nc->c", part.conj(), stiffness @ part.T).real)
                  for part in (answer - truth, truth))
    bound = residual_bound(scene).bound(cases, answer)
    assert (miss / size <= bound).all()
    assert (bound < 200 * miss / size).all()
    for name in ("modal", "modal-krylov"):
        with pytest.raises(ValueError, match="cannot answer a body with a loss stiffness"):
            create(name, scene, modes=3).fit()
