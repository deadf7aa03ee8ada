"""The gates of the weights that come with the toolkit, on fresh random held-out cases solved directly.

The sample's seed is new in every run; ``ROM_GATE_SEED`` repeats one. Which cases are held out is not up to it: the file
of weights names the split's seed, and the split follows from that.
"""

from __future__ import annotations

import os
import secrets

import numpy as np
import pytest

from rom.datasets import SPLITS, draw_combinations
from rom.datasets.splits import held_out_numbers
from rom.errors import NoWeightsError, SchemaError
from rom.metamodels.networks import sizes
from rom.metamodels.networks.sizes import weights_path
from rom.metamodels.networks.weights import trained_network
from rom.relative import relative_errors
from rom.scenes import CaseArrays, get_scene
from rom.scenes.harmonic_point_force import AMPLITUDE, FREQUENCY, LOSS_FACTOR

COMPARED_SEED = get_scene("harmonic-point-force").extent.seed
SEED = int(os.environ.get("ROM_GATE_SEED", secrets.randbelow(2**31)))
POINTS, COMBINATIONS = 5, 400
GATES = {"mlp": 0.05, "mlp-residual": 0.01, "pole-network": 0.01}
STATIC_GATE = 0.01
COMMITTED = [tuple(path.stem.rsplit("-", 2)) for path in sorted(sizes.FOLDER.glob("*.safetensors"))]


@pytest.fixture(scope="module")
def harmonic_scene():
    return get_scene("harmonic-point-force")


@pytest.fixture(scope="module")
def static_scene():
    return get_scene("static-point-forces")


@pytest.fixture(scope="module")
def held_out(harmonic_scene):
    """Every held-out node at random operating points of the grid, with direct answers."""
    rng, n_pad = np.random.default_rng(SEED), harmonic_scene.n_loads
    held = np.zeros(harmonic_scene.n_published, dtype=bool)
    held[held_out_numbers(harmonic_scene.n_published, COMPARED_SEED)] = True
    blocks = []
    for _ in range(POINTS):
        frequency, loss_factor = rng.choice(FREQUENCY), rng.choice(LOSS_FACTOR)
        node = np.arange(n_pad)[:, None]
        whole = CaseArrays(node, rng.uniform(*AMPLITUDE, size=(n_pad, 1)), np.full(n_pad, frequency),
                           np.full(n_pad, loss_factor))
        blocks.append(whole.take(held[harmonic_scene.published_number(whole)]))
    arrays = CaseArrays(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))
    assert 0.1 * n_pad * POINTS < len(arrays) < 0.3 * n_pad * POINTS
    return arrays, harmonic_scene.solve(arrays)[0]["displacement"]


@pytest.mark.parametrize("method", list(GATES))
def test_harmonic_networks_stay_within_their_gates(method, harmonic_scene, held_out):
    arrays, truth = held_out
    model = trained_network(method, harmonic_scene, split_seed=COMPARED_SEED)
    error = relative_errors(model.evaluate(arrays, "field"), truth)
    worst = int(error.argmax())
    assert error[worst] < GATES[method], (
        f"ROM_GATE_SEED={SEED}: {error[worst]:.2%} at node {arrays.node[worst, 0]}, {arrays.frequency[worst]:g} Hz, "
        f"loss factor {arrays.loss_factor[worst]:g}")


def test_the_transformer_stays_within_its_gate(static_scene):
    _, cases = draw_combinations(static_scene, 0, COMPARED_SEED, round(0.2 * static_scene.n_published))
    cases = cases.take(np.random.default_rng(SEED).choice(len(cases), COMBINATIONS, replace=False))
    model = trained_network("transformer", static_scene, split_seed=COMPARED_SEED)
    error = relative_errors(model.evaluate(cases, "field"), static_scene.solve(cases)[0]["displacement"])
    assert error.max() < STATIC_GATE, f"ROM_GATE_SEED={SEED}: {error.max():.2%}"


@pytest.mark.parametrize("row", COMMITTED, ids=" ".join)
def test_weights_say_what_they_are(row, harmonic_scene, static_scene):
    method, size, split = row
    scene = static_scene if method == "transformer" else harmonic_scene
    model = trained_network(method, scene, size, split, COMPARED_SEED)
    assert model.learned_from["split"] == split and split in SPLITS
    assert model.learned_from["cases"] > 1000
    assert weights_path(*row).stat().st_size < 20e6


def test_weights_for_other_meshes_splits_and_sizes_are_refused(tiny_harmonic, harmonic_scene, tmp_path, monkeypatch):
    with pytest.raises(NoWeightsError, match="another body or mesh"):
        trained_network("mlp", tiny_harmonic)
    with pytest.raises(NoWeightsError, match="split of seed 2026: cases held out by"):
        trained_network("mlp", harmonic_scene, split_seed=1)
    with pytest.raises(ValueError, match="no size of mlp"):
        weights_path("mlp", "huge")
    whole = weights_path("pole-network", "small").read_bytes()
    monkeypatch.setattr(sizes, "FOLDER", tmp_path)
    with pytest.raises(NoWeightsError, match="train them with"):
        trained_network("pole-network", harmonic_scene, "small")
    (tmp_path / "pole-network-small-published.safetensors").write_bytes(whole[:-1000])
    with pytest.raises(SchemaError, match="truncated or no safetensors"):
        trained_network("pole-network", harmonic_scene, "small")


def test_double_precision_answers_alike(harmonic_scene):
    arrays = harmonic_scene.sample(5, seed=1)
    single, double = (trained_network("pole-network", harmonic_scene, "small", precision=p)
                      for p in ("float32", "float64"))
    answers = [model.evaluate(arrays, "field") for model in (single, double)]
    assert [a.dtype for a in answers] == [np.complex64, np.complex128]
    assert relative_errors(*answers).max() < 1e-5
