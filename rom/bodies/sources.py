"""Which matrix of which file is meant: names, signs, factors and parts such as ``-imag(D)``."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from rom.bodies.readers.found import FoundMatrices, find_matrices
from rom.checks import shown

CUSTOMARY = {"stiffness": r"(k|stif)(?!4)", "mass": r"m", "viscous": r"(c|b|d|damp|viscous)$"}
"""How names of matrices begin where nobody says which is which."""
_EXPRESSION = re.compile(r"(?P<sign>-)?\s*(?:(?P<factor>\d[\d.]*(?:e[-+]?\d+)?)\s*\*)?\s*"
                         r"(?:(?P<part>real|imag)\((?P<inner>.+)\)|(?P<name>.+))", re.IGNORECASE)


class Sources:
    """The main file and every other that a name leads to."""

    def __init__(self, path: Path, found: FoundMatrices) -> None:
        self.path, self.found = path, found
        self.files = {path.name: path}
        self.used: set[str] = set()
        self.last: dict[str, str] = {}
        self.size = 0
        if not found.matrices:
            raise ValueError(f"{path.name} holds no square matrix: a body needs its stiffness")

    def guess(self, role: str) -> str | None:
        """The matrix that plays ``role`` by the format's or by customary names."""
        if role in self.found.roles:
            return self.found.roles[role]
        names = list(self.found.matrices)
        if role == "stiffness" and len(names) == 1:
            return names[0]
        fitting = [name for name in names if re.match(CUSTOMARY[role], name, re.IGNORECASE) and len(names) > 1
                   and (role == "stiffness" or self.found.matrices[name].dtype.kind != "c")]
        if len(fitting) == 1:
            return fitting[0]
        if role == "stiffness":
            raise ValueError(f"{self.path.name} does not say which matrix is the stiffness: it holds {self._list()}; "
                             "give stiffness=NAME and mass=NAME")
        return None

    def matrix(self, words: str, role: str) -> sp.csr_array:
        """What an expression such as ``-imag(D)`` stands for."""
        parts = _EXPRESSION.fullmatch(words.strip())
        if parts is None:
            raise ValueError(f"{role}={shown(words)} is no matrix: give NAME, -NAME, 2*NAME, real(NAME) or imag(NAME)")
        name = (parts["inner"] or parts["name"]).strip()
        matrix = self._named(name, role)
        self.last[role] = name
        self.size = self.size or matrix.shape[0]
        if matrix.shape[0] != self.size:
            raise ValueError(f"{self.last['stiffness']} has {self.size} rows and {name} {matrix.shape[0]}: those of a "
                             "body have the same rows")
        if parts["part"]:
            matrix = sp.csr_array(matrix.real if parts["part"].lower() == "real" else matrix.imag)
        factor = float(parts["factor"] or 1) * (-1 if parts["sign"] else 1)
        return matrix if factor == 1 else matrix * factor

    def _named(self, name: str, role: str) -> sp.csr_array:
        if name in self.found.matrices:
            self.used.add(name)
            return self.found.matrices[name]
        near = self.path.with_name(name)
        path = next((path for path in (Path(name), near) if path.is_file()), None)
        if path is None:
            raise ValueError(f"{role}={shown(name)} is neither a matrix of {self.path.name}, which holds "
                             f"{self._list()}, nor a file: correct the name")
        if path.resolve() == self.path.with_name(path.name).resolve() and path.name in self.found.matrices:
            self.used.add(path.name)
            return self.found.matrices[path.name]
        other = find_matrices(path)
        self.files[path.name] = path
        if len(other.matrices) > 1 and role not in other.roles:
            raise ValueError(f"{path.name} holds {self._list(other)}: read it as the main file, and name each")
        return self._fitted(other.matrices[other.roles.get(role, next(iter(other.matrices)))], other, path.name)

    def _fitted(self, matrix: sp.csr_array, other: FoundMatrices, name: str) -> sp.csr_array:
        """A matrix of another file over the rows of this one's."""
        size = self.size
        if self.found.labels is not None and other.labels is not None:
            row = {tuple(label): i for i, label in enumerate(self.found.labels.tolist())}
            place = [row.get(tuple(label), -1) for label in other.labels.tolist()]
            if -1 in place:
                node, component = other.labels[place.index(-1)]
                raise ValueError(f"{name} has node {node}, component {component}, and {self.path.name} has not: give "
                                 "matrices of one model")
            entries = matrix.tocoo()
            return sp.coo_array((entries.data, (np.array(place)[entries.row], np.array(place)[entries.col])),
                                shape=(size, size)).tocsr()
        if other.open_ended and matrix.shape[0] < size:
            matrix.resize(size, size)
        return matrix

    def unused(self) -> list[str]:
        """A hint for each matrix that nobody asked for."""
        return [f"left unused: {_words(name, matrix)}; name it by stiffness, mass, viscous or loss if it belongs here"
                for name, matrix in self.found.matrices.items() if name not in self.used]

    def origin(self) -> dict[str, Any]:
        """Where the matrices came from: names of files, their sha256, and the format."""
        beside = {name: self.path.with_name(name) for name in sorted(self.used)}
        files = self.files | {name: path for name, path in beside.items() if path.is_file()}
        return {"format": self.found.format,
                "files": {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()}}

    def _list(self, found: FoundMatrices | None = None) -> str:
        return ", ".join(_words(name, matrix) for name, matrix in (found or self.found).matrices.items())


def _words(name: str, matrix: sp.csr_array) -> str:
    return f"{name} ({matrix.shape[0]} x {matrix.shape[1]}{', complex' if matrix.dtype.kind == 'c' else ''})"
