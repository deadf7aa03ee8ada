import tomllib
from pathlib import Path

import numpy as np
import pytest

from rom.fingertip import Fingertip, MeshDensity

COARSE = MeshDensity((8, 8), 4, 4, (1, 1, 1, 2))


@pytest.fixture(scope="session")
def published():
    path = Path(__file__).parents[2] / "data" / "published.toml"
    return tomllib.loads(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def coarse():
    return Fingertip(density=COARSE)


@pytest.fixture(scope="session")
def study():
    return Fingertip.preset("study", formulation="full")


@pytest.fixture(scope="session")
def metamodel():
    return Fingertip.preset("metamodel")


@pytest.fixture(scope="session")
def brick():
    """A function: nodes (n, 3) [m] and hexahedra (e, 8) of a box."""

    def build(counts, sizes):
        axes = [np.linspace(0, size, count + 1) for count, size in zip(counts, sizes, strict=True)]
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        ids = np.arange(len(nodes)).reshape([count + 1 for count in counts])
        a, b, c = counts
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        hexahedra = [ids[i : i + a, j : j + b, k : k + c].ravel() for i, j, k in corners]
        return nodes, np.stack(hexahedra, axis=1)

    return build
