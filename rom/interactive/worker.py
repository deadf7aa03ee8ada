"""Direct solves in a process of their own, so that they freeze nothing and can be ended by killing it.

One process serves all connections, one job at a time, in the order in which they were asked for. It starts with the
first job; after it was killed, the next job starts another.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
import threading
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
from rom.scenes.fingertip_scene import fingertip_of

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
        self._turn = asyncio.Lock()
        self._process = _Process()
        self._threads = ThreadPoolExecutor(1, thread_name_prefix="worker")

    @property
    def process_id(self) -> int | None:
        """Of the running process; None where there is none."""
        return self._process.process_id

    async def solve(self, job: Job) -> Solution:
        """The solution of a job's case.

        While it lasts, the process belongs to the task that awaits this; cancelling that task ends the process, and
        whoever comes next gets another.

        Raises
        ------
        SolverError
            Where there is no answer, or the process died.
        """
        async with self._turn:
            try:
                found = await asyncio.get_running_loop().run_in_executor(self._threads, self._process.ask, job)
            except BaseException as error:
                self._drop()  # awaits nothing, so that no second cancellation can interrupt it
                if isinstance(error, (EOFError, OSError)):
                    raise SolverError("the process that solves directly has ended: ask again, it starts anew"
                                      ) from error
                raise
        if isinstance(found, str):
            raise SolverError(found)
        return found

    def close(self) -> None:
        """End the process and wait until it is gone."""
        self._drop()
        self._threads.shutdown()

    def _drop(self) -> None:
        process, self._process = self._process, _Process()
        process.end()
        self._threads.submit(process.reap)  # after the question that it leaves open, before the next one's


class _Process:
    """One process and its pipe: asked by one thread at a time, ended from any."""

    def __init__(self) -> None:
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._ended = False
        self._starting = threading.Lock()

    @property
    def process_id(self) -> int | None:
        return None if self._process is None else self._process.pid

    def ask(self, job: Job) -> Any:
        """What `_solve` finds; EOFError or OSError where the process is not, or no longer, there."""
        with self._starting:
            if self._ended:
                raise EOFError
            if self._pipe is None:
                context = multiprocessing.get_context("spawn")
                self._pipe, theirs = context.Pipe()
                process = context.Process(target=_serve, args=(theirs,), name="rom-direct", daemon=True)
                process.start()
                theirs.close()
                self._process = process
        self._pipe.send(job)
        return self._pipe.recv()

    def end(self) -> None:
        """Kill it, whatever it does; it is never asked again."""
        with self._starting:
            self._ended = True
            if self._process is not None:
                self._process.kill()

    def reap(self) -> None:
        """Leave nothing of an ended process behind."""
        if self._process is not None:
            self._process.join(PATIENCE)
        if self._pipe is not None:
            self._pipe.close()


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
        tip = tips.setdefault(scene.content_hash, fingertip_of(scene))
        models[key] = create(job.method, get_scene(scene.name, tip), **job.settings).fit()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        start = time.perf_counter()
        values = models[key].evaluate(job.cases, "field")[0]
        seconds = time.perf_counter() - start
    doubts = dict.fromkeys(" ".join(str(one.message).split()) for one in caught
                           if issubclass(one.category, IllConditionedWarning))
    return Solution(values, seconds, "; ".join(doubts))
