"""`rom stability` prints outcomes, writes its folder, and refuses bad input in a sentence."""

import pytest

from rom.cli import main


def test_the_table_is_printed_and_the_folder_written(tmp_path, capsys):
    folder = tmp_path / "atlas"
    assert main(["stability", "--quick", "--axis", "force size", "--methods", "direct,superposition", "--output",
                 str(folder)]) == 0
    printed = capsys.readouterr().out
    assert "silent" in printed and "force size" in printed and "superposition" in printed
    for name in ("results.nc", "index.html", "overview.png"):
        assert (folder / name).stat().st_size > 0


@pytest.mark.parametrize(("options", "word"), [(["--axis", "weather"], "weather"), (["--methods", "oracle"], "oracle"),
                                               (["--methods", ""], "choose from")])
def test_bad_input_is_refused_in_a_sentence(options, word, capsys):
    assert main(["stability", "--quick", *options]) == 2
    error = capsys.readouterr().err
    assert word in error and len(error.splitlines()) == 1
