"""Coordinates in which load paths lie close together that look alike.

Lengths and stretches of the quasi-static problem depend on ratios of its stresses alone: k1 / c, load / c and friction;
c itself matters only against the out-of-plane spring and the penalties. Logarithms of these ratios are the coordinates.
"""

from __future__ import annotations

import numpy as np

from rom.scenes.paths import PathArrays

REFERENCE = 3000.0
"""Of c [Pa]: the published one."""


def dimensionless(paths: PathArrays) -> np.ndarray:
    """(n_path, 4) ndarray: log k1/c, log F/c, log friction, log c, each of about one over the sampled ranges."""
    c = paths.c / REFERENCE
    load = paths.normal_force / (0.5 * c)
    fibre = paths.k1 / paths.c
    friction = np.maximum(paths.friction, 1e-3)
    return np.column_stack([np.log(fibre), np.log(load), np.log(friction), np.log(c)])
