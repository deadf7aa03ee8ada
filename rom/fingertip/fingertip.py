"""The fingertip as a linear second-order model: anatomy in, matrices and loads out."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from rom.checks import shown, whole_number
from rom.fingertip import elasticity
from rom.fingertip.anatomy import Anatomy
from rom.fingertip.elements import Formulation, check_formulation
from rom.fingertip.mesh import FingertipMesh, build_mesh
from rom.fingertip.shell import Floats, Ints, MeshDensity

Rear = Literal["free", "fixed"]

DIRECTIONS = ("normal", "radial-ulnar", "distal-proximal")
"""Directions of a load on the skin; see `Fingertip.skin_frame`."""

PRESETS = {
    # 11,817 nodes, 10,240 elements and 512 rear nodes, beside the modal study's 11,637, 10,080 and 512
    "study": MeshDensity((16, 16), 8, 8),
    # 7,695 nodes and 239 pad nodes, beside the metamodel study's 7,677 and 239
    "metamodel": MeshDensity((14, 16), 6, 4),
    # 1,014 nodes: a check that everything runs, not a result
    "quick": MeshDensity((6, 6), 3, 2, (1, 1, 1, 2)),
}
"""Mesh densities of the presets, by name."""


@dataclass(frozen=True)
class Fingertip:
    """A fingertip on a rigid bone.

    Nothing is computed before it is asked for, and everything is kept; stiffness never needs the mass.

    Parameters
    ----------
    anatomy : Anatomy
    density : MeshDensity
    formulation : {"b-bar", "full"}
        "full" is as published and stiffens as nu -> 1/2; "b-bar" does not.
    rear : {"free", "fixed"}
        The section at the joint; the bone is always fixed.

    Raises
    ------
    ValueError
        For an unknown formulation or rear condition.
    """

    anatomy: Anatomy = field(default_factory=Anatomy)
    density: MeshDensity = PRESETS["study"]
    formulation: Formulation = "b-bar"
    rear: Rear = "free"

    def __post_init__(self) -> None:
        for name, kind in (("anatomy", Anatomy), ("density", MeshDensity)):
            if not isinstance(getattr(self, name), kind):
                raise ValueError(f"The {name} is {shown(getattr(self, name))}, but it must be of type {kind.__name__}: "
                                 "build one.")
        check_formulation(self.formulation)
        if not isinstance(self.rear, str) or self.rear not in get_args(Rear):
            raise ValueError(f"The rear is {shown(self.rear)}, but it can only be free or fixed: choose one.")

    @classmethod
    def preset(cls, name: str, **overrides: Any) -> Self:
        """Return the fingertip with the mesh of a published study: "study" or "metamodel".

        Parameters
        ----------
        name : {"study", "metamodel"}
        **overrides
            Any constructor argument.

        Raises
        ------
        ValueError
            For an unknown name.
        """
        if not isinstance(name, str) or name not in PRESETS:
            raise ValueError(f"There is no preset {shown(name)}: choose one of {', '.join(PRESETS)}.")
        return replace(cls(density=PRESETS[name]), **overrides)

    @cached_property
    def mesh(self) -> FingertipMesh:
        """FingertipMesh"""
        return build_mesh(self.anatomy, self.density)

    @cached_property
    def free_dofs(self) -> Ints:
        """(n_free,) ndarray : ascending dofs, 3 x node + component, of the nodes that can move."""
        moves = np.ones(self.mesh.n_nodes, dtype=bool)
        moves[self.mesh.bone_nodes] = False
        if self.rear == "fixed":
            moves[self.mesh.rear_nodes] = False
        return np.flatnonzero(np.repeat(moves, 3))

    @cached_property
    def stiffness_by_tissue(self) -> dict[str, sparse.csc_matrix]:
        """dict of (n_free, n_free) csc_matrix [N/m] : by tissue name; their sum is `stiffness`."""
        return self._on_free_dofs(elasticity.stiffness_by_tissue(self.mesh, self.anatomy, self.formulation))

    @cached_property
    def mass_by_tissue(self) -> dict[str, sparse.csc_matrix]:
        """dict of (n_free, n_free) csc_matrix [kg] : by tissue name; their sum is `mass`."""
        return self._on_free_dofs(elasticity.mass_by_tissue(self.mesh, self.anatomy))

    @cached_property
    def stiffness(self) -> sparse.csc_matrix:
        """(n_free, n_free) csc_matrix [N/m] : symmetric, positive definite."""
        return sparse.csc_matrix(sum(self.stiffness_by_tissue.values()))

    @cached_property
    def mass(self) -> sparse.csc_matrix:
        """(n_free, n_free) csc_matrix [kg] : symmetric, positive definite."""
        return sparse.csc_matrix(sum(self.mass_by_tissue.values()))

    def point_force(self, node: int, vector: ArrayLike) -> Floats:
        """Force on one node, as a right-hand side.

        Parameters
        ----------
        node : int
            Mesh node that can move.
        vector : (3,) array_like [N]

        Returns
        -------
        force : (n_free,) ndarray [N]

        Raises
        ------
        ValueError
            For a node that does not exist or is held, or a vector that is not three finite numbers.
        """
        try:
            components = np.asarray(vector)
        except ValueError:  # rows of different lengths
            components = np.empty(0)
        if components.dtype.kind not in "iuf" or components.shape != (3,) or not np.isfinite(components).all():
            raise ValueError(f"The force is {shown(vector)}, but it needs three finite components [N]: give x, y, z.")
        index = whole_number("node", node)
        if not 0 <= index < self.mesh.n_nodes:
            last = self.mesh.n_nodes - 1
            raise ValueError(f"Node {index} does not exist, as nodes go from 0 to {last}: choose one of them.")
        row = int(np.searchsorted(self.free_dofs, 3 * index))
        if row == len(self.free_dofs) or self.free_dofs[row] != 3 * index:
            raise ValueError(
                f"Node {index} is held (bone or fixed rear) and cannot carry a load: choose a free node, "
                "e.g. one of mesh.pad_nodes."
            )
        force = np.zeros(len(self.free_dofs))
        force[row : row + 3] = components
        return force

    def normal_force(self, pad_index: int) -> Floats:
        """Unit force along the inward normal of a pad node: it pushes into the skin.

        Parameters
        ----------
        pad_index : int
            Position in ``mesh.pad_nodes``.

        Returns
        -------
        force : (n_free,) ndarray [N]

        Raises
        ------
        ValueError
            For a position outside the pad, or a pad node that a fixed rear holds.
        """
        index, count = whole_number("pad_index", pad_index), len(self.mesh.pad_nodes)
        if not 0 <= index < count:
            raise ValueError(
                f"Pad index {index} is outside the pad, as mesh.pad_nodes has positions 0 to {count - 1}: "
                "choose one of them."
            )
        node = int(self.mesh.pad_nodes[index])
        return self.point_force(node, -self.mesh.normals[node])

    def skin_frame(self, node: int) -> dict[str, Floats]:
        """Orthonormal directions of loading at a skin node, keyed as in `DIRECTIONS`.

        Parameters
        ----------
        node : int
            Skin node.

        Returns
        -------
        frame : dict of (3,) ndarray [-]
            "normal" points into the skin, "distal-proximal" along it towards the tip, "radial-ulnar" across.

        Raises
        ------
        ValueError
            For a node that is not on the skin, or whose normal is the finger's long axis.
        """
        node = whole_number("node", node)
        self.mesh.check_skin_node(node)
        normal = -self.mesh.normals[node]
        along = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
        length = np.linalg.norm(along)
        if length < 1e-6:
            raise ValueError(f"Node {node} looks along the finger, where distal has no meaning: choose a pad node.")
        along /= length
        across = np.cross(normal, along)
        across *= -1.0 if across[1] < 0 else 1.0
        return dict(zip(DIRECTIONS, (normal, across, along), strict=True))

    def patch_force(self, node: int, direction: str) -> Floats:
        """Unit force shared equally by the nodes of ``mesh.skin_patch(node)``, as a right-hand side.

        Parameters
        ----------
        node : int
            Skin node at the patch's centre.
        direction : str
            One of `DIRECTIONS`, at the centre node.

        Returns
        -------
        force : (n_free,) ndarray [N]
            The nine nodes of a regular patch carry 1/9 N each.

        Raises
        ------
        ValueError
            For an unknown direction, a node off the skin, or a patch with a held node.
        """
        if not isinstance(direction, str) or direction not in DIRECTIONS:
            raise ValueError(f"There is no direction {shown(direction)}: choose one of {', '.join(DIRECTIONS)}.")
        vector, patch = self.skin_frame(node)[direction], self.mesh.skin_patch(node)
        return sum((self.point_force(int(one), vector / len(patch)) for one in patch), np.zeros(len(self.free_dofs)))

    @cached_property
    def pad_loads(self) -> sparse.csc_matrix:
        """(n_free, n_pad) csc_matrix [N] : column j is ``normal_force(j)``.

        Raises
        ------
        ValueError
            If the pad reaches a fixed rear.
        """
        pad = self.mesh.pad_nodes
        dofs = (3 * pad[:, None] + np.arange(3)).ravel()
        if not np.isin(dofs, self.free_dofs).all():
            raise ValueError("The pad reaches the fixed rear, but held nodes carry no load: raise pad_start.")
        rows = np.searchsorted(self.free_dofs, dofs)
        starts, shape = 3 * np.arange(len(pad) + 1), (len(self.free_dofs), len(pad))
        return sparse.csc_matrix((-self.mesh.normals[pad].ravel(), rows, starts), shape=shape)

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-able dict of all that defines this fingertip."""
        return {
            "anatomy": self.anatomy.to_dict(),
            "density": self.density.to_dict(),
            "formulation": self.formulation,
            "rear": self.rear,
        }

    @cached_property
    def content_hash(self) -> str:
        """str : sha256 over the definition and the mesh it leads to; changes with whatever changes results."""
        definition = json.dumps(self.to_dict() | {"mesh": self.mesh.mesh_hash}, sort_keys=True)
        return hashlib.sha256(definition.encode()).hexdigest()

    def _on_free_dofs(self, matrices: dict[str, sparse.csr_matrix]) -> dict[str, sparse.csc_matrix]:
        free = self.free_dofs
        return {name: sparse.csc_matrix(matrix[free][:, free]) for name, matrix in matrices.items()}
