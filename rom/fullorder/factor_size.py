"""Size and cost of a sparse factor from the pattern alone: the symbolic phase, without the matrix's numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from rom.fullorder.pardiso import Pardiso, load_library

_ENTRIES, _OPERATIONS = 17, 18
"""Zero-based places in ``iparm`` where PARDISO reports them if they hold -1."""


class FactorSize(NamedTuple):
    """What L D L^T of a real matrix would take; a complex one has the same entries and four times the operations."""

    entries: int
    """Numbers stored in the factor."""
    flop: float
    """Floating-point operations of the numeric phase, to the next million."""


def factor_size(pattern: Any) -> FactorSize | None:
    """Symbolic analysis of a symmetric pattern.

    The ordering that a factorization finds also follows the matrix's values (scaling and matching), so its own factor
    may differ by some percent.

    Parameters
    ----------
    pattern : (n, n) scipy sparse matrix
        Nonzero where the matrix is; its values do not matter.

    Returns
    -------
    FactorSize or None
        None without oneMKL, as SuperLU has no symbolic phase of its own.
    """
    if load_library() is None:
        return None
    upper = sp.csr_array(sp.triu(sp.csr_array(pattern, dtype=np.float64)))
    upper.sort_indices()
    upper.data[:] = -1.0
    row = np.repeat(np.arange(upper.shape[0]), np.diff(upper.indptr))
    degree = np.bincount(row, minlength=len(upper.indptr) - 1) + np.bincount(upper.indices)
    upper.data[row == upper.indices] = degree  # dominant diagonal: nothing is matched away from it
    engine = Pardiso(upper.indptr.astype(np.int32), upper.indices.astype(np.int32), np.dtype(np.float64))
    engine.iparm[[_ENTRIES, _OPERATIONS]] = -1
    try:
        engine.analyse(upper.data)
        return FactorSize(int(engine.iparm[_ENTRIES]), 1e6 * float(engine.iparm[_OPERATIONS]))
    finally:
        engine.release()
