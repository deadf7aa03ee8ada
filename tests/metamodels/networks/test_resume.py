"""A training that is killed goes on to the same weights; a checkpoint of another training is refused."""

from __future__ import annotations

import pytest
import torch

from rom.errors import SchemaError
from rom.metamodels import create

SETTINGS = {"transformer": {"width": 32, "heads": 2, "steps": 40},
            "mlp": {"rank": 20, "terms": 8, "width": 8, "steps": 13},
            "pole-network": {"rank": 20, "poles": 8, "powers": 1, "steps": 13}}
KILLED_AT = {"transformer": 27, "mlp": 12, "pole-network": 12}


class Killed(Exception):
    """Stands for a kill."""


@pytest.fixture(params=list(SETTINGS))
def method(request, monkeypatch):
    from rom.metamodels.networks import variable_projection

    monkeypatch.setattr(variable_projection, "PATIENCE", 99)
    return request.param


def test_a_killed_training_goes_on_to_the_same_weights(method, snapshots_of, tmp_path):
    found, path = snapshots_of(method), tmp_path / "training.safetensors"

    def begin(**changed):
        model = create(method, found.scene, **{**SETTINGS[method], **changed})
        model.checkpoint = path
        return model

    def dies(steps):
        for step in steps:
            if step == KILLED_AT[method]:
                raise Killed
            yield step

    whole = create(method, found.scene, **SETTINGS[method]).fit(found.train)
    killed = begin()
    killed.progress = dies
    with pytest.raises(Killed):
        killed.fit(found.train)
    seen = []
    again = begin()
    again.progress = lambda steps: (seen.append(step) or step for step in steps)
    again.fit(found.train)
    assert seen[0] > 1
    for name, value in whole._module.state_dict().items():
        assert torch.equal(value, again._module.state_dict()[name]), name
    assert again.history == whole.history
    with pytest.raises(SchemaError, match="other settings, cases or mesh"):
        begin(seed=8).fit(found.train)
