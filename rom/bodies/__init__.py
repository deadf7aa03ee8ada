"""Bodies: linear second-order models with names, nodes and loads; knows no fingertip."""

from rom.bodies.body import Body, Coarser, Outline
from rom.bodies.from_mesh import Material
from rom.bodies.grid import Grid
from rom.bodies.loads import Loads
from rom.bodies.reading import read_body

body_from_mesh = Body.from_mesh

__all__ = ["Body", "Coarser", "Grid", "Loads", "Material", "Outline", "body_from_mesh", "read_body"]
