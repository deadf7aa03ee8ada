"""The short form of the campaign over damaged files; the long one is ``python experiments/fuzz_files.py``."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

import fuzz_files


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    found = tmp_path_factory.mktemp("fuzz")
    fuzz_files.make(found)
    return found


@pytest.mark.parametrize("without_seal, allowed", [
    (False, {"refused", "same content"}),
    (True, {"refused", "same content", "other content"})])  # nobody can know what another program meant to write
def test_damaged_files_are_refused_in_one_sentence(folder, monkeypatch, without_seal, allowed):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(Path(__file__).parents[2]), *sys.path]))
    said: list[str] = []
    found = fuzz_files.campaign(folder, 150, seed=1, without_seal=without_seal, say=said.append)
    assert sum(found.values()) == 150
    assert {outcome for _, outcome in found} <= allowed, said
    assert {file for file, _ in found} == {kind.file for kind in fuzz_files.KINDS}  # 150 draws from 8 kinds
    assert sum(number for (_, outcome), number in found.items() if outcome == "refused") > 75
