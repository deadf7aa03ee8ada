"""One browser's connection: its requests, each kind in a lane of its own where only the newest counts."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from rom.checks import shown
from rom.errors import RomError
from rom.interactive import wire
from rom.interactive.engine import Answer, Engine, check_finite
from rom.interactive.models import SOLVED
from rom.interactive.state import State, from_json, probe_node
from rom.interactive.worker import Job, Worker

log = logging.getLogger(__name__)
Send = Callable[[bytes], Awaitable[None]]


class Desk:
    """What all connections share: the engine, the solving process, threads that keep the event loop free.

    Parameters
    ----------
    engine : Engine
    """

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.worker = Worker()
        self.quick = ThreadPoolExecutor(1, thread_name_prefix="field")
        self.slow = ThreadPoolExecutor(1, thread_name_prefix="slow")
        self._one_residual = asyncio.Lock()
        self._matrices: asyncio.Future | None = None

    async def matrices(self) -> None:
        """Wait until the matrices that residuals need are there; the first call has them assembled."""
        if self._matrices is None:
            self._matrices = asyncio.ensure_future(self.run(self.slow, self.engine.assemble))
        await asyncio.shield(self._matrices)

    async def run(self, pool: ThreadPoolExecutor, call: Callable[..., Any], *arguments: Any) -> Any:
        """The outcome of a call in a thread of a pool."""
        return await asyncio.get_running_loop().run_in_executor(pool, call, *arguments)

    async def answer(self, state: State) -> Answer:
        """Answer a state by whatever method it names; cancelling ends a direct solve."""
        return await self._solved(state) if state.method in SOLVED else await self._quickly(state, self.engine.answer)

    async def picture(self, state: State) -> tuple[Answer, dict[str, Any], dict[str, np.ndarray]]:
        """The answer to a state, and what is shown of it."""
        if state.method not in SOLVED:
            return await self._quickly(state, self.engine.picture)
        answer = await self._solved(state)
        return answer, *await self.run(self.quick, self.engine.shown, state, answer)

    async def residual(self, state: State, answer: Answer) -> float:
        """The residual of an answer; one at a time, so that no picture waits for more than one."""
        await self.matrices()
        async with self._one_residual:
            return await self.run(self.quick, self.engine.residual, state, answer.values)

    async def _quickly(self, state: State, call: Callable[[State], Any]) -> Any:
        models = self.engine.models
        if not models.is_loaded(state.method, state.harmonic):  # seconds for a network: nobody else waits for it
            await self.run(self.slow, models.model, state.method, state.harmonic)
        return await self.run(self.quick, call, state)

    async def _solved(self, state: State) -> Answer:
        scene = self.engine.scene(state)
        job = Job(state.method, self.engine.models.settings_of(state.method, state.harmonic), scene.to_json(),
                  self.engine.cases(state, scene))
        values, seconds, doubt = await self.worker.solve(job)
        check_finite(values)
        if state.method == "direct":
            self.engine.time_direct(state, seconds)
        return Answer(values, seconds, validity=self.engine.validity(doubt))

    def close(self) -> None:
        """End threads and process."""
        self.worker.close()
        for pool in (self.quick, self.slow):
            pool.shutdown(wait=False, cancel_futures=True)


class Question:
    """One request: its work, and how it ended."""

    def __init__(self, request: dict[str, Any]) -> None:
        self.number, self.request = request["id"], request
        self.work: asyncio.Task | None = None
        self.solves = False
        """Whether it is solved directly: then it makes way for a newer one at once."""
        self.answered = False
        """Whether its answer is out; a field's residual may still follow."""
        self.ended_as = ""

    def end(self, word: str) -> None:
        """End the work, if it runs; once, since a second cancellation would only disturb what the first set going."""
        if self.work is not None and not self.ended_as:
            self.ended_as = word
            self.work.cancel()


class Lane:
    """Questions of one kind on one connection: one is worked on, and of those that come meanwhile the newest waits."""

    def __init__(self) -> None:
        self.task: asyncio.Task | None = None
        self.now: Question | None = None
        self.waiting: Question | None = None


