"""Direct solves in a process of their own, so that they freeze nothing and can be ended by killing it.

One process serves all connections, one job at a time, in the order in which they were asked for. It starts with the
first job; after it was killed, the next job starts another.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple

import numpy as np

from rom.errors import SolverError
from rom.fingertip import Fingertip
from rom.fullorder import IllConditionedWarning
from rom.scenes import CaseArrays, scene_from_json

PATIENCE = 5.0
"""Seconds that a killed process gets to vanish."""


@dataclass(frozen=True, eq=False)
class Job:
    """One case for one method.

    Parameters
    ----------
    method : str
    settings : dict
    scene : str
        As :meth:`rom.scenes.Scene.to_json` writes it.
    cases : CaseArrays
    """

    method: str
    settings: dict[str, Any]
    scene: str
    cases: CaseArrays


class Solution(NamedTuple):
    """Values (n_free,) [m], the wall time of the solve alone [s], and why they may be wrong (or nothing)."""

    values: np.ndarray
    seconds: float
    doubt: str


class Worker:
    """The process and the queue before it; used from one event loop."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._turn = asyncio.Lock()
        self._ending = False
        self._waiting = ThreadPoolExecutor(1, thread_name_prefix="worker")

    @property
    def process_id(self) -> int | None:
        """Of the running process; None where there is none."""
        return None if self._process is None else self._process.pid

    async def solve(self, job: Job) -> Solution:
        """The solution of a job's case.

        Cancelling the task that awaits this ends the solve at once.

        Raises
        ------
        SolverError
            Where there is no answer, or the process died.
        """
        async with self._turn:
            self._ending = False
            asked = asyncio.get_running_loop().run_in_executor(self._waiting, self._ask, job)
            try:
                found = await asyncio.shield(asked)
            except asyncio.CancelledError:
                self._kill()
                await asyncio.wait([asked])
                asked.exception()  # seen, and of no interest
                self._forget()
                raise
            except (EOFError, OSError) as error:
                self._kill()
                self._forget()
                raise SolverError("the process that solves directly has ended: ask again, it starts anew") from error
        if isinstance(found, str):
            raise SolverError(found)
        return found

    def close(self) -> None:
        """End the process."""
        self._kill()
        self._forget()
        self._waiting.shutdown(wait=False, cancel_futures=True)

    def _ask(self, job: Job) -> Any:
        if self._process is None or not self._process.is_alive():
            self._start()
        pipe = self._pipe
        if pipe is None or self._ending:  # ended while it was starting
            self._kill()
            raise EOFError
        pipe.send(job)
        return pipe.recv()

    def _start(self) -> None:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(theirs,), name="rom-direct", daemon=True)
        self._pipe, self._process = ours, process
        process.start()
        theirs.close()

    def _kill(self) -> None:
        self._ending = True
        if self._process is not None and self._process.pid is not None:
            self._process.kill()

    def _forget(self) -> None:
        process, pipe, self._process, self._pipe = self._process, self._pipe, None, None
        if process is not None and process.pid is not None:
            process.join(PATIENCE)
        if pipe is not None:
            pipe.close()


def _serve(pipe: Connection) -> None:
    """What the process does: answer jobs until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the server's to handle
    models: dict[tuple[str, str], Any] = {}
    tips: dict[str, Fingertip] = {}
    while True:
        try:
            job = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            found: Any = _solve(job, models, tips)
        except Exception as error:  # whatever it is, the asker gets one sentence and the process lives on
            found = " ".join(str(error).split()) or type(error).__name__
        try:
            pipe.send(found)
        except (BrokenPipeError, OSError):
            return


def _solve(job: Job, models: dict[tuple[str, str], Any], tips: dict[str, Fingertip]) -> Solution:
    from rom.metamodels import create
    from rom.scenes import get_scene

    key = (job.method, job.scene)
    if key not in models:
        scene = scene_from_json(job.scene)
        # both scenes share one fingertip and its matrices
        tip = tips.setdefault(scene.fingertip.content_hash, scene.fingertip)
        models[key] = create(job.method, get_scene(scene.name, tip), **job.settings).fit()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        start = time.perf_counter()
        values = models[key].evaluate(job.cases, "field")[0]
        seconds = time.perf_counter() - start
    doubts = dict.fromkeys(" ".join(str(one.message).split()) for one in caught
                           if issubclass(one.category, IllConditionedWarning))
    return Solution(values, seconds, "; ".join(doubts))
