"""A body: a linear second-order model, and what methods may want of it beside the matrices."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import scipy.sparse as sp

from rom.bodies.grid import Grid
from rom.fullorder import SecondOrderModel


class Coarser(NamedTuple):
    """The same body on another mesh."""

    body: Body
    prolongation: sp.csr_array
    """(n, n of the other body): carries its displacements to this body by interpolation."""


class Outline(NamedTuple):
    """What the matrices of a body hold, known before anything is assembled where that is possible."""

    pattern: Any
    """(n, n) sparse array, nonzero where K is."""
    stiffness: tuple[int, ...]
    """Stored entries of K, in the last place; before it those of its parts by region."""
    mass: tuple[int, ...]
    """The same of M; empty where there is none."""


class Body:
    """A linear body made from matrices; the fingertip is one by inheritance, with everything made when asked for.

    Parameters
    ----------
    stiffness : (n, n) scipy sparse matrix [N/m], or dict of them
        Real symmetric; by region where laws of damping differ by region: the body's is their sum.
    mass : (n, n) scipy sparse matrix [kg], optional
        Needed by everything that vibrates.
    dof_names : (n,) sequence, optional
        Labels of the degrees of freedom; default: 0, 1, 2 ...
    grid : Grid, optional
        Nodes and cells, where there are any: labels, pictures, files.
    name : str
        For titles and messages.
    doubts : tuple of str
        Why answers of this body are not to be trusted, whatever the method: such as locking.
    viscous : (n, n) scipy sparse matrix, optional [N s/m]
        Viscous damping, proportional or not.
    origin : dict, optional
        Where the body came from: ``format``, ``files`` (sha256 by name), ``notes`` (what reading changed or missed).
    **options
        Of :class:`rom.fullorder.SecondOrderModel`: ``loss_stiffness``, ``backend``.

    Raises
    ------
    ValueError
        As :class:`rom.fullorder.SecondOrderModel`; for labels that are not one for each degree of freedom, or doubled.
    """

    def __init__(self, stiffness: Any, mass: Any = None, *, dof_names: Any = None, grid: Grid | None = None,
                 name: str = "body", doubts: tuple[str, ...] = (), viscous: Any = None,
                 origin: dict[str, Any] | None = None, **options: Any) -> None:
        regions = dict(stiffness) if isinstance(stiffness, Mapping) else {}
        if regions:
            stiffness = sum(list(regions.values())[1:], next(iter(regions.values())))
        self.__dict__.update(model=SecondOrderModel(stiffness, mass, **options), grid=grid, doubts=tuple(doubts),
                             viscous=viscous, stiffness_by_region=regions, origin=dict(origin or {}))
        self.name, self.has_mass = name, mass is not None
        names = np.arange(self.model.n) if dof_names is None else np.asarray(dof_names)
        if names.shape != (self.model.n,) or len(np.unique(names)) != len(names):
            raise ValueError(f"{len(names)} names, {len(np.unique(names))} of them different, were given for "
                             f"{self.model.n} degrees of freedom: give each a name of its own")
        self.dof_names: np.ndarray = names

    @classmethod
    def from_mesh(cls, mesh: Any, materials: Any = None, **options: Any) -> Self:
        """Assemble a body of linear elastic solids; parameters as :func:`rom.bodies.from_mesh.assembled`."""
        from rom.bodies.from_mesh import assembled

        return cls(**assembled(mesh, materials, **options))

    # each may be overridden by a body that makes it when it is asked for

    @cached_property
    def model(self) -> SecondOrderModel:
        """The full-order model."""
        raise NotImplementedError

    @cached_property
    def grid(self) -> Grid | None:
        """Nodes and cells, where there are any."""
        return None

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Why answers of this body are not to be trusted, whatever the method."""
        return ()

    @cached_property
    def viscous(self) -> sp.csr_array | None:
        """(n, n) viscous damping [N s/m], where there is any."""
        return None

    @cached_property
    def stiffness_by_region(self) -> dict[str, sp.csr_array]:
        """Stiffness of each region [N/m], where it is known by region; their sum is the model's."""
        return {}

    @cached_property
    def origin(self) -> dict[str, Any]:
        """Where the body came from, and what reading it changed."""
        return {}

    @property
    def notes(self) -> tuple[str, ...]:
        """What reading the body changed or missed, in sentences."""
        return tuple(self.origin.get("notes", ()))

    has_coarser: bool = False
    """Whether there is another mesh of the same body."""

    def coarser(self, scale: float) -> Coarser:
        """The same body with ``scale`` times as many elements along each edge; ValueError where there is no other."""
        raise ValueError(f"{self.name} has no other mesh: leave out the methods that solve on one")

    def outline(self) -> Outline:
        """What its matrices hold."""
        mass = (self.model.mass.nnz,) if self.has_mass else ()
        return Outline(self.model.stiffness, (self.model.stiffness.nnz,), mass)

    def afresh(self) -> Body:
        """The same body with nothing factorised yet."""
        other = copy.copy(self)
        other.__dict__["model"] = self.model.afresh()
        return other

    @cached_property
    def content_hash(self) -> str:
        """sha256 over everything that changes an answer: matrices, labels, grid."""
        return self.matrix_hash

    @cached_property
    def matrix_hash(self) -> str:
        """sha256 over matrices, labels and grid, whatever else a body calls its content."""
        digest = hashlib.sha256()
        for matrix in (*self.model.matrices, self.viscous, *self.stiffness_by_region.values()):
            if matrix is None:
                digest.update(b"none")
            else:
                canonical = sp.csr_array(matrix, copy=True)
                canonical.sum_duplicates()
                for array in (canonical.indptr.astype(np.int64), canonical.indices.astype(np.int64), canonical.data):
                    digest.update(array.tobytes())
        digest.update("\n".join(map(str, self.dof_names)).encode())
        digest.update((self.grid.mesh_hash if self.grid is not None else "").encode())
        return digest.hexdigest()

    def write(self, path: str | Path) -> None:
        """Keep the body as one netCDF file (.nc), which :func:`rom.bodies.read_body` reads back.

        Raises
        ------
        ValueError
            For another ending.
        OSError
            Where the file cannot be written.
        """
        from rom.bodies.storage import write_body

        write_body(self, path)
