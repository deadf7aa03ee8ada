"""Work that resumes: the folder of finished pieces beside a file, the recipe that both carry, one writer at a time."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rom.cache import cache_folder
from rom.datasets.storage import open_netcdf
from rom.errors import SchemaError
from rom.files import check_output, is_intact, only_writer, remove_leftovers


@contextmanager
def pieces_of(path: Path, recipe: dict[str, Any], what: str) -> Iterator[Path | None]:
    """The folder for the pieces of ``path``, claimed for its recipe; None where the file is made already.

    It stays where the work fails, for the next run, and goes where it ends well. In the cache a damaged file is made
    anew, and who finds another one writing waits for it.

    Parameters
    ----------
    path : Path
        The file that the pieces become.
    recipe : dict
        Everything that the file depends on.
    what : str
        What the file holds, for messages.

    Raises
    ------
    OSError
        Where the path is a folder, a device or write-protected, before any work; where another process is writing it.
    FileExistsError
        Where the file was made from another recipe, or is no dataset: nothing is overwritten.
    SchemaError
        Where the folder holds pieces of another recipe.
    """
    path = check_output(path)
    cached = Path(os.path.realpath(cache_folder())) in path.parents
    if cached:
        is_intact(path)
    folder = path.with_name(path.name + ".pieces")
    made = _is_made(path, recipe, what)
    if made and not folder.is_dir():
        yield None
        return
    with only_writer(folder / "lock", path, wait=cached):
        if _is_made(path, recipe, what):  # by another one, just now or killed before it tidied up
            yield None
        else:
            _claim(folder, recipe)
            remove_leftovers(path)
            yield folder
        if not (folder / "recipe.json").exists() or recipe_in(folder) == recipe:
            shutil.rmtree(folder, ignore_errors=True)  # what stays goes with the next run


def _is_made(path: Path, recipe: dict[str, Any], what: str) -> bool:
    if not path.exists():
        return False
    if recipe_of(path) == recipe:
        return True
    raise FileExistsError(f"{path} exists and was not made from this recipe (scene, {what}, seed or software differ): "
                          "delete it or name another file")


def recipe_of(path: Path) -> dict[str, Any] | None:
    """The recipe that a dataset was made from; None where the file is none."""
    try:
        with open_netcdf(path) as data:
            return json.loads(data.attrs.get("recipe", "null"))
    except (SchemaError, TypeError, ValueError, RecursionError):
        return None


def recipe_in(folder: Path) -> dict[str, Any] | None:
    """The recipe of a folder of pieces; None where it has none that can be read."""
    try:
        return json.loads((folder / "recipe.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None


def _claim(folder: Path, recipe: dict[str, Any]) -> None:
    """Give the folder of pieces its recipe, or check that the one found has the same."""
    note = folder / "recipe.json"
    if note.exists():
        if recipe_in(folder) != recipe:
            raise SchemaError(f"{folder} holds pieces of another recipe (scene, cases, seed or software differ): "
                              "delete that folder or write to another file")
        return
    temporary = folder / "recipe.partial"
    temporary.write_text(json.dumps(recipe), encoding="utf-8")
    temporary.replace(note)
