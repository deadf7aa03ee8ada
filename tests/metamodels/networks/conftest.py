"""Snapshots on the small mesh, and every network fitted to them once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

from rom.datasets.schema import dataset_attributes
from rom.metamodels import Metamodel, applicable, create
from rom.scenes import CaseArrays, Scene

SETTINGS = {
    "transformer": {"width": 32, "steps": 400},
    "mlp": {"rank": 60, "terms": 12, "width": 24, "steps": 8},
    "mlp-residual": {"modes": 30, "rank": 30, "terms": 3, "width": 16, "steps": 8},
    "pole-network": {"rank": 60, "poles": 12, "powers": 1, "steps": 8},
}
"""With these a fit takes about a second."""


N_POINT = 90
"""Operating points at which every pad node is loaded: harmonic networks learn from whole sets."""


class Snapshots(NamedTuple):
    """Cases within the published ranges in random order; the first ``n_train`` are for training."""

    scene: Scene
    arrays: CaseArrays
    values: np.ndarray
    train: xr.Dataset
    n_train: int


def every_node_at_random_points(scene: Scene) -> CaseArrays:
    """Every pad node at :data:`N_POINT` points of the published grid, shuffled."""
    rng = np.random.default_rng(9)
    frequency, loss_factor = rng.choice(300, N_POINT, replace=False) + 1.0, rng.choice(9, N_POINT) * 0.05 + 0.1
    order = rng.permutation(N_POINT * scene.n_loads)
    node, point = np.arange(scene.n_loads)[order % scene.n_loads], order // scene.n_loads
    return CaseArrays(node[:, None], rng.uniform(0.01, 0.1, (len(order), 1)), frequency[point], loss_factor[point])


@pytest.fixture(scope="session")
def snapshots_of(scene_of, data_of):
    """Snapshots by the name of a network."""
    known: dict[str, Snapshots] = {}

    def find(name: str) -> Snapshots:
        scene = next(scene for scene in scene_of.values() if applicable(scene)[name] is None)
        if scene.name not in known:
            if scene.harmonic:
                arrays = every_node_at_random_points(scene)
                values = scene.solve(arrays)[0]["displacement"]
                data = scene.label(scene.cases_from(arrays), values).assign_attrs(dataset_attributes(scene))
            else:
                data = data_of[scene.name].isel(case=slice(120))
                arrays, values = scene.read(data), scene.values(data)
            n_train = len(arrays) * 5 // 6
            known[scene.name] = Snapshots(scene, arrays, values, data.isel(case=slice(n_train)), n_train)
        return known[scene.name]
    return find


@pytest.fixture(scope="session", params=list(SETTINGS))
def fitted(request, snapshots_of) -> tuple[Snapshots, Metamodel]:
    """Each network, fitted once, with its snapshots."""
    snapshots = snapshots_of(request.param)
    return snapshots, create(request.param, snapshots.scene, **SETTINGS[request.param]).fit(snapshots.train)
