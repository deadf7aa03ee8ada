"""Small fingertips, scenes on them and datasets of those, made once for all tests."""

import os
import sys
from pathlib import Path

import pytest

# comparisons to the last bit need it: with more threads oneMKL adds in an order that hangs on timing
os.environ.setdefault("MKL_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))  # for hostile.py and energy.py, which tests import

from rom.datasets import make_dataset, read_dataset
from rom.fingertip import Fingertip, MeshDensity
from rom.scenes import get_scene

SMALL = MeshDensity((4, 4), 2, 2, (1, 1, 1, 2))
TINY = MeshDensity((4, 4), 1, 1, (1, 1, 1, 1))


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory):
    """No test finds what an earlier run left, and none leaves anything to the user."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROM_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def small_tip():
    """534 nodes, 1,335 free dofs, 22 pad nodes: a direct solve takes milliseconds."""
    return Fingertip(density=SMALL)


@pytest.fixture(scope="session")
def tiny_tip():
    """684 free dofs, 15 pad nodes: small enough for dense linear algebra."""
    return Fingertip(density=TINY)


@pytest.fixture(scope="session")
def static(small_tip):
    return get_scene("static-point-forces", small_tip)


@pytest.fixture(scope="session")
def harmonic(small_tip):
    return get_scene("harmonic-point-force", small_tip)


@pytest.fixture(scope="session")
def patches(small_tip):
    """Two patches on the pad, beside each other: six unit loads."""
    mesh = small_tip.mesh
    centre = mesh.fingerprint_centroid
    beside = next(int(node) for node in mesh.skin_patch(centre) if node in mesh.pad_nodes and node != centre)
    return get_scene("harmonic-patch-forces", small_tip, sites=(centre, beside))


@pytest.fixture(scope="session")
def tiny_harmonic(tiny_tip):
    return get_scene("harmonic-point-force", tiny_tip)


@pytest.fixture(scope="session")
def static_file(static, tmp_path_factory):
    return make_dataset(static, 120, tmp_path_factory.mktemp("static") / "static.nc", beyond=12, seed=3)


@pytest.fixture(scope="session")
def harmonic_file(harmonic, tmp_path_factory):
    return make_dataset(harmonic, 128, tmp_path_factory.mktemp("harmonic") / "harmonic.nc", beyond=16, seed=3)


@pytest.fixture(scope="session")
def patches_file(patches, tmp_path_factory):
    return make_dataset(patches, 96, tmp_path_factory.mktemp("patches") / "patches.nc", beyond=16, seed=3)


@pytest.fixture(scope="session")
def glass_file():
    """Twelve load paths on a section of 40 x 5 elements, which come with the toolkit."""
    return Path(__file__).parents[1] / "data" / "finger-on-glass-small.nc"


@pytest.fixture(scope="session")
def static_data(static_file):
    return read_dataset(static_file)


@pytest.fixture(scope="session")
def harmonic_data(harmonic_file):
    return read_dataset(harmonic_file)


@pytest.fixture(scope="session")
def patches_data(patches_file):
    return read_dataset(patches_file)


@pytest.fixture(scope="session")
def scene_of(static, harmonic, patches):
    """A scene on the small mesh, by name."""
    return {scene.name: scene for scene in (static, harmonic, patches)}


@pytest.fixture(scope="session")
def data_of(static_data, harmonic_data, patches_data):
    """A dataset of a scene on the small mesh, by the scene's name."""
    return {"static-point-forces": static_data, "harmonic-point-force": harmonic_data,
            "harmonic-patch-forces": patches_data}


@pytest.fixture(scope="session")
def subprocess_environment(_own_cache):
    """For commands that run beside the tests: one thread, the same temporary cache."""
    return {**os.environ, "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
