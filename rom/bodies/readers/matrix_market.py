"""Matrix Market files (https://math.nist.gov/MatrixMarket/formats.html); without their first line it is Abaqus's.

Comments ``%dof NAME``, one for each row, are names of the degrees of freedom.
"""

from __future__ import annotations

from itertools import takewhile
from pathlib import Path

import numpy as np

from rom.bodies.readers import abaqus
from rom.bodies.readers.found import FoundMatrices, as_square


def read(path: Path) -> FoundMatrices:
    """The one matrix of a Matrix Market file, or what Abaqus wrote."""
    with open(path, "rb") as file:
        first = file.read(14)
    if first != b"%%MatrixMarket":
        return abaqus.read(path)
    import scipy.io

    try:
        matrix = scipy.io.mmread(path)
    except (ValueError, OverflowError) as error:
        raise ValueError(f"{path.name} is damaged ({error}): write it again") from error
    found = as_square(matrix, path.name)
    with open(path, encoding="utf-8", errors="replace") as lines:
        comments = takewhile(lambda line: line.startswith("%"), lines)
        names = [line[4:].strip() for line in comments if line.startswith("%dof ")]
    return FoundMatrices("Matrix Market", {path.name: found},
                         names=np.array(names) if len(names) == found.shape[0] else None)
