"""Bodies to and from other Python toolkits: pyMOR's second-order models, matrices assembled by scikit-fem.

Plain SciPy matrices need nothing: ``Body(stiffness, mass)``.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import scipy.sparse as sp

from rom.bodies.body import Body
from rom.bodies.grid import COMPONENTS, Grid
from rom.bodies.loads import Loads
from rom.bodies.places import chosen_dofs, columns_of
from rom.bodies.readers.found import needed

SAME_PLACE = 1e-9
"""Distance, against the body's size, within which degrees of freedom are those of one node."""


def to_pymor(body: Body, inputs: str | Iterable[str] | Loads, outputs: str | Iterable[str]) -> Any:
    """The body as ``pymor.models.iosys.SecondOrderModel``: M, E = C, K, B and Cp.

    Parameters
    ----------
    body : Body
    inputs : str, iterable of str, or Loads
        Places of unit forces, see :func:`rom.bodies.places.chosen_dofs`, or loads.
    outputs : str or iterable of str
        Displacements.

    Raises
    ------
    ValueError
        Without mass or pyMOR, for places that do not exist, or with loss stiffness, which has no real matrix in time.
    """
    iosys = needed("pymor.models.iosys", "pyMOR", "pymor", "a model of pyMOR")
    if body.model.loss_stiffness is not None:
        raise ValueError("the body has a loss stiffness, and pyMOR's models are real: leave it out, or give viscous "
                         "damping instead")
    out = chosen_dofs(outputs, body.dof_names, body.grid)
    force = columns_of(inputs, body.dof_names, body.grid)[0]
    pick = np.zeros((len(out), body.model.n))
    pick[np.arange(len(out)), out] = 1
    damping = sp.csc_matrix((body.model.n,) * 2) if body.viscous is None else sp.csc_matrix(body.viscous)
    return iosys.SecondOrderModel.from_matrices(sp.csc_matrix(body.model.mass), damping,
                                                sp.csc_matrix(body.model.stiffness), force, pick, name=body.name)


def from_pymor(model: Any) -> tuple[Body, Loads]:
    """Matrices and inputs of a ``pymor.models.iosys.SecondOrderModel``.

    Raises
    ------
    ValueError
        For a model whose operators are no matrices, or without pyMOR.
    """
    to_matrix = needed("pymor.algorithms.to_matrix", "pyMOR", "pymor", "a model of pyMOR").to_matrix
    try:
        mass, damping, stiffness = (sp.csr_array(to_matrix(one, format="csr")) for one in (model.M, model.E, model.K))
        columns = np.asarray(to_matrix(model.B, format="dense"))
    except Exception as error:  # pyMOR names it by its rule tables
        raise ValueError(f"the model has operators that are no matrices ({error}): assemble it first") from error
    damping.eliminate_zeros()
    body = Body(stiffness, mass, viscous=damping if damping.nnz else None, name=model.name or "body",
                origin={"format": "pyMOR"})
    return body, Loads.named(columns, [f"input {i + 1}" for i in range(columns.shape[1])])


def from_scikit_fem(basis: Any, stiffness: Any, mass: Any = None, *, held: Any = (), name: str = "body",
                    **options: Any) -> Body:
    """A body from matrices that were assembled on a basis of scikit-fem.

    Parameters
    ----------
    basis : skfem.Basis
        Of an ``ElementVector``.
    stiffness, mass : (n, n) sparse matrix [N/m], [kg]
    held : array_like of int
        Degrees of freedom that are held, such as ``basis.get_dofs("clamp").flatten()``.
    name : str
    **options
        Of :class:`rom.bodies.Body`, such as ``viscous``, over all degrees of freedom of the basis.

    Returns
    -------
    Body
        Named by node (in the order of places) and component, on a grid of the places of the degrees of freedom.
    """
    from skfem.io.meshio import to_meshio

    places = np.zeros((3, basis.N))
    places[:len(basis.doflocs)] = basis.doflocs
    step = SAME_PLACE * float(np.ptp(places, axis=1).max())
    _, first, node = np.unique(np.round(places.T / step), axis=0, return_index=True, return_inverse=True)
    node = node.ravel()
    order = np.argsort(node, kind="stable")
    component = np.empty(basis.N, dtype=np.int64)
    component[order] = np.arange(basis.N) - np.searchsorted(node[order], node[order])
    count = int(component.max()) + 1
    corners = to_meshio(basis.mesh)
    points = np.zeros((len(corners.points), 3))
    points[:, :corners.points.shape[1]] = corners.points
    known = {tuple(place): i for i, place in enumerate(np.round(places.T[first] / step).tolist())}
    number = np.array([known.get(tuple(place), -1) for place in np.round(points / step).tolist()])
    cells = {block.type: number[block.data] for block in corners.cells if (number[block.data] >= 0).all()}
    keep = np.setdiff1d(np.arange(basis.N), np.asarray(held, dtype=np.int64))
    names = np.array([f"{i} {COMPONENTS[j]}" for i, j in zip(node.tolist(), component.tolist(), strict=True)])
    grid = Grid(np.ascontiguousarray(places.T[first]), (count * node + component)[keep], cells, COMPONENTS[:count])

    def part(matrix: Any) -> Any:
        return None if matrix is None else sp.csr_array(matrix)[keep][:, keep]

    return Body(part(stiffness), part(mass), dof_names=names[keep], grid=grid, name=name,
                origin={"format": "scikit-fem"},
                **{key: part(one) if sp.issparse(one) else one for key, one in options.items()})
