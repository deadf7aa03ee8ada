"""Harwell-Boeing and Rutherford-Boeing files, assembled, real or complex, symmetric or not.

Duff, Grimes, Lewis, Users' Guide for the Harwell-Boeing Sparse Matrix Collection, 1992. SciPy reads the unsymmetric
ones only.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from rom.bodies.readers.found import FoundMatrices, as_square


def read(path: Path) -> FoundMatrices:
    """The one matrix of the file; of a symmetric one the lower triangle, as it is stored."""
    try:
        return FoundMatrices("Harwell-Boeing", {path.name: as_square(_matrix(path.read_text()), path.name)})
    except (IndexError, TypeError) as error:
        raise ValueError(f"{path.name} is no readable Harwell-Boeing file ({error}): write it again") from error


def _matrix(text: str) -> sp.csc_array:
    lines = text.splitlines()
    counts = [int(part) for part in lines[1].split()]
    kind = lines[2][:3].upper()
    if kind[0] not in "RC" or kind[1] not in "SUH" or kind[2] != "A":
        raise ValueError(f"the file is of type {kind}: only assembled matrices with values (RSA, RUA, CSA, CUA) can be "
                         "a body's")
    n_row, n_column, n_entry = (int(part) for part in lines[2][3:].split()[:3])
    # a Rutherford-Boeing file has no line about right-hand sides, and one number fewer in its second line
    start = 5 if len(counts) > 4 and counts[4] > 0 else 4
    formats = re.findall(r"\([^()]*(?:\([^()]*\)[^()]*)*\)", lines[3])
    pointers = _numbers(lines[start:start + counts[1]], formats[0])
    start += counts[1]
    rows = _numbers(lines[start:start + counts[2]], formats[1])
    start += counts[2]
    values = _numbers(lines[start:start + counts[3]], formats[2])
    if kind[0] == "C":
        values = values[::2] + 1j * values[1::2]
    if not (len(pointers) == n_column + 1 and len(rows) == len(values) == n_entry):
        raise ValueError(f"the file promises {n_entry} entries and holds {len(values)} values in {len(rows)} rows: it "
                         "is cut off; write it again")
    matrix = sp.csc_array((values, rows.astype(np.int64) - 1, pointers.astype(np.int64) - 1), shape=(n_row, n_column))
    if kind[1] == "H":
        raise ValueError("the matrix is Hermitian: a body's is symmetric")
    return matrix


def _numbers(lines: list[str], layout: str) -> np.ndarray:
    """Numbers of fixed width, as Fortran writes them: they need not have blanks between them."""
    width = int(re.findall(r"[IEDFG](\d+)", layout.upper())[0])
    words = [line[at:at + width] for line in lines for at in range(0, len(line.rstrip()), width)]
    return np.array([float(word.upper().replace("D", "E")) for word in words])
