"""What a file of matrices holds, before anyone says which of them is the stiffness."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

COMPONENTS = ("s", "x", "y", "z", "rx", "ry", "rz")
"""Names of a node's degrees of freedom by the number that most programs give them; 0 is a scalar point's."""

READERS = {
    ".mtx": ("matrix_market", "Matrix Market or Abaqus *MATRIX OUTPUT"), ".mm": ("matrix_market", "Matrix Market"),
    ".npz": ("array_files", "NumPy or SciPy archive"), ".mat": ("array_files", "MATLAB, up to version 7"),
    ".rsa": ("harwell_boeing", "Harwell-Boeing"), ".rua": ("harwell_boeing", "Harwell-Boeing"),
    ".psa": ("harwell_boeing", "Harwell-Boeing"), ".csa": ("harwell_boeing", "Harwell-Boeing"),
    ".rb": ("harwell_boeing", "Rutherford-Boeing"), ".hb": ("harwell_boeing", "Harwell-Boeing"),
    ".full": ("ansys", "Ansys .full"), ".pch": ("nastran", "Nastran DMIG"), ".dmig": ("nastran", "Nastran DMIG"),
    ".op4": ("nastran", "Nastran OP4"), ".sti": ("calculix", "CalculiX"),
}
"""Module of each ending and what the file is called; numbers after an ending (.pch1) do not matter."""


@dataclass(frozen=True, eq=False)
class FoundMatrices:
    """Square matrices by the names that the file gives them.

    Parameters
    ----------
    format : str
        In words.
    matrices : dict of (n, n) csr_array
    labels : (n, 2) ndarray of int, optional
        Node and number of the component (see :data:`COMPONENTS`) of each row.
    names : (n,) ndarray of str, optional
        Names of the rows where they are no nodes and components.
    roles : dict of str
        Which matrix is what, where the format says so: "stiffness", "mass", "viscous", "loss".
    notes : tuple of str
        What the reader did or left out.
    given : dict of str
        Names of nodes that stand for something else, such as the modes of a superelement.
    open_ended : bool
        Whether rows behind the last stored entry may exist, as in lists of entries without a size.
    """

    format: str
    matrices: dict[str, sp.csr_array]
    labels: np.ndarray | None = None
    roles: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    given: dict[int, str] = field(default_factory=dict)
    open_ended: bool = False
    names: np.ndarray | None = None


def known_endings() -> list[str]:
    """Endings of files of matrices."""
    return list(READERS)


def ending(path: str | Path) -> str:
    """A file's ending in lower case; that of a numbered punch file (.pch1) without its number."""
    return re.sub(r"(?<=^\.pch)\d+$", "", Path(path).suffix.lower())


def find_matrices(path: str | Path) -> FoundMatrices:
    """Read a file of matrices in any known format.

    Raises
    ------
    ValueError
        For an unknown ending, a damaged file, or a format whose extra is not installed.
    OSError
        Where the file cannot be read.
    """
    path = Path(path)
    if ending(path) not in READERS:
        raise ValueError(f"{path.name} ends in {path.suffix or 'nothing'}, which is no known file of matrices: give "
                         f"one of {' '.join(READERS)}")
    if not path.is_file():
        raise ValueError(f"{path} does not exist: correct the path")
    reader = importlib.import_module(f"rom.bodies.readers.{READERS[ending(path)][0]}")
    found: FoundMatrices = reader.read(path)
    return found


def given_names(path: Path) -> dict[int, str]:
    """Nodes with names, from comments before everything else such as ``$ scalar point 1001 is mode 1``."""
    with open(path, encoding="utf-8", errors="replace") as lines:
        comments = takewhile(lambda line: line.startswith(("$", "**")), lines)
        found = [re.match(r"(?:\$|\*\*) (?:scalar point|node) (\d+) is (.+)", line) for line in comments]
    return {int(one[1]): one[2].strip() for one in found if one}


def needed(module: str, package: str, extra: str, purpose: str) -> ModuleType:
    """Import an optional package; ValueError naming the extra where it is missing."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ValueError(f"{purpose} needs {package}: install it with `pip install 'fingertip-rom[{extra}]'`"
                         ) from error


def joined(entries: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]) -> tuple[dict[str, sp.csr_array], np.ndarray]:
    """Matrices over the union of their labels, from entries that name rows and columns by node and component.

    Parameters
    ----------
    entries : dict of ((k, 2), (k, 2), (k,)) ndarray
        Labels of row and column, and value, by the matrix's name.

    Returns
    -------
    matrices : dict of (n, n) csr_array
    labels : (n, 2) ndarray of int
        Sorted by node, then component.
    """
    every = np.concatenate([part for rows, columns, _ in entries.values() for part in (rows, columns)])
    labels, place = np.unique(every, axis=0, return_inverse=True)
    place, start, matrices = place.ravel(), 0, {}
    for name, (rows, _, values) in entries.items():
        row, column = place[start:start + len(rows)], place[start + len(rows):start + 2 * len(rows)]
        start += 2 * len(rows)
        matrices[name] = sp.coo_array((values, (row, column)), shape=(len(labels), len(labels))).tocsr()
    return matrices, labels


def from_triplets(table: np.ndarray, size: int) -> sp.csr_array:
    """(size, size) csr_array from rows "row column value" counted from 1."""
    row, column = table[:, :2].astype(np.int64).T - 1
    return sp.coo_array((table[:, 2], (row, column)), shape=(size, size)).tocsr()


def as_square(matrix: Any, name: str) -> sp.csr_array:
    """A csr_array; ValueError where the matrix is not square."""
    if getattr(matrix, "ndim", 0) != 2 or matrix.shape[0] != matrix.shape[1]:
        raise ValueError(f"{name} has shape {getattr(matrix, 'shape', ())}: a matrix of a body is square")
    return sp.csr_array(matrix)


def square_ones(arrays: Iterable[tuple[str, Any]]) -> dict[str, sp.csr_array]:
    """Those of named arrays that are square matrices of more than one row."""
    return {name: sp.csr_array(one) for name, one in arrays
            if getattr(one, "ndim", 0) == 2 and one.shape[0] == one.shape[1] > 1 and one.dtype.kind in "fciub"}
