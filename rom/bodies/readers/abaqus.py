"""Abaqus: the text files of *MATRIX GENERATE with *MATRIX OUTPUT.

FORMAT=COORDINATE has "row column value", counted from 1 without a size; FORMAT=MATRIX INPUT and FORMAT=LABELS have
"node, dof, node, dof, value". Matrices of one job lie side by side as JOB_STIF1.mtx, JOB_MASS1.mtx, JOB_DMPV1.mtx
(viscous) and JOB_DMPS1.mtx (structural).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rom.bodies.readers.found import FoundMatrices, from_triplets, given_names, joined

KINDS = {"STIF": "stiffness", "MASS": "mass", "DMPV": "viscous", "DMPS": "loss"}


def read(path: Path) -> FoundMatrices:
    """The file and its neighbours of the same job and number."""
    files, roles = {path.name: path}, {}
    named = re.match(r"(?P<job>.*)_(?P<kind>STIF|MASS|DMPV|DMPS)(?P<number>\d+)\.mtx$", path.name, re.IGNORECASE)
    if named:
        roles[KINDS[named["kind"].upper()]] = path.name
        for kind, role in KINDS.items():
            other = path.with_name(f"{named['job']}_{kind}{named['number']}.mtx")
            if other.is_file():
                files[other.name], roles[role] = other, other.name
    tables = {name: _table(file) for name, file in files.items()}
    widths = {table.shape[1] for table in tables.values()}
    notes = tuple(f"read with {path.name}: {name}" for name in files if name != path.name)
    if widths == {5}:
        matrices, labels = joined({name: (table[:, :2].astype(np.int64), table[:, 2:4].astype(np.int64), table[:, 4])
                                   for name, table in tables.items()})
        return FoundMatrices("Abaqus matrix input", matrices, labels, roles, notes, given_names(path))
    if widths != {3}:
        raise ValueError(f"{path.name} has lines of {' and '.join(map(str, sorted(widths)))} numbers: Abaqus writes 3 "
                         "(FORMAT=COORDINATE) or 5 (FORMAT=MATRIX INPUT), in all files of a job alike")
    size = int(max(table[:, :2].max() for table in tables.values()))
    matrices = {name: from_triplets(table, size) for name, table in tables.items()}
    return FoundMatrices("Abaqus coordinates", matrices, None, roles, notes, open_ended=True)


def _table(path: Path) -> np.ndarray:
    with open(path, encoding="utf-8", errors="replace") as lines:
        first = next((line for line in lines if line.strip() and not line.startswith("*")), "")
    if not first:
        raise ValueError(f"{path.name} holds no entries: write it again")
    try:
        table: np.ndarray = np.loadtxt(path, comments="*", delimiter="," if "," in first else None, ndmin=2)
    except ValueError as error:
        raise ValueError(f"{path.name} is neither Matrix Market nor of Abaqus ({error}): its first line must be "
                         "%%MatrixMarket ..., or every line 3 or 5 numbers") from error
    return table
