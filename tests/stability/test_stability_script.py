"""`experiments/stability.py` prints outcomes, writes its folder, and refuses bad input in a sentence."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "experiments" / "stability.py"


def run(environment, *words):
    return subprocess.run([sys.executable, str(SCRIPT), "--quick", *words], env=environment, text=True,
                          capture_output=True)


def test_the_table_is_printed_and_the_folder_written(tmp_path, subprocess_environment):
    folder = tmp_path / "atlas"
    done = run(subprocess_environment, "--axis", "force size", "--methods", "direct,superposition", "--output",
               str(folder))
    assert done.returncode == 0, done.stderr
    assert "silent" in done.stdout and "force size" in done.stdout and "superposition" in done.stdout
    for name in ("results.nc", "index.html", "overview.png"):
        assert (folder / name).stat().st_size > 0


@pytest.mark.parametrize(("options", "word"), [(["--axis", "weather"], "weather"), (["--methods", "oracle"], "oracle"),
                                               (["--methods", ""], "choose from")])
def test_bad_input_is_refused_in_a_sentence(options, word, tmp_path, subprocess_environment):
    done = run(subprocess_environment, *options, "--output", str(tmp_path / "atlas"))
    assert done.returncode == 2
    assert word in done.stderr and len(done.stderr.splitlines()) == 1
