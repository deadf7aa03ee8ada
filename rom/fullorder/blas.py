"""Threads of numpy's own BLAS, apart from the direct solver's."""

from __future__ import annotations

from contextlib import AbstractContextManager

from threadpoolctl import ThreadpoolController


def blas_threads(count: int) -> AbstractContextManager:
    """Context in which OpenBLAS and BLIS use ``count`` threads; oneMKL, hence the direct solver, keeps its own.

    Parameters
    ----------
    count : int
    """
    return ThreadpoolController().select(internal_api=["openblas", "blis"]).limit(limits=count)
