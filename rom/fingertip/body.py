"""The fingertip as a body: everything made when it is asked for, nothing that a scene does not need."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp

from rom.bodies import Body, Coarser, Grid, Outline
from rom.fingertip.anatomy import TISSUES
from rom.fingertip.fingertip import Fingertip
from rom.fingertip.interpolation import interpolation_from
from rom.fingertip.locking import locking_reason
from rom.fingertip.pattern import entries_by_tissue, node_pattern
from rom.fullorder import SecondOrderModel

STIFFNESS_BLOCK, MASS_BLOCK = 9, 3
"""Entries of K and M between two nodes that share an element: M couples like components only."""
AXES = ("distance from the joint towards the tip", "lateral position", "position, dorsal positive")


class FingertipBody(Body):
    """A fingertip's matrices, mesh, doubts and coarser self.

    Parameters
    ----------
    fingertip : Fingertip
    with_mass : bool
        Whether anything vibrates; if not, no mass matrix is ever assembled.
    """

    def __init__(self, fingertip: Fingertip, with_mass: bool = True) -> None:
        self.fingertip, self.has_mass = fingertip, with_mass
        self.name = "fingertip"

    @cached_property
    def model(self) -> SecondOrderModel:
        return SecondOrderModel(self.fingertip.stiffness, self.fingertip.mass if self.has_mass else None)

    @cached_property
    def grid(self) -> Grid:
        mesh = self.fingertip.mesh
        return Grid(mesh.nodes, self.fingertip.free_dofs, {"hexahedron": mesh.hexahedra},
                    region={"hexahedron": mesh.tissue}, region_names=TISSUES, region_noun="tissue", axes=AXES,
                    noun="fingertip mesh", known_hash=mesh.mesh_hash, outside=mesh.skin_quads)

    @cached_property
    def dof_names(self) -> np.ndarray:  # type: ignore[override]
        """(n,) ndarray of int: 3 node + component of each degree of freedom."""
        return self.fingertip.free_dofs

    @property
    def doubts(self) -> tuple[str, ...]:  # type: ignore[override]
        reason = locking_reason(self.fingertip)
        return (reason,) if reason else ()

    has_coarser = True

    def coarser(self, scale: float) -> Coarser:
        tip = self.fingertip
        other = Fingertip(tip.anatomy, tip.density.scaled(scale), formulation=tip.formulation, rear=tip.rear)
        full = sp.kron(interpolation_from(other.mesh, tip.mesh), sp.identity(3), format="csr")
        return Coarser(FingertipBody(other, self.has_mass), full[tip.free_dofs][:, other.free_dofs].tocsr())

    def outline(self) -> Outline:
        """Upper limits: an assembly may drop entries that vanish exactly."""
        blocks = node_pattern(self.fingertip)
        parts = [*entries_by_tissue(self.fingertip).values(), int(blocks.nnz)]
        return Outline(sp.kron(blocks, np.ones((3, 3)), format="csr"),
                       tuple(STIFFNESS_BLOCK * count for count in parts),
                       tuple(MASS_BLOCK * count for count in parts) if self.has_mass else ())

    def afresh(self) -> FingertipBody:
        return FingertipBody(self.fingertip, self.has_mass)

    @property
    def content_hash(self) -> str:  # type: ignore[override]
        return self.fingertip.content_hash
