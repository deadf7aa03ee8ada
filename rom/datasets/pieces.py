"""Work that resumes: the folder of finished pieces beside a file, and the recipe that both carry."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rom.datasets.storage import open_netcdf, remove_leftovers
from rom.errors import SchemaError


def begin_or_resume(path: Path, recipe: dict[str, Any], what: str) -> Path | None:
    """The folder for the pieces of ``path``, claimed for its recipe; None where the file is made already.

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
    IsADirectoryError
        Where the path is a folder.
    FileExistsError
        Where the file was made from another recipe, or is no dataset: nothing is overwritten.
    SchemaError
        Where the folder holds pieces of another recipe.
    """
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder: name a file for the dataset")
    if path.exists():
        if recipe_of(path) == recipe:
            return None
        raise FileExistsError(f"{path} exists and was not made from this recipe (scene, {what}, seed or software "
                              "differ): delete it or name another file")
    folder = path.with_name(path.name + ".pieces")
    _claim(folder, recipe)
    remove_leftovers(path)
    return folder


def recipe_of(path: Path) -> dict[str, Any] | None:
    """The recipe that a dataset was made from; None where the file is none."""
    try:
        with open_netcdf(path) as data:
            return json.loads(data.attrs.get("recipe", "null"))
    except (SchemaError, json.JSONDecodeError):
        return None


def _claim(folder: Path, recipe: dict[str, Any]) -> None:
    """Create the folder of pieces with its recipe, or check that the one found has the same."""
    note = folder / "recipe.json"
    if note.exists():
        if json.loads(note.read_text(encoding="utf-8")) != recipe:
            raise SchemaError(f"{folder} holds pieces of another recipe (scene, cases, seed or software differ): "
                              "delete that folder or write to another file")
        return
    folder.mkdir(parents=True, exist_ok=True)
    temporary = folder / "recipe.partial"
    temporary.write_text(json.dumps(recipe), encoding="utf-8")
    temporary.replace(note)
