"""Matrix Market files (https://math.nist.gov/MatrixMarket/formats.html); without their first line it is Abaqus's."""

from __future__ import annotations

from pathlib import Path

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
    return FoundMatrices("Matrix Market", {path.name: as_square(matrix, path.name)})
