"""Clocks that a sceptic accepts: wall time, one protocol for slow and fast, methods interleaved, every call kept.

A round asks every method in turn. A method's first call in a round comes after all others have run and finds nothing
of its own in the processor's caches; the calls that follow at once find them warm, as a running application would. Each
call gets another case, so that no method answers from what an earlier call left. Nothing is averaged: medians are the
reader's.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
from threadpoolctl import threadpool_info

from rom.fullorder import get_threads

BUDGET = 8.0
"""Seconds after which a method gets no further round, once it had LEAST_ROUNDS."""
LEAST_ROUNDS = 3
Call = Callable[[int], object]


def interleaved(calls: Mapping[str, Sequence[Call]], rounds: int, *, budget: float = BUDGET,
                least: int = LEAST_ROUNDS, progress: Callable = iter) -> dict[str, np.ndarray]:
    """Wall time of each call in each round.

    Parameters
    ----------
    calls : mapping of name to functions of a running number
        Made one after another in each round; the number differs from call to call.
    rounds : int
    budget : float [s]
        What slow calls may take together before a method is left out of the rounds that follow.
    least : int
        Rounds that every method has.
    progress : callable
        Wraps the iteration over rounds, to show a bar.

    Returns
    -------
    dict of (n_call, rounds) ndarray [s]
        NaN where a slow method had fewer rounds.
    """
    seconds = {name: np.full((len(mine), rounds), np.nan) for name, mine in calls.items()}
    for i in progress(range(rounds)):
        for name, mine in calls.items():
            if i < least or np.nansum(seconds[name]) < budget:
                for k, call in enumerate(mine):
                    seconds[name][k, i] = clocked(call, i * len(mine) + k)
    return seconds


def clocked(call: Call, number: int = 0) -> float:
    """Wall time of one call [s]."""
    start = time.perf_counter_ns()
    call(number)
    return (time.perf_counter_ns() - start) * 1e-9


def memory_bandwidth(n_bytes: int = 4_000_000, repeats: int = 50) -> float:
    """Bytes a second at which a matrix of ``n_bytes`` is read by a vector-matrix product [byte/s]."""
    rng = np.random.default_rng(0)
    rows = max(1, n_bytes // (4 * 20_000))
    matrix = rng.standard_normal((rows, 20_000), dtype=np.float32)
    vector = rng.standard_normal(rows, dtype=np.float32)
    return matrix.nbytes / _best(lambda _: vector @ matrix, repeats)


@cache
def product_rate(kind: str = "float32", repeats: int = 10) -> float:
    """Operations a second of a large matrix product, measured once in a process [1/s]."""
    rng = np.random.default_rng(0)
    a = rng.standard_normal((512, 512)).astype(kind)
    b = rng.standard_normal((512, 4096)).astype(kind)
    return 2.0 * a.shape[0] * a.shape[1] * b.shape[1] / _best(lambda _: a @ b, repeats)


def _best(call: Call, repeats: int) -> float:
    call(0)
    return min(clocked(call) for _ in range(repeats))


def threads_in_use() -> str:
    """Threads of each numerical library that is loaded."""
    pools = sorted({f"{pool['internal_api']} {pool['num_threads']}" for pool in threadpool_info()})
    return ", ".join([f"direct solver {get_threads()}", *pools])
