"""Attacks `rom serve` in every way that one machine's browsers and scripts can, and says what gave way.

Usage: python experiments/attack_server.py [--messages 100000] [--solves 100] [--moves 100] [--seed 0] [--quick]

Socket messages, well-formed and not, in bursts: each that can be read must be answered, in one sentence where it is
refused, and the server must not grow. Pages drag, half of them on a direct method, which ends a solve at every step,
while one solves directly. Many pages drag at once: how long until the picture is there. Requests that are no HTTP,
idle connections, also where few files may be open, and downloads that nobody waits for.
"""

from __future__ import annotations

import argparse
import asyncio
import collections
import contextlib
import json
import os
import random
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import aiohttp
import numpy as np

from rom.interactive import wire

PATIENCE = 120.0
"""Seconds after which an answer is missing."""
PAGES, SOCKETS, CROWD = 8, 8, 32
STEP = 0.1
"""Seconds between two moves of a slider."""
FEW_FILES = 80
"""What a process may open where little is allowed: some 40 are the interpreter's and the libraries' own."""
MODAL = ("modal-krylov", "modal-static", "modal")
VALUES = (None, True, -1, 0, 1e308, 1e-320, float("nan"), float("inf"), 10**40, "", "x" * 300, "\ud800", "../../etc",
          "<script>", [], [[]], {}, [[0, 0.1]], [[1e9, 0.1]], ["x", 3], ["w", 3], ["x", "nan"], "NaN", "-0")
REQUESTS = (
    b"", b"\r\n\r\n", b"GET\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00", b"GET / HTTP/9.9\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nHost: evil\r\n\r\n", b"GET / HTTP/1.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1/evil\r\n\r\n", b"GET / HTTP/1.1\r\nHost: evil.com@127.0.0.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: -1\r\n\r\n", b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"y" * 100_000 + b"\r\n\r\n", b"GET /" + b"a" * 100_000,
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
    b"GET /socket HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n",
    b"GET http://evil.com/ HTTP/1.1\r\nHost: evil.com\r\n\r\n", b"GET /%00%ff/../../etc/passwd HTTP/1.1\r\n\r\n")


class Server(NamedTuple):
    """A running `rom serve`, and where its log goes."""

    address: str
    process: subprocess.Popen
    log: Path
    seconds: float

    @property
    def socket(self) -> str:
        return f"{self.address}socket"

    @property
    def memory(self) -> float:
        """Bytes that it holds; NaN where the system does not say."""
        status = Path(f"/proc/{self.process.pid}/status")
        found = re.search(r"VmRSS:\s+(\d+) kB", status.read_text()) if status.exists() else None
        return 1024.0 * int(found[1]) if found else float("nan")


@contextlib.contextmanager
def served(quick: bool, files: int | None = None) -> Iterator[Server]:
    """A server of its own process, which may have so many files open."""
    command = [sys.executable, "-m", "rom.cli", "serve", "--port", "0", *(["--quick"] if quick else [])]
    if files is not None:
        command = ["sh", "-c", f"ulimit -n {files}; exec {shlex.join(command)}"]
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, open(Path(folder) / "log", "wb") as log:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True,
                                   env={**os.environ, "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"})
        try:
            found = re.search(r"http://\S+/", process.stdout.readline())  # type: ignore[union-attr]
            yield Server(found[0], process, Path(log.name), time.perf_counter() - begin)  # type: ignore[index]
        finally:
            process.terminate()
            process.communicate()


# ---- messages -----------------------------------------------------------------------------------------------

def message(chance: random.Random, number: int, nodes: list[int]) -> str:
    """One message: an honest one, one with a strange value, or text that was damaged."""
    state = {"forces": [[node, 0.1] for node in chance.sample(nodes, chance.randint(1, 3))],
             "frequency": chance.choice((0, chance.uniform(0, 300))), "loss_factor": chance.random(),
             "method": chance.choice(MODAL), "quantity": chance.choice(("magnitude", "normal", "phase", "strain"))}
    if chance.random() < 0.2:
        state["cut"] = ["x", chance.choice((5.0, 10.0, 14.5))]
    if chance.random() < 0.01:
        state["method"] = "direct"
    kind = chance.choices(("field", "cancel", "frf", "cut", "hello", "error"), (60, 20, 10, 6, 2, 1))[0]
    record: dict[str, Any] = {"id": number, "ask": kind, "state": state}
    if kind == "cancel":
        record = {"id": max(0, number - chance.randint(1, 4)), "ask": kind}
    fate = chance.random()
    if fate < 0.15:
        target = chance.choice((record, state))
        target[chance.choice((*target, "node", "__class__"))] = chance.choice(VALUES)
    text = json.dumps(record)
    if fate > 0.9:
        at = chance.randrange(len(text))
        text = chance.choice((text[:at], text[at:], text[:at] + chance.choice('[]{}",:\x00\ufffd9') + text[at + 1:],
                              "[" * chance.randrange(9000), text * chance.randint(2, 20)))
    return text


