"""A sheared block of bricks, for tests of bodies."""

import numpy as np

from rom.bodies import Material


def bricks(counts=(3, 2, 2), size=(0.3, 0.1, 0.08)):
    """(nodes, hexahedra) of a box of bricks, slightly sheared so that no entry is zero by chance."""
    axes = [np.linspace(0, length, count + 1) for length, count in zip(size, counts, strict=True)]
    x, y, z = (grid.ravel() for grid in np.meshgrid(*axes, indexing="ij"))
    nodes = np.column_stack([x, y + 0.05 * z, z + 0.1 * x])
    number = np.arange(len(nodes)).reshape([count + 1 for count in counts])
    corner = number[:-1, :-1, :-1].ravel()
    step = [number[1, 0, 0], number[0, 1, 0], number[0, 0, 1]]
    offsets = [0, step[0], step[0] + step[1], step[1]]
    return nodes, corner[:, None] + np.array(offsets + [o + step[2] for o in offsets])


STEEL = Material(young=210e9, poisson=0.3, density=7850.0)
