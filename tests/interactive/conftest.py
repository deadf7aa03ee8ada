"""One engine on the small fingertip for all tests, fitted once."""

import pytest

from rom.comparison.side_by_side import no_progress
from rom.interactive.engine import Engine
from rom.interactive.models import Models
from rom.metamodels import create


@pytest.fixture(scope="session")
def models(small_tip, harmonic_data, static_data):
    """The modal family as the server prepares it; one network and one POD, fitted to the small datasets."""
    found = Models(small_tip, quick=True)
    found.prepare(no_progress)
    for name, scene, data, settings in (
            ("mlp", found.harmonic, harmonic_data, {"width": 32, "steps": 20}),
            ("pod-galerkin", found.harmonic, harmonic_data, {"rank": 40}),
            ("pod-galerkin", found.static, static_data, {"rank": None}),
            ("transformer", found.static, static_data, {"width": 32, "steps": 60})):
        create(name, scene, **settings).fit(data).save(found.sources[name, scene.harmonic].path)
    return found


@pytest.fixture(scope="session")
def engine(models):
    return Engine(models)


@pytest.fixture(scope="session")
def limits(engine):
    return engine.limits