async def converse(server: Server, count: int, seed: int) -> collections.Counter:
    """Send messages in bursts on one socket; what was answered, and under ``wrong`` what should not have been."""
    chance, found, number = random.Random(seed), collections.Counter(), 0
    async with aiohttp.ClientSession() as session:
        while number < count:
            async with session.ws_connect(server.socket, max_msg_size=0) as socket:
                await socket.send_str('{"id": 0, "ask": "hello"}')
                header, arrays = wire.decode((await socket.receive(PATIENCE)).data)
                nodes = arrays["vertex_node"][arrays["pad_vertex"]].tolist()
                while number < count:
                    expected: collections.Counter = collections.Counter()
                    for _ in range(chance.randint(1, 30)):
                        number += 1
                        text = message(chance, number, nodes)
                        if len(text.encode()) > wire.LARGEST_REQUEST:
                            found["too long"] += 1
                            continue
                        try:
                            request = wire.parse_request(text)
                            expected[request["id"]] += request["ask"] != "cancel"
                        except ValueError:
                            expected[None] += 1
                        await socket.send_str(text)
                    while any(expected.values()):
                        reply = await socket.receive(PATIENCE)
                        if reply.type is not aiohttp.WSMsgType.BINARY:
                            found["wrong: closed"] += 1
                            break
                        header, _ = wire.decode(reply.data)
                        kind = header["answer"]
                        found[kind] += 1
                        if kind == "problem" and ("log says why" in header["text"] or len(header["text"]) > 500):
                            found[f"wrong: {header['text'][:80]}"] += 1
                        if kind != "indicators" and expected[header["id"]] > 0:
                            expected[header["id"]] -= 1
                    if socket.closed:
                        break
                    if chance.random() < 0.02:  # leave in the middle, by the wrong door at times
                        if chance.random() < 0.5:
                            await socket.send_bytes(b"\x00")
                        await socket.send_str('{"id": 1, "ask": "field", "state": {"method": "direct"}}')
                        break
    return found


