"""Names of files to be written, checked before the work rather than after."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from rom.files import check_output


def check_files(arguments: argparse.Namespace, endings: Mapping[str, str]) -> None:
    """Refuse a wrong ending, a place where no file can be, or a missing folder.

    Parameters
    ----------
    arguments : argparse.Namespace
    endings : mapping of str
        Ending of each option that names a file, such as ``{"output": ".nc"}``.

    Raises
    ------
    ValueError, OSError
    """
    for name, ending in endings.items():
        path = getattr(arguments, name)
        if path is not None and path.suffix != ending:
            raise ValueError(f"--{name} got {str(path)!r}, but its name must end in {ending}: rename it")
        if path is not None and path.is_dir():
            raise ValueError(f"--{name} got {str(path)!r}, which is a folder: name a file")
        if path is not None and not path.parent.is_dir():
            raise ValueError(f"--{name} got {str(path)!r}, but the folder {path.parent} does not exist: make it first")
        if path is not None:
            check_output(path)
