"""Networks that are a product: trained on stored sets, resumed after a kill, exact where the form is exact."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rom.datasets.reduced import open_dataset
from rom.datasets.whole import make_whole_dataset
from rom.errors import SchemaError
from rom.metamodels import create
from rom.metamodels.networks import variable_projection
from rom.metamodels.networks.output_layer import Statistics, solve_heads
from rom.metamodels.networks.trunks import PoleTrunk
from rom.metamodels.networks.variable_projection import SEGMENT, Checkpoint, Sketch, learn_trunk

POLES = {"rank": 40, "poles": 12, "steps": 4}


@pytest.fixture(scope="module")
def stored(tiny_harmonic, tmp_path_factory):
    """The whole published grid on the smallest mesh, and 2,000 of its training cases."""
    path = tmp_path_factory.mktemp("whole") / "whole.nc"
    make_whole_dataset(tiny_harmonic, path, modes=40, vectors=10, confirm=8)
    with open_dataset(path) as data:
        train = np.flatnonzero(data["split_published"].values == 1)
    return path, np.sort(np.random.default_rng(1).choice(train, 2000, replace=False))


def test_stored_and_labelled_cases_teach_the_same(tiny_harmonic, stored):
    path, cases = stored
    whole = create("pole-network", tiny_harmonic, **POLES).fit_stored(path, cases)
    with open_dataset(path, chunks=None) as data:
        some = data.isel(case=cases[::5]).load()
        other = data.isel(case=np.setdiff1d(np.arange(0, data.sizes["case"], 97), cases)).load()
    error = np.linalg.norm(whole.evaluate(tiny_harmonic.read(other)) - tiny_harmonic.values(other), axis=1)
    assert (error / np.linalg.norm(tiny_harmonic.values(other), axis=1)).max() < 0.05
    labelled = create("pole-network", tiny_harmonic, **POLES).fit(some)
    stored_too = create("pole-network", tiny_harmonic, **POLES).fit_stored(path, cases[::5])
    assert labelled.trained == stored_too.trained


def test_a_stored_set_of_another_mesh_is_refused(harmonic, stored):
    with pytest.raises(SchemaError, match="another body or mesh"):
        create("pole-network", harmonic, **POLES).fit_stored(*stored)


def sketch_of(true_poles, seed=0):
    """Answers with known poles at 300 points, four outputs."""
    rng = np.random.default_rng(seed)
    point = torch.from_numpy(np.column_stack([rng.uniform(1.0, 300.0, 300), rng.uniform(0.1, 0.5, 300)]))
    trunk = PoleTrunk(300.0, len(true_poles), 0)
    with torch.no_grad():
        trunk.log_pole.copy_(2.0 * torch.log(torch.tensor(true_poles) / 300.0))
        target = (trunk(point) @ torch.from_numpy(rng.standard_normal((len(true_poles), 4)) + 0j))[None]
    ones = torch.ones(1, 300, dtype=torch.float64)
    return Sketch(point, torch.arange(300)[None], ones[..., None], ones, target, torch.arange(300)[None] % 10 > 0)


def test_poles_are_learned():
    """With more poles than there are, since a training that must find each one can stay between two of them."""
    trunk = PoleTrunk(300.0, 8, 0)
    history = learn_trunk(trunk, sketch_of([80.0, 150.0, 170.0, 260.0]), 20)
    assert min(history.validation) < 0.05 * history.validation[0]


class Killed(Exception):
    """Stands for a kill."""


def test_a_killed_training_goes_on_to_the_same_result(tmp_path, monkeypatch):
    monkeypatch.setattr(variable_projection, "PATIENCE", 99)
    steps, sketch = SEGMENT + 4, sketch_of([70.0, 120.0, 155.0, 170.0, 240.0, 330.0])

    def trunk():
        return PoleTrunk(300.0, 4, 1)

    def dies(numbers):
        for step in numbers:
            if step == SEGMENT + 3:
                raise Killed
            yield step

    whole, halved = trunk(), trunk()
    history = learn_trunk(whole, sketch, steps)
    checkpoint = Checkpoint(tmp_path / "training.safetensors", "recipe")
    with pytest.raises(Killed):
        learn_trunk(halved, sketch, steps, dies, checkpoint)
    again = trunk()
    assert learn_trunk(again, sketch, steps, checkpoint=checkpoint) == history
    assert torch.equal(again.log_pole, whole.log_pole)
    with pytest.raises(SchemaError, match="other settings, cases or mesh"):
        learn_trunk(trunk(), sketch, steps, checkpoint=checkpoint._replace(recipe="other"))


def test_heads_solve_the_least_squares_problem_and_reach_unseen_nodes():
    rng = np.random.default_rng(0)
    place = np.linspace(0.0, 1.0, 12)
    features = np.exp(-8.0 * (place[:, None] - place) ** 2)
    heads = np.stack([np.sin(3 * place), np.cos(2 * place)], axis=1)[:, :, None] * np.ones((1, 1, 2))
    statistics = Statistics.empty(12, 2, 2)
    for node in np.delete(np.arange(12), 5).tolist():
        design = rng.standard_normal((20, 2)) + 1j * rng.standard_normal((20, 2))
        statistics.add(node, design, design @ heads[node])
    found = solve_heads(statistics, features, 1e-12)
    assert np.allclose(np.delete(found, 5, axis=0), np.delete(heads, 5, axis=0), atol=1e-6)
    assert np.allclose(found[5], heads[5], atol=1e-2)
    assert statistics.error(found) < 1e-6
    assert np.isclose(statistics.error(0.0 * heads), np.sqrt(statistics.square / statistics.count))
