"""Stored entries of the fingertip's matrices, counted on the mesh before anything is assembled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from rom.fingertip.anatomy import TISSUES

if TYPE_CHECKING:
    from rom.fingertip.fingertip import Fingertip
    from rom.fingertip.shell import Ints


def node_pattern(tip: Fingertip) -> sparse.csr_array:
    """Which free nodes share an element: the block pattern of K and M.

    Returns
    -------
    (n_free_node, n_free_node) csr_array of int
        How many elements two nodes share; three free dofs stand behind each node.
    """
    return _shared(tip, slice(None))


def entries_by_tissue(tip: Fingertip) -> dict[str, int]:
    """Blocks of 3 x 3 entries in each tissue's matrix; K stores nine numbers a block, M three."""
    return {name: int(_shared(tip, tip.mesh.tissue == i).nnz) for i, name in enumerate(TISSUES)}


def _shared(tip: Fingertip, elements: slice | np.ndarray) -> sparse.csr_array:
    corners: Ints = tip.mesh.hexahedra[elements]
    element = np.repeat(np.arange(len(corners)), corners.shape[1])
    touches = sparse.csr_array((np.ones(corners.size, dtype=np.int32), (element, corners.ravel())),
                               shape=(len(corners), tip.mesh.n_nodes))
    free = tip.free_dofs[::3] // 3
    return sparse.csr_array((touches.T @ touches).tocsr()[free][:, free])
