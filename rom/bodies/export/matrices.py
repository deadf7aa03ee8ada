"""Matrices of small bodies, such as superelements, in the text formats of other programs, with the names kept.

Degrees of freedom called ``node component`` (``17 z``) keep node and component; others, such as modes, become scalar
points (Nastran) or nodes of one degree of freedom (Abaqus) with labels beyond all nodes, told in comments.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from rom.bodies.body import Body
from rom.bodies.readers.found import COMPONENTS
from rom.files import whole_file

WRITERS = {".pch": "Nastran DMIG", ".inp": "Abaqus *MATRIX INPUT", ".mtx": "Matrix Market"}


def write_matrices(body: Body, path: str | Path) -> list[Path]:
    """Write stiffness, mass and, where there are any, loss stiffness and viscous damping.

    Parameters
    ----------
    body : Body
    path : str or Path
        ``NAME.pch`` for DMIG cards KAAX, MAAX, BAAX, K4AAX; ``NAME.inp`` for a deck that assembles the matrices of
        ``NAME_STIF1.mtx`` and ``NAME_MASS1.mtx`` beside it; ``NAME.mtx`` for ``NAME.mtx`` and ``NAME_mass.mtx`` in the
        Matrix Market format.

    Returns
    -------
    list of Path
        Of the files, the one to read first.

    Raises
    ------
    ValueError
        For another ending.
    OSError
        Where a file cannot be written.
    """
    path = Path(path)
    if path.suffix not in WRITERS:
        raise ValueError(f"{path.name} ends in {path.suffix or 'nothing'}: matrices are written as "
                         f"{', '.join(f'{ending} ({words})' for ending, words in WRITERS.items())}")
    matrices = {"stiffness": body.model.stiffness, "mass": body.model.mass if body.has_mass else None,
                "viscous": body.viscous, "loss": body.model.loss_stiffness}
    there = {role: sp.csr_array(one) for role, one in matrices.items() if one is not None}
    return {".pch": _punch, ".inp": _abaqus, ".mtx": _matrix_market}[path.suffix](body, there, path)


def numbered(names: np.ndarray) -> tuple[np.ndarray, dict[str, int]]:
    """Node and number of the component of each name, and the nodes given to names that have none.

    Parameters
    ----------
    names : (n,) ndarray

    Returns
    -------
    labels : (n, 2) ndarray of int
    given : dict of int
    """
    found = [re.fullmatch(r"(\d+) (" + "|".join(COMPONENTS[1:]) + ")", str(name)) for name in names]
    labels = np.array([(int(one[1]), COMPONENTS.index(one[2])) if one else (0, 0) for one in found])
    given, after = {}, int(labels[:, 0].max())
    for i, name in enumerate(names):
        if found[i] is None:
            after += 1
            labels[i, 0], given[str(name)] = after, after
    return labels, given


def _punch(body: Body, matrices: dict[str, sp.csr_array], path: Path) -> list[Path]:
    labels, given = numbered(body.dof_names)
    lines = [f"$ {body.name}", *(f"$ scalar point {node} is {name}" for name, node in given.items())]
    for role, title in (("stiffness", "KAAX"), ("mass", "MAAX"), ("viscous", "BAAX"), ("loss", "K4AAX")):
        if role not in matrices:
            continue
        lines.append(f"DMIG    {title:8s}{0:8d}{6:8d}{2:8d}{0:8d}{'':16s}{len(labels):8d}")
        columns = sp.csc_array(sp.triu(matrices[role]))
        for j, (node, component) in enumerate(labels.tolist()):
            at = slice(columns.indptr[j], columns.indptr[j + 1])
            if at.start < at.stop:
                lines.append(f"DMIG*   {title:16s}{node:16d}{component:16d}")
                lines += [f"*       {labels[i, 0]:16d}{labels[i, 1]:16d}{_sixteen(value)}"
                          for i, value in zip(columns.indices[at], columns.data[at], strict=True)]
    return [_write(path, lines)]


def _sixteen(value: float) -> str:
    """A real in sixteen columns with all the digits that Nastran's short exponent leaves room for."""
    for digits in range(12, 8, -1):
        mantissa, exponent = f"{value:.{digits}E}".split("E")
        word = f"{mantissa}{int(exponent):+d}"
        if len(word) <= 16:
            break
    return f"{word:>16s}"


def _abaqus(body: Body, matrices: dict[str, sp.csr_array], path: Path) -> list[Path]:
    labels, given = numbered(body.dof_names)
    labels[labels[:, 1] == 0, 1] = 1  # Abaqus has no scalar points: a node of one degree of freedom
    files, assembled = [], []
    head = [f"** {body.name}", *(f"** node {node} is {name}" for name, node in given.items())]
    lines = [*head]
    for role, title, word in (("stiffness", "STIF", "STIFFNESS"), ("mass", "MASS", "MASS"),
                              ("viscous", "DMPV", "VISCOUS DAMPING"), ("loss", "DMPS", "STRUCTURAL DAMPING")):
        if role not in matrices:
            continue
        file = path.with_name(f"{path.stem}_{title}1.mtx")
        lower = sp.coo_array(sp.tril(matrices[role]))
        rows = [f"{labels[i, 0]},{labels[i, 1]}, {labels[j, 0]},{labels[j, 1]}, {value:.16e}"
                for i, j, value in zip(lower.row, lower.col, lower.data, strict=True)]
        files.append(_write(file, [*head, *rows]))
        lines.append(f"*MATRIX INPUT, NAME={title}, TYPE=SYMMETRIC, INPUT={file.name}")
        assembled.append(f"{word}={title}")
    lines.append("*MATRIX ASSEMBLE, " + ", ".join(assembled))
    return [*files, _write(path, lines)]


def _matrix_market(body: Body, matrices: dict[str, sp.csr_array], path: Path) -> list[Path]:
    files = []
    for role, matrix in matrices.items():
        lower = sp.coo_array(sp.tril(matrix))
        lines = ["%%MatrixMarket matrix coordinate real symmetric", f"% {role} of {body.name}",
                 *(f"%dof {name}" for name in body.dof_names), f"{matrix.shape[0]} {matrix.shape[0]} {lower.nnz}",
                 *(f"{i + 1} {j + 1} {one:.16e}" for i, j, one in zip(lower.row, lower.col, lower.data, strict=True))]
        files.append(_write(path if role == "stiffness" else path.with_name(f"{path.stem}_{role}.mtx"), lines))
    return files


def _write(path: Path, lines: list[str]) -> Path:
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
