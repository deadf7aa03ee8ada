"""One browser's connection: its requests, each kind in a lane of its own where only the newest counts."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

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
        engine = self.engine
        if state.method in SOLVED:
            return await self._solved(state)
        if not engine.models.is_loaded(state.method, state.harmonic):  # seconds for a network: nobody waits for it
            await self.run(self.slow, engine.models.model, state.method, state.harmonic)
        return await self.run(self.quick, engine.answer, state)

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


class Lane:
    """Requests of one kind on one connection: one runs, and the newest that came meanwhile waits."""

    def __init__(self) -> None:
        self.running: asyncio.Task | None = None
        self.number: int | None = None
        """Of the request that runs."""
        self.can_be_ended = False
        """Whether what runs is solved directly: then it makes way for a newer request at once."""
        self.answered = False
        """Whether what runs only adds to an answer that is out already."""
        self.ended_as = "superseded"
        self.waiting: dict[str, Any] | None = None


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
        self._kinds: dict[str, Callable[[int, dict[str, Any]], Awaitable[None]]] = {
            "field": self._field, "cut": self._cut, "frf": self._frequency_response, "error": self._error,
            "hello": self._hello}
        self._lanes = {kind: Lane() for kind in self._kinds}
        self._closed = False

    async def take(self, text: str) -> None:
        """Take one message; returns at once, replies follow."""
        try:
            request = wire.parse_request(text)
        except ValueError as error:
            await self._problem(None, str(error))
            return
        number, kind = request["id"], request["ask"]
        if kind == "cancel":
            await self._cancel(number)
        elif kind not in self._kinds:
            shown = kind if len(kind) <= 40 else f"{kind[:37]}..."
            await self._problem(number, f"{shown!r} is nothing that can be asked for: ask for one of "
                                        f"{', '.join([*self._kinds, 'cancel'])}")
        else:
            await self._queue(self._lanes[kind], request)

    async def close(self) -> None:
        """End everything that still runs for this connection."""
        self._closed = True
        running = [lane.running for lane in self._lanes.values() if lane.running is not None]
        for task in running:
            task.cancel()
        await asyncio.gather(*running, return_exceptions=True)

    async def _queue(self, lane: Lane, request: dict[str, Any]) -> None:
        if lane.running is None:
            self._start(lane, request)
            await asyncio.sleep(0)  # it begins before it can be cancelled, and so always replies
            return
        older, lane.waiting = lane.waiting, request
        if lane.can_be_ended or lane.answered:
            lane.ended_as = "superseded"
            lane.running.cancel()
        if older is not None:
            await self._post({"id": older["id"], "answer": "superseded"})

    def _start(self, lane: Lane, request: dict[str, Any]) -> None:
        lane.number, lane.can_be_ended, lane.answered = request["id"], False, False
        lane.running = asyncio.create_task(self._reply(lane, request))
        lane.running.add_done_callback(lambda _: self._next(lane))

    def _next(self, lane: Lane) -> None:
        request, lane.running, lane.waiting = lane.waiting, None, None
        if request is not None and not self._closed:
            self._start(lane, request)

    async def _cancel(self, number: int) -> None:
        for lane in self._lanes.values():
            if lane.waiting is not None and lane.waiting["id"] == number:
                lane.waiting = None
                await self._post({"id": number, "answer": "cancelled"})
                return
            if lane.running is not None and lane.number == number and not lane.answered:
                lane.ended_as = "cancelled"
                lane.running.cancel()
                return
        await self._problem(number, f"nothing with the id {number} is under way: it may be done already")

    async def _reply(self, lane: Lane, request: dict[str, Any]) -> None:
        number = request["id"]
        try:
            await self._kinds[request["ask"]](number, request)
        except asyncio.CancelledError:
            if self._closed:  # nobody is there to be told
                raise
            if not lane.answered:
                await self._post({"id": number, "answer": lane.ended_as})
        except (RomError, ValueError) as error:
            await self._problem(number, str(error))
        except ConnectionError:
            pass
        except Exception:  # a fault of ours must not take the server down
            log.exception("a request could not be answered")
            await self._problem(number, "the server could not answer this: its log says why")

    # ---- kinds ----------------------------------------------------------------------------------------------

    async def _hello(self, number: int, _: dict[str, Any]) -> None:
        header, arrays = await self.desk.run(self.desk.quick, self.engine.hello)
        await self._post({"id": number, "answer": "hello", **header}, arrays)

    async def _field(self, number: int, request: dict[str, Any]) -> None:
        state = self._state(request)
        lane = self._lanes["field"]
        lane.can_be_ended = state.method in SOLVED
        answer = await self.desk.answer(state)
        lane.can_be_ended = False
        header, arrays = await self.desk.run(self.desk.quick, self.engine.shown, state, answer)
        await self._post({"id": number, "answer": "field", **header}, arrays)
        lane.answered = True  # a newer picture matters more than this one's residual
        if lane.waiting is not None:
            return
        await self.desk.matrices()
        residual = await self.desk.run(self.desk.quick, self.engine.residual, state, answer.values)
        await self._post({"id": number, "answer": "indicators", "residual": residual})

    async def _cut(self, number: int, request: dict[str, Any]) -> None:
        header, arrays = await self.desk.run(self.desk.slow, self.engine.cut, self._state(request))
        await self._post({"id": number, "answer": "cut", **header}, arrays)

    async def _frequency_response(self, number: int, request: dict[str, Any]) -> None:
        state = self._state(request)
        node = probe_node(request.get("node"), self.engine.limits)
        if node is None:
            node = state.forces[0][0] if state.probe is None else state.probe
        header, arrays = await self.desk.run(self.desk.quick, self.engine.frequency_response, state, node)
        await self._post({"id": number, "answer": "frf", **header}, arrays)

    async def _error(self, number: int, request: dict[str, Any]) -> None:
        state = self._state(request)
        self._lanes["error"].can_be_ended = True
        answer = await self.desk.answer(state)
        if state.method == "direct":
            found, seconds = 0.0, answer.seconds
        else:
            truth = await self.desk.answer(replace(state, method="direct"))
            found, seconds = relative_error(answer.values, truth.values), truth.seconds
        await self._post({"id": number, "answer": "error", "error": found, "method": state.method,
                          "seconds": answer.seconds, "direct_seconds": seconds,
                          "speedup": self.engine.speedup(state, answer.seconds)})

    def _state(self, request: dict[str, Any]) -> State:
        return from_json(request.get("state", {}), self.engine.limits)

    async def _problem(self, number: int | None, text: str) -> None:
        await self._post({"id": number, "answer": "problem", "text": " ".join(text.split())})

    async def _post(self, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray] | None = None) -> None:
        await self._send(wire.encode(header, arrays))


def relative_error(values: np.ndarray, truth: np.ndarray) -> float:
    """``||values - truth|| / ||truth||`` over all free degrees of freedom."""
    return float(np.linalg.norm(values - truth) / np.linalg.norm(truth))
