"""Nastran: matrices as DMIG cards in a punch file, or in the binary or text form of OP4.

A DMIG card is DMIG, NAME, GJ, CJ, blank, G1, C1, A1, B1, ... in fields of 8 or 16 columns or between commas; its first
one, GJ = 0, gives the form (6: symmetric, one triangle) and the type of the numbers (3, 4: complex).
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rom.bodies.readers.found import FoundMatrices, given_names, joined, needed, square_ones

ROLES = (("K4", "loss"), ("K", "stiffness"), ("M", "mass"), ("B", "viscous"))
"""How the names of Nastran's matrices begin: KAAX, MAAX, BAAX, K4AAX, K2GG ..."""
SQUARE, RECTANGULAR, SYMMETRIC = 1, 2, 6


def read(path: Path) -> FoundMatrices:
    """Every square matrix of the file."""
    return _read_op4(path) if path.suffix.lower() == ".op4" else _read_dmig(path)


def _read_op4(path: Path) -> FoundMatrices:
    op4 = needed("pyyeti.nastran.op4", "pyyeti", "nastran", "Nastran's OP4")
    try:
        content = op4.read(str(path), sparse=None)
    except Exception as error:  # whatever its parser meets
        raise ValueError(f"{path.name} is no readable OP4 file ({error}): write it again") from error
    matrices = square_ones(content.items())
    return FoundMatrices("Nastran OP4", matrices, None, _roles(matrices),
                         ("OP4 has no labels: degrees of freedom are numbered",))


def _read_dmig(path: Path) -> FoundMatrices:
    entries: dict[str, list[tuple[int, int, int, int, complex]]] = defaultdict(list)
    form: dict[str, int] = {}
    with open(path, encoding="utf-8", errors="replace") as file:
        for words in _cards(file):
            name, node = words[1].upper(), int(words[2])
            if node == 0:  # the header
                form[name] = int(words[3])
                continue
            column = (node, int(words[3] or 0))
            for at in range(5, len(words) - 2, 4):
                row, component, real, imaginary = (words + [""] * 3)[at:at + 4]
                if row:
                    value = _number(real) + (1j * _number(imaginary) if imaginary else 0)
                    entries[name].append((int(row), int(component or 0), *column, value))
    square = {name: rows for name, rows in entries.items() if form.get(name, SQUARE) in (SQUARE, SYMMETRIC)}
    if not square:
        raise ValueError(f"{path.name} holds no square DMIG matrix: punch K and M with PARAM,EXTOUT,DMIGPCH")
    tables: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
    for name, rows in square.items():
        labels = np.array([row[:4] for row in rows], dtype=np.int64)
        values = np.array([row[4] for row in rows])
        tables[name] = labels[:, :2], labels[:, 2:], values if np.iscomplexobj(values) and values.imag.any() \
            else values.real
    matrices, labels = joined(tables)
    return FoundMatrices("Nastran DMIG", matrices, labels, _roles(matrices), given=given_names(path))


def _roles(names: dict) -> dict[str, str]:
    roles: dict[str, str] = {}
    for name in names:
        role = next((role for start, role in ROLES if name.upper().startswith(start)), None)
        if role is not None:
            roles.setdefault(role, name)
    return roles


def _cards(lines: Iterator[str]) -> Iterator[list[str]]:
    """Fields of each DMIG card, continuations joined."""
    card: list[str] = []
    for raw in lines:
        line = raw.split("$")[0].rstrip("\n").expandtabs(8)
        if not line.strip():
            continue
        if card and line[0] in "*+ ,":
            card += _fields(line)[1:]
            continue
        if card:
            yield card
        card = _fields(line) if re.match(r"DMIG\*?[ ,]", line, re.IGNORECASE) else []
    if card:
        yield card


def _fields(line: str) -> list[str]:
    """The first field and the eight, or four long, fields of data."""
    if "," in line:
        words = [word.strip() for word in line.split(",")]
        count = 5 if "*" in words[0] else 9
        return words[:count] + [""] * (count - len(words))
    width = 16 if "*" in line[:8] else 8
    return [line[:8], *(line[at:at + width].strip() for at in range(8, 72, width))]


def _number(word: str) -> float:
    """A real as Nastran writes it: 1.5, 1.5+6, 1.5D+06."""
    parts = re.fullmatch(r"([-+]?[\d.]+)[DdEe]?([-+]?\d+)?", word)
    if parts is None:
        raise ValueError(f"{word!r} in a DMIG card is no real number: write the file again")
    return float(f"{parts[1]}e{parts[2] or 0}")
