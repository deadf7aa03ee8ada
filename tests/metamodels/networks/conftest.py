"""Snapshots on the small mesh, and every network fitted to them once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

from rom.metamodels import Metamodel, create, metamodel_class
from rom.scenes import CaseArrays, Scene

SETTINGS = {
    "transformer": {"width": 32, "steps": 400},
    "mlp": {"rank": 30, "width": 64, "depth": 2, "steps": 400, "batch": 40},
    "mlp-residual": {"modes": 30, "rank": 20, "width": 64, "depth": 2, "steps": 300},
}
"""With these a fit takes about a second."""


class Snapshots(NamedTuple):
    """120 cases within the published ranges; the first 100 are for training."""

    scene: Scene
    arrays: CaseArrays
    values: np.ndarray
    train: xr.Dataset


@pytest.fixture(scope="session")
def snapshots_of(scene_of, data_of):
    """Snapshots by the name of a network."""
    def find(name: str) -> Snapshots:
        scene = scene_of[metamodel_class(name).scenes[0]]
        data = data_of[scene.name].isel(case=slice(120))
        return Snapshots(scene, scene.case_arrays(data), scene.values(data), data.isel(case=slice(100)))
    return find


@pytest.fixture(scope="session", params=list(SETTINGS))
def fitted(request, snapshots_of) -> tuple[Snapshots, Metamodel]:
    """Each network, fitted once, with its snapshots."""
    snapshots = snapshots_of(request.param)
    return snapshots, create(request.param, snapshots.scene, **SETTINGS[request.param]).fit(snapshots.train)