async def messages(server: Server, count: int, seed: int) -> tuple[collections.Counter, list[float]]:
    """Converse on several sockets, a tenth at a time; counts of answers, and the server's memory after each."""
    found, memory = collections.Counter(), []
    for part in range(10):
        each = await asyncio.gather(*(converse(server, count // 10 // SOCKETS, 1000 * seed + SOCKETS * part + i)
                                      for i in range(SOCKETS)))
        found += sum(each, collections.Counter())
        memory.append(server.memory)
    return found, memory


# ---- pages --------------------------------------------------------------------------------------------------

async def drag(server: Server, method: str, moves: int, seed: int, step: float = STEP) -> tuple[list[float], list[str]]:
    """One page's slider: seconds from each move to its picture, where it was not overtaken; and what went wrong."""
    chance, sent, seconds, wrong = random.Random(seed), {}, [], []
    async with aiohttp.ClientSession() as session, session.ws_connect(server.socket, max_msg_size=0) as socket:

        async def read() -> None:
            async for reply in socket:
                header = wire.decode(reply.data)[0]
                if header["answer"] == "indicators":
                    continue
                begin = sent.pop(header["id"])
                if header["answer"] == "field":
                    seconds.append(time.perf_counter() - begin)
                elif header["answer"] != "superseded":
                    wrong.append(str(header))

        reading = asyncio.create_task(read())
        await asyncio.sleep(chance.random() * step)
        start = time.perf_counter()
        for move in range(moves):
            sent[move] = time.perf_counter()
            state = {"frequency": 50.0 + move % 200, "method": method}
            await socket.send_str(json.dumps({"id": move, "ask": "field", "state": state}))
            await asyncio.sleep(max(0.0, start + (move + 1) * step - time.perf_counter()))
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(PATIENCE):
                while sent and not reading.done():
                    await asyncio.sleep(0.01)
        reading.cancel()
        wrong += [f"no answer to move {move}" for move in sent]
        with contextlib.suppress(asyncio.CancelledError):
            await reading
    return seconds, wrong


async def solve(server: Server, count: int, method: str = "direct") -> tuple[list[float], list[str]]:
    """Fields of a direct method one after the other: seconds of each, and what was answered instead."""
    seconds, wrong = [], []
    async with aiohttp.ClientSession() as session, session.ws_connect(server.socket, max_msg_size=0) as socket:
        for number in range(count):
            begin = time.perf_counter()
            state = {"frequency": 60.0 + number, "method": method}
            await socket.send_str(json.dumps({"id": number, "ask": "field", "state": state}))
            while True:
                header = wire.decode((await socket.receive(PATIENCE)).data)[0]
                if header["id"] == number and header["answer"] != "indicators":
                    break
            seconds.append(time.perf_counter() - begin)
            if header["answer"] != "field":
                wrong.append(str(header))
    return seconds, wrong


async def drag_beside(server: Server, solves: int, seed: int) -> tuple[int, list[str]]:
    """Pages drag, half of them on a direct method, while one solves directly: its solves, and all that went wrong."""
    solving = asyncio.create_task(solve(server, solves))
    wrong: list[str] = []

    async def page(i: int) -> None:
        while not solving.done():
            wrong.extend((await drag(server, "direct" if i % 2 else MODAL[0], 30, seed + i, 0.05))[1])

    await asyncio.gather(*(page(i) for i in range(PAGES)))
    seconds, mine = solving.result()
    return len(seconds), mine + wrong


async def crowd(server: Server, method: str, moves: int, seed: int) -> tuple[np.ndarray, list[str]]:
    """As many pages as are let in drag at once: seconds to their pictures."""
    found = await asyncio.gather(*(drag(server, method, moves, seed + i) for i in range(CROWD)))
    return np.concatenate([seconds for seconds, _ in found]), [text for _, wrong in found for text in wrong]


# ---- connections --------------------------------------------------------------------------------------------

async def request(server: Server, text: bytes, wait: float = 1.0) -> bytes:
    """What comes back for some bytes until the server closes or nothing more comes."""
    host, port = re.search(r"//([^:/]+):(\d+)", server.address).groups()  # type: ignore[union-attr]
    reader, writer = await asyncio.open_connection(host, int(port))
    answer = b""
    with contextlib.suppress(TimeoutError, ConnectionError):
        writer.write(text)
        async with asyncio.timeout(wait):
            while part := await reader.read(65536):
                answer += part
    writer.close()
    return answer


def complaint(answer: bytes) -> str:
    """What is wrong with an answer to a request that is none; nothing where it is short and bears the headers."""
    head, _, body = answer.partition(b"\r\n\r\n")
    if not answer:
        return ""
    if not re.match(rb"HTTP/1\.[01] (200|4\d\d) ", head):
        return f"status: {head[:60]!r}"
    if b" 200 " not in head[:20] and len(body) > 300:
        return f"long: {body[:60]!r}"
    missing = [name for name in (b"Content-Security-Policy", b"X-Content-Type-Options", b"X-Frame-Options")
               if name not in head]
    return f"without {missing[0].decode()}" if missing else ""


async def unreadable(server: Server, count: int, seed: int) -> list[str]:
    """Requests that are no HTTP, and HTTP that was damaged: what is wrong with the answers."""
    chance = random.Random(seed)
    texts = list(REQUESTS)
    while len(texts) < count:
        text = bytearray(b"GET /page/main.js HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: http://127.0.0.1\r\n\r\n")
        for _ in range(chance.randint(1, 4)):
            text[chance.randrange(len(text))] = chance.randrange(256)
        texts.append(bytes(text))
    wrong = []
    for first in range(0, len(texts), 20):
        part = texts[first:first + 20]
        for text, answer in zip(part, await asyncio.gather(*(request(server, text) for text in part)), strict=True):
            if complaint(answer):
                wrong.append(f"{text[:60]!r}: {complaint(answer)}")
    return wrong


async def open_page(server: Server) -> float:
    """Seconds until the page itself is there."""
    begin = time.perf_counter()
    async with aiohttp.ClientSession() as session, session.get(server.address) as response:
        assert response.status == 200
        await response.read()
    return time.perf_counter() - begin


async def idle(server: Server, count: int) -> float:
    """Seconds until a page is there while so many connections say nothing, or half a request."""
    host, port = re.search(r"//([^:/]+):(\d+)", server.address).groups()  # type: ignore[union-attr]
    writers = []
    for i in range(count):
        writers.append((await asyncio.open_connection(host, int(port)))[1])
        if i % 2:
            writers[-1].write(b"GET / HTTP/1.1\r\nHost: 127.0")
    found = await open_page(server)
    for writer in writers:
        writer.close()
    return found


async def abandon(server: Server, count: int) -> float:
    """Seconds of the next direct solve after downloads that nobody waited for."""
    async with aiohttp.ClientSession() as session:

        async def download(i: int) -> None:
            with contextlib.suppress(TimeoutError, aiohttp.ClientError):
                async with asyncio.timeout(0.3), session.get(
                        f"{server.address}save/field.vtu?method=direct&f={i + 1}") as response:
                    await response.read()

        await asyncio.gather(*(download(i) for i in range(count)))
    return (await solve(server, 1))[0][0]


# ---- all of it ----------------------------------------------------------------------------------------------

def main() -> int:
    parser = argparse.ArgumentParser(description="What gives way when rom serve is attacked?")
    parser.add_argument("--messages", type=int, default=100_000)
    parser.add_argument("--solves", type=int, default=100, help="direct solves while pages drag")
    parser.add_argument("--moves", type=int, default=100, help="moves of each page's slider in a crowd")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="coarse mesh")
    arguments = parser.parse_args()
    wrong: list[str] = []

    def say(text: str, found: list[str]) -> None:
        print(f"{text}: {len(found)} wrong", *found[:5], sep="\n  ", flush=True)
        wrong.extend(found)

    async def attack(server: Server) -> None:
        first, _ = await solve(server, 1)
        alone = (await drag(server, MODAL[0], arguments.moves, arguments.seed))[0]
        print(f"one page alone: 95 % of its pictures within {1e3 * np.quantile(alone, 0.95):.0f} ms")
        seconds, found = await crowd(server, MODAL[0], arguments.moves, arguments.seed)
        say(f"{CROWD} pages, {1 / STEP:.0f} moves a second each: {len(seconds)} pictures, median "
            f"{1e3 * np.median(seconds):.0f} ms, 95 % within {1e3 * np.quantile(seconds, 0.95):.0f} ms; load "
            f"{os.getloadavg()[0]:.1f}", found)
        count, found = await drag_beside(server, arguments.solves, arguments.seed)
        say(f"{count} direct solves while {PAGES} pages drag", found)
        print(f"a direct solve after 40 abandoned downloads: {await abandon(server, 40):.1f} s; the very first one, "
              f"whose process had to start too: {first[0]:.1f} s")
        say("requests that are no HTTP", await unreadable(server, arguments.messages // 200, arguments.seed))
        print(f"a page beside 400 idle connections: {1e3 * await idle(server, 400):.0f} ms")
        answers, memory = await messages(server, arguments.messages, arguments.seed)
        say(f"{arguments.messages} messages, {dict(answers)}", [k for k in answers if k.startswith("wrong")])
        print("memory [MB] after each tenth:", *(f"{1e-6 * one:.0f}" for one in memory))
        await open_page(server)

    with served(arguments.quick) as server:
        asyncio.run(attack(server))
        log = server.log.read_text()
    say(f"log: {len(log)} bytes", [line for line in log.splitlines() if "Traceback" in line])
    with served(arguments.quick, files=FEW_FILES) as server:
        seconds = asyncio.run(idle(server, 4 * FEW_FILES))
        time.sleep(5.0)
        size = server.log.stat().st_size
    say(f"{4 * FEW_FILES} idle connections where {FEW_FILES} files may be open: a page in {1e3 * seconds:.0f} ms, "
        f"{size} bytes of log", ["the log grows"] if size > 10_000 else [])
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