class Connection:
    """Requests and replies of one browser.

    Parameters
    ----------
    desk : Desk
    send : async callable
        Takes the bytes of a reply.
    """

    def __init__(self, desk: Desk, send: Send) -> None:
        self.desk, self.engine, self._send = desk, desk.engine, send
        self._kinds: dict[str, Callable[[Question], Awaitable[None]]] = {
            "field": self._field, "cut": self._cut, "frf": self._frequency_response, "error": self._error,
            "hello": self._hello}
        self._lanes = {kind: Lane() for kind in self._kinds}

    async def take(self, text: str) -> None:
        """Take one message; replies follow."""
        try:
            request = wire.parse_request(text)
        except ValueError as error:
            await self._post({"id": None, "answer": "problem", "text": str(error)})
            return
        kind, question = request["ask"], Question(request)
        if kind == "cancel":
            await self._cancel(question)
        elif kind not in self._kinds:
            await self._problem(question, f"{shown(kind)} is nothing that can be asked for: ask for one of "
                                          f"{', '.join([*self._kinds, 'cancel'])}")
        else:
            await self._queue(self._lanes[kind], question)

    async def close(self) -> None:
        """End everything that still runs for this connection."""
        running = [lane.task for lane in self._lanes.values() if lane.task is not None]
        for task in running:
            task.cancel()
        await asyncio.gather(*running, return_exceptions=True)

    async def _queue(self, lane: Lane, question: Question) -> None:
        older, lane.waiting = lane.waiting, question
        if lane.task is None:
            lane.task = asyncio.create_task(self._run(lane))
        elif lane.now is not None and (lane.now.solves or lane.now.answered):
            lane.now.end("superseded")
        if older is not None:
            await self._answer(older, "superseded")

    async def _run(self, lane: Lane) -> None:
        """Answer the questions of a lane until none waits."""
        while lane.waiting is not None:
            lane.now, lane.waiting = lane.waiting, None
            async with asyncio.TaskGroup() as group:  # it waits for the work, and cancels it with this task
                lane.now.work = group.create_task(self._work(lane.now))
            if not lane.now.answered:
                await self._answer(lane.now, lane.now.ended_as)
        lane.task = lane.now = None

    async def _work(self, question: Question) -> None:
        try:
            await self._kinds[question.request["ask"]](question)
        except (RomError, ValueError) as error:
            await self._problem(question, str(error))
        except Exception:  # a fault of ours must not take the server down
            log.exception("a request could not be answered")
            await self._problem(question, "the server could not answer this: its log says why")

    async def _cancel(self, question: Question) -> None:
        for lane in self._lanes.values():
            if lane.waiting is not None and lane.waiting.number == question.number:
                waiting, lane.waiting = lane.waiting, None
                await self._answer(waiting, "cancelled")
                return
            if lane.now is not None and lane.now.number == question.number and not lane.now.answered:
                lane.now.end("cancelled")
                return
        await self._problem(question, f"nothing with the id {question.number} is under way: it may be done already")

    # ---- kinds ----------------------------------------------------------------------------------------------

    async def _hello(self, question: Question) -> None:
        await self._answer(question, "hello", *await self.desk.run(self.desk.quick, self.engine.hello))

    async def _field(self, question: Question) -> None:
        state = self._state(question)
        question.solves = state.method in SOLVED
        answer, *found = await self.desk.picture(state)
        question.solves = False
        await self._answer(question, "field", *found)
        if self._lanes["field"].waiting is None:  # a newer picture matters more than this one's residual
            await self._answer(question, "indicators", {"residual": await self.desk.residual(state, answer)})

    async def _cut(self, question: Question) -> None:
        found = await self.desk.run(self.desk.slow, self.engine.cut, self._state(question))
        await self._answer(question, "cut", *found)

    async def _frequency_response(self, question: Question) -> None:
        state = self._state(question)
        node = probe_node(question.request.get("node"), self.engine.limits)
        if node is None:
            node = state.forces[0][0] if state.probe is None else state.probe
        found = await self.desk.run(self.desk.quick, self.engine.frequency_response, state, node)
        await self._answer(question, "frf", *found)

    async def _error(self, question: Question) -> None:
        state = self._state(question)
        question.solves = True
        answer = await self.desk.answer(state)
        if state.method == "direct":
            found, seconds = 0.0, answer.seconds
        else:
            truth = await self.desk.answer(replace(state, method="direct"))
            found, seconds = relative_error(answer.values, truth.values), truth.seconds
        await self._answer(question, "error", {
            "error": found, "method": state.method, "seconds": answer.seconds, "direct_seconds": seconds,
            "speedup": self.engine.speedup(state, answer.seconds)})

    def _state(self, question: Question) -> State:
        return from_json(question.request.get("state", {}), self.engine.limits)

    async def _problem(self, question: Question, text: str) -> None:
        await self._answer(question, "problem", {"text": " ".join(text.split())})

    async def _answer(self, question: Question, answer: str, header: Mapping[str, Any] | None = None,
                      arrays: Mapping[str, np.ndarray] | None = None) -> None:
        question.answered = True
        await self._post({"id": question.number, "answer": answer, **(header or {})}, arrays)

    async def _post(self, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray] | None = None) -> None:
        with contextlib.suppress(ConnectionError):  # nobody is there to be told
            await self._send(wire.encode(header, arrays))


def relative_error(values: np.ndarray, truth: np.ndarray) -> float:
    """``||values - truth|| / ||truth||`` over all free degrees of freedom."""
    return float(np.linalg.norm(values - truth) / np.linalg.norm(truth))
