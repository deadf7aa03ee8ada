"""Matrix Market files (https://math.nist.gov/MatrixMarket/formats.html); without their first line it is Abaqus's.

Comments ``%dof NAME``, one for each row, are names of the degrees of freedom.
"""

from __future__ import annotations

from itertools import takewhile
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from rom.bodies.readers import abaqus
from rom.bodies.readers.found import FoundMatrices, as_square


def read(path: Path) -> FoundMatrices:
    """The matrix, and NAME_mass.mtx, NAME_viscous.mtx, NAME_loss.mtx beside NAME.mtx; or what Abaqus wrote."""
    with open(path, "rb") as file:
        first = file.read(14)
    if first != b"%%MatrixMarket":
        return abaqus.read(path)
    found, roles = {path.name: _matrix(path)}, {"stiffness": path.name}
    for role in ("mass", "viscous", "loss"):
        other = path.with_name(f"{path.stem}_{role}.mtx")
        if other.is_file():
            found[other.name], roles[role] = _matrix(other), other.name
    notes = tuple(f"read with {path.name}: {name}" for name in found if name != path.name)
    with open(path, encoding="utf-8", errors="replace") as lines:
        comments = takewhile(lambda line: line.startswith("%"), lines)
        names = [line[4:].strip() for line in comments if line.startswith("%dof ")]
    return FoundMatrices("Matrix Market", found, None, roles, notes,
                         names=np.array(names) if len(names) == found[path.name].shape[0] else None)


def _matrix(path: Path) -> sp.csr_array:
    import scipy.io

    try:
        return as_square(scipy.io.mmread(path), path.name)
    except (ValueError, OverflowError) as error:
        raise ValueError(f"{path.name} is damaged ({error}): write it again") from error
