"""Matrices out of other programs' files: one file a format, found by a file's ending or its first line."""

from rom.bodies.readers.found import FoundMatrices, find_matrices, known_endings

__all__ = ["FoundMatrices", "find_matrices", "known_endings"]
