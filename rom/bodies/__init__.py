"""Bodies: linear second-order models with names, nodes and loads; knows no fingertip."""

from rom.bodies.body import Body, Coarser, Outline
from rom.bodies.grid import Grid
from rom.bodies.loads import Loads

__all__ = ["Body", "Coarser", "Grid", "Loads", "Outline"]
