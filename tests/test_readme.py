"""What the README shows of bodies and methods of one's own runs as it stands."""

import re
from pathlib import Path

import pytest

import rom
from rom.metamodels import applicable
from rom.testing import check_metamodel

README = Path(__file__).parents[1] / "README.md"


@pytest.fixture(scope="module")
def names():
    section = README.read_text(encoding="utf-8").split("## Your own body, your own method")[1].split("\n## ")[0]
    names = {}
    for block in re.findall(r"```python\n(.*?)```", section, flags=re.S):
        exec(block, names)  # the README is ours
    return names


def test_the_rod_is_answered_to_its_tolerance(names):
    answer = names["answer"]
    assert answer.sizes == {"case": 5, "dof": 60, "force": 1} and (answer.error_estimate <= 1e-6).all()


def test_the_method_is_known_and_keeps_every_promise(names, tmp_path):
    assert applicable(names["scene"])["mean-response"] is None
    check_metamodel(rom.create("mean-response", names["scene"]))
