"""Reduced bodies taken to other programs: superelements, state space, universal files, functional mock-up units."""

from rom.bodies.export.fmu import write_fmu
from rom.bodies.export.matrices import write_matrices
from rom.bodies.export.state_space import StateSpace, state_space
from rom.bodies.export.superelement import Superelement, craig_bampton, interface_error
from rom.bodies.export.universal import read_universal, write_universal

__all__ = ["StateSpace", "Superelement", "craig_bampton", "interface_error", "read_universal", "state_space",
           "write_fmu", "write_matrices", "write_universal"]
