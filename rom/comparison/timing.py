"""Clocks that a sceptic accepts: wall time, warm-up, methods interleaved, raw repeats kept, floors measured.

Each repeat asks every method for the same held-out case, and each repeat another case, so that no method answers from a
cache that real use would not have warmed, and drift of the machine hits all alike.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np
from threadpoolctl import threadpool_info

from rom.fullorder import get_threads


def interleaved(calls: Mapping[str, Callable[[int], object]], repeats: int, warm_up: int = 2,
                progress: Callable = iter) -> dict[str, np.ndarray]:
    """Wall time of each call at each repeat.

    Parameters
    ----------
    calls : mapping of name to function of the repeat's number
    repeats, warm_up : int

    Returns
    -------
    dict of (repeats,) ndarray [s]
    """
    seconds = {name: np.empty(repeats) for name in calls}
    for i in progress(range(-warm_up, repeats)):
        for name, call in calls.items():
            elapsed = _clock(call, i % repeats)
            if elapsed < QUICK:
                # the first call brought the method's own data back into the processor's cache, as a running
                # application would have them there; the median of some more, each on another case, is kept
                elapsed = float(np.median([_clock(call, (i + k) % repeats) for k in range(1, 6)]))
            if i >= 0:
                seconds[name][i] = elapsed
    return seconds


QUICK = 0.02
"""Calls quicker than this [s] are repeated within a repeat: a busy machine stalls them for longer than they take."""


def _clock(call: Callable[[int], object], i: int) -> float:
    start = time.perf_counter_ns()
    call(i)
    return (time.perf_counter_ns() - start) * 1e-9


def memory_bandwidth(n_bytes: int = 4_000_000, repeats: int = 50) -> float:
    """Bytes a second at which a matrix of ``n_bytes`` is read by a vector-matrix product [byte/s]."""
    rng = np.random.default_rng(0)
    rows = max(1, n_bytes // (4 * 20_000))
    matrix = rng.standard_normal((rows, 20_000), dtype=np.float32)
    vector = rng.standard_normal(rows, dtype=np.float32)
    return matrix.nbytes / _best(lambda: vector @ matrix, repeats)


def product_rate(kind: str = "float32", repeats: int = 10) -> float:
    """Operations a second of a large matrix product [1/s]."""
    rng = np.random.default_rng(0)
    a = rng.standard_normal((512, 512)).astype(kind)
    b = rng.standard_normal((512, 4096)).astype(kind)
    return 2.0 * a.shape[0] * a.shape[1] * b.shape[1] / _best(lambda: a @ b, repeats)


def _best(call: Callable[[], object], repeats: int) -> float:
    call()
    best = np.inf
    for _ in range(repeats):
        start = time.perf_counter_ns()
        call()
        best = min(best, (time.perf_counter_ns() - start) * 1e-9)
    return best


def threads_in_use() -> str:
    """Threads of each numerical library that is loaded."""
    pools = sorted({f"{pool['internal_api']} {pool['num_threads']}" for pool in threadpool_info()})
    return ", ".join([f"direct solver {get_threads()}", *pools])
