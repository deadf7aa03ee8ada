"""CalculiX: what *FREQUENCY, SOLVER=MATRIXSTORAGE writes.

JOB.sti and JOB.mas have "row column value" of one triangle, counted from 1; JOB.dof names each row as node.component.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rom.bodies.readers.found import FoundMatrices, from_triplets


def read(path: Path) -> FoundMatrices:
    """Stiffness, and the mass and the labels that lie beside it."""
    tables, labels, notes = {path.name: _table(path)}, None, []
    mass, names = path.with_suffix(".mas"), path.with_suffix(".dof")
    roles = {"stiffness": path.name}
    if mass.is_file():
        tables[mass.name], roles["mass"] = _table(mass), mass.name
        notes.append(f"read with {path.name}: {mass.name}")
    size = int(max(table[:, :2].max() for table in tables.values()))
    if names.is_file():
        try:
            labels = np.array([line.strip().split(".") for line in names.read_text().splitlines() if line.strip()],
                              dtype=np.int64)
        except ValueError as error:
            raise ValueError(f"{names.name} must name one degree of freedom a line as node.component ({error}): write "
                             "it again") from error
        size = len(labels)
    if any(table[:, :2].max() > size for table in tables.values()):
        raise ValueError(f"{names.name} names {size} degrees of freedom and the matrices have more: the files are not "
                         "of one run")
    return FoundMatrices("CalculiX", {name: from_triplets(table, size) for name, table in tables.items()}, labels,
                         roles, tuple(notes))


def _table(path: Path) -> np.ndarray:
    try:
        table = np.loadtxt(path, ndmin=2)
    except ValueError as error:
        raise ValueError(f"{path.name} must hold a row, a column and a value a line ({error}): write it again"
                         ) from error
    if table.shape[1] != 3 or not table.size:
        raise ValueError(f"{path.name} has {table.shape[1]} numbers a line: a row, a column and a value are wanted")
    return table
