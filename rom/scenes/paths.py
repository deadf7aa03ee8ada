"""The inputs of a block of load paths: as plain arrays, and the checks that turn labelled ones into them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from rom.finger_on_glass.tissue import VARIANTS
from rom.scenes.cases import NO_FORCE
from rom.scenes.inputs import Input
from rom.scenes.labelled_cases import categories, check_cases, numbers

NUMBERS = {"c": "Pa", "k1": "Pa", "friction": "1", "normal_force": "N"}
"""Inputs of a path beside its variant, with their units."""
LONG_NAMES = {"c": "stiffness c of the ground matrix", "k1": "stiffness k1 of the fibres",
              "friction": "Coulomb coefficient", "normal_force": "normal force held while the plate slides"}
LARGEST = {"c": 1e9, "k1": 1e9, "friction": 1e5, "normal_force": 1e3}
"""What the full-order model takes at most."""


RANGES = {"c": (2000.0, 4500.0), "k1": (0.5, 2.0), "friction": (0.5, 1.2), "normal_force": (0.2, 0.8)}
"""Sampled ranges; that of ``k1`` in multiples of the variant's published value, on a logarithmic scale."""
INPUTS = (
    Input("variant", "", "arrangement of the fibres: radial, circumferential or random (one seed)",
          "arrangement of the collagen fibres", choices=tuple(VARIANTS)),
    Input("c", "Pa", "stiffness of the ground matrix, 2 to 4.5 kPa", LONG_NAMES["c"], range=RANGES["c"]),
    Input("k1", "Pa", "stiffness of the fibres, half to twice the published one of the variant", LONG_NAMES["k1"]),
    Input("friction", "1", "Coulomb coefficient, 0.5 to 1.2", LONG_NAMES["friction"], range=RANGES["friction"]),
    Input("normal_force", "N", "0.2 to 0.8 N, reached in 8 positions; then the plate slides 6 mm in 24 positions",
          LONG_NAMES["normal_force"], range=RANGES["normal_force"]))


@dataclass(frozen=True, eq=False, slots=True)
class PathArrays:
    """The inputs of a block of paths as plain arrays: what the lean calls take; each (n_path,) ndarray.

    Parameters
    ----------
    variant : ndarray of int
        Position in :data:`rom.finger_on_glass.tissue.VARIANTS`.
    c, k1 : ndarray [Pa]
    friction : ndarray
    normal_force : ndarray [N]
    """

    variant: np.ndarray
    c: np.ndarray
    k1: np.ndarray
    friction: np.ndarray
    normal_force: np.ndarray

    def __len__(self) -> int:
        """Number of paths."""
        return len(self.variant)

    def __iter__(self) -> Iterator[np.ndarray]:
        """The five fields, in order."""
        return iter((self.variant, self.c, self.k1, self.friction, self.normal_force))

    def take(self, index) -> PathArrays:
        """The paths at ``index`` (slice, mask or integers)."""
        return PathArrays(*(a[index] for a in self))

    def joined(self, other: PathArrays) -> PathArrays:
        """These paths, then the others."""
        return PathArrays(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    @property
    def numbers(self) -> np.ndarray:
        """(n_path, 4) ndarray: c, k1, friction, normal force."""
        return np.column_stack([self.c, self.k1, self.friction, self.normal_force])


def read_paths(cases: xr.Dataset, scene: str) -> PathArrays:
    """Check labelled paths and turn them into plain arrays.

    Parameters
    ----------
    cases : xr.Dataset
        ``variant`` (names or positions in VARIANTS), ``c``, ``k1``, ``friction``, ``normal_force``, each (case,).
    scene : str
        Its name, for messages.

    Raises
    ------
    ValueError
        For a missing variable, a wrong dimension, or a value that the full-order model cannot take.
    """
    check_cases(cases, scene, ["variant", *NUMBERS])
    variant = categories(cases, "variant", ("case",), list(VARIANTS))
    if (variant == NO_FORCE).any():
        raise ValueError(f"path {int(np.argmin(variant))} has no variant: give one of {', '.join(VARIANTS)}")
    return PathArrays(variant, **{name: _checked(numbers(cases, name, ("case",), unit), name)
                                  for name, unit in NUMBERS.items()})


def _checked(values: np.ndarray, name: str) -> np.ndarray:
    least = 0.0 if name == "friction" else np.finfo(float).tiny
    wrong = ~(np.isfinite(values) & (values >= least) & (values <= LARGEST[name]))
    if wrong.any():
        rule = "zero or more" if name == "friction" else "more than zero"
        raise ValueError(f"{name} holds {values[wrong][0]:g}: give {rule} and at most {LARGEST[name]:g} "
                         f"{NUMBERS[name]}, or drop the path")
    return values


def label_paths(paths: PathArrays) -> dict[str, tuple]:
    """Variables of labelled paths: the inverse of :func:`read_paths`."""
    return {
        "variant": ("case", paths.variant.astype(np.int8), {
            "long_name": "arrangement of the collagen fibres", "units": "1",
            "flag_values": np.arange(len(VARIANTS), dtype=np.int8), "flag_meanings": " ".join(VARIANTS)}),
        **{name: ("case", getattr(paths, name), {"long_name": LONG_NAMES[name], "units": unit})
           for name, unit in NUMBERS.items()}}
