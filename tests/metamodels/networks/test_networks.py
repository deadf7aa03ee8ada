"""What every network must do: seeds decide, batches equal loops, amplitudes multiply, forces add, training helps."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import torch

from rom.errors import NotFittedError
from rom.metamodels import ValidityWarning, create
from rom.metamodels.networks.transformer import superpose
from rom.scenes import CaseArrays

ROUNDING = 1e-4
"""Single precision, sums in another order."""


NAMES = ("transformer", "mlp", "mlp-residual", "pole-network")
ERROR_BARS = {"transformer": (0.001, 0.001), "mlp": (0.04, 0.5), "mlp-residual": (0.001, 0.01),
              "pole-network": (0.002, 0.1)}
"""Median error over training cases and largest over held-out ones."""


def close(a, b, size=None):
    size = np.linalg.norm(b, axis=1) if size is None else size
    return (np.linalg.norm(a - b, axis=1) <= ROUNDING * size).all()


def test_importing_the_networks_loads_no_torch():
    code = ("import sys, rom.metamodels.networks.mlp, rom.metamodels.networks.transformer, "
            "rom.datasets.tensors; sys.exit('torch' in sys.modules)")
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_errors_on_the_small_mesh(fitted):
    snapshots, model = fitted
    answer = model.evaluate(snapshots.arrays)
    error = np.linalg.norm(answer - snapshots.values, axis=1) / np.linalg.norm(snapshots.values, axis=1)
    training, held_out = ERROR_BARS[model.name]
    assert np.median(error[:snapshots.n_train]) < training
    assert error[snapshots.n_train:].max() < held_out


def test_training_lowers_the_loss(fitted):
    _, model = fitted
    assert model.history.train[-1] < 0.5 * model.history.train[0]
    assert min(model.history.validation) < model.history.validation[0]


def test_seed_decides_and_refit_repeats(fitted):
    snapshots, model = fitted
    short = {**model.settings, "steps": 2}
    one, other = (create(model.name, snapshots.scene, **short) for _ in range(2))
    state, threads = torch.get_rng_state(), torch.get_num_threads()
    first = one.fit(snapshots.train).evaluate(snapshots.arrays)
    assert one.settings == short
    torch.rand(3)
    assert np.array_equal(other.fit(snapshots.train).evaluate(snapshots.arrays), first)
    assert np.array_equal(one.fit(snapshots.train).evaluate(snapshots.arrays), first)
    third = create(model.name, snapshots.scene, **{**short, "seed": 1}).fit(snapshots.train)
    assert not np.array_equal(third.evaluate(snapshots.arrays), first)
    assert torch.get_num_threads() == threads
    torch.set_rng_state(state)
    expected = torch.rand(1)
    torch.set_rng_state(state)
    one.fit(snapshots.train)
    assert torch.equal(torch.rand(1), expected)


def test_batch_equals_loop_and_pad_is_part_of_field(fitted):
    snapshots, model = fitted
    arrays = snapshots.arrays.take(slice(60))
    batch = model.evaluate(arrays, "field")
    loop = np.concatenate([model.evaluate(arrays.take(slice(i, i + 1)), "field") for i in range(len(batch))])
    assert batch.dtype == (np.complex64 if snapshots.scene.harmonic else np.float32)
    assert close(loop, batch)
    assert close(model.evaluate(arrays, "pad"), batch[:, snapshots.scene.part_rows])


def test_forces_add_in_any_order_and_number(fitted):
    snapshots, model = fitted
    rng = np.random.default_rng(0)
    for number in range(1, 6):
        node = np.stack([rng.permutation(snapshots.scene.n_loads)[:number] for _ in range(4)])
        force = rng.uniform(-1.0, 1.0, node.shape)
        point = (np.full(4, 180.0), np.full(4, 0.2)) if snapshots.scene.harmonic else (None, None)
        together = model.evaluate(CaseArrays(node, force, *point))
        singly = [model.evaluate(CaseArrays(node[:, [j]], force[:, [j]], *point)) for j in range(number)]
        size = sum(np.linalg.norm(one, axis=1) for one in singly)
        assert close(sum(singly), together, size)
        order = rng.permutation(number)
        assert close(model.evaluate(CaseArrays(node[:, order], force[:, order], *point)), together, size)
        assert close(model.evaluate(CaseArrays(node, -3.0 * force, *point)), -3.0 * together, 3 * size)
        padded = [np.pad(array, ((0, 0), (0, 2))) for array in (node, force)]
        assert close(model.evaluate(CaseArrays(*padded, *point)), together, size)


def test_predict_labels_and_leaves_the_cases_alone(fitted):
    snapshots, model = fitted
    cases = snapshots.train.drop_vars("displacement")
    before = cases.copy(deep=True)
    with pytest.warns(ValidityWarning, match="nothing is known of its error"):
        answer = model.predict(cases)
    assert answer["displacement"].dims == ("case", "node", "component")
    assert cases.identical(before)


def test_progress_wraps_the_steps(snapshots_of):
    snapshots = snapshots_of("transformer")
    seen = []
    model = create("transformer", snapshots.scene, width=16, steps=5)
    model.progress = lambda steps: (seen.append(step) or step for step in steps)
    model.fit(snapshots.train)
    assert seen == [1, 2, 3, 4, 5]


def test_default_settings_answer_few_cases(snapshots_of):
    """A rank that is not asked for follows what the snapshots span."""
    for name in ("transformer", "mlp"):
        snapshots = snapshots_of(name)
        few = snapshots.train.isel(case=slice(12))
        model = create(name, snapshots.scene, width=16, steps=3).fit(few)
        assert np.isfinite(model.evaluate(snapshots.arrays)).all()
        assert model.settings["rank"] is None


@pytest.mark.parametrize(("name", "setting"), [
    ("transformer", {"width": 30}), ("transformer", {"steps": 0}), ("mlp", {"depth": -1}),
    ("mlp", {"storage": "half"}),
    ("pole-network", {"poles": 0}), ("mlp-residual", {"modes": 0}), ("mlp-residual", {"precision": "half"})])
def test_impossible_settings_are_refused(name, setting, snapshots_of):
    scene = snapshots_of(name).scene
    with pytest.raises(ValueError, match=next(iter(setting))):
        create(name, scene, **setting)


@pytest.mark.parametrize("name", NAMES)
def test_unfitted_and_untaught_networks_say_so(name, snapshots_of, tmp_path):
    snapshots = snapshots_of(name)
    model = create(name, snapshots.scene)
    with pytest.raises(NotFittedError):
        model.evaluate(snapshots.arrays)
    with pytest.raises(NotFittedError):
        model.save(tmp_path / "model.safetensors")
    with pytest.raises(ValueError, match="learns from snapshots"):
        model.fit()


def test_rank_beyond_the_snapshots_is_refused(snapshots_of):
    snapshots = snapshots_of("mlp-residual")
    with pytest.raises(ValueError, match="rank 900 is out of reach"):
        create("mlp-residual", snapshots.scene, modes=5, rank=900).fit(snapshots.train)


def test_superposition_of_cases_is_exact():
    rng = np.random.default_rng(1)
    loads = rng.uniform(size=(30, 8)) * (rng.uniform(size=(30, 8)) < 0.4)
    loads[:, 5] = 0.0
    unit = rng.normal(size=(8, 4))
    known, combined, answers = superpose(loads, loads @ unit)
    assert known.tolist() == [0, 1, 2, 3, 4, 6, 7]
    assert np.allclose(combined, np.delete(np.eye(8), 5, axis=0))
    assert np.allclose(answers, np.delete(unit, 5, axis=0))
    few = superpose(loads[:3], loads[:3] @ unit)
    assert np.allclose(few[1] @ unit, few[2])
