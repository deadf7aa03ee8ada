"""The page over HTTP and its socket, on loopback: the page's own files from a fixed list, and nothing else."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import signal
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import cast

from aiohttp import WSCloseCode, WSMsgType, web

from rom.errors import RomError
from rom.fullorder import blas_threads
from rom.interactive.connection import Connection, Desk
from rom.interactive.door import Door, Visitor, refusal, why_foreign
from rom.interactive.download import FORMATS, field_file
from rom.interactive.engine import Engine
from rom.interactive.policy import policy
from rom.interactive.state import DEFAULT_AMPLITUDE, State, from_query
from rom.interactive.wire import LARGEST_REQUEST

log = logging.getLogger(__name__)

PAGE = Path(__file__).parent / "page"
MEDIA_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml",
               ".png": "image/png", ".json": "application/json", ".ico": "image/x-icon", ".md": "text/plain"}
"""Of the page's files; one of another ending is plain text."""
MOST_PAGES, MOST_DOWNLOADS = 32, 4
LONGEST_SENDING = 30.0
"""Seconds that a browser gets to take an answer."""
HEADERS = web.AppKey("headers", dict[str, str])
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def make_application(engine: Engine, host: str = "127.0.0.1", folder: Path = PAGE) -> web.Application:
    """The server's application.

    Parameters
    ----------
    engine : Engine
    host : str
        Address that it will listen on; names in Host and Origin must be loopback's or this.
    folder : Path
        The page's files; those that lie there now are served.
    """
    site = Site(engine, host, folder)
    application = web.Application(middlewares=[site.guard], client_max_size=LARGEST_REQUEST)
    application[HEADERS] = site.headers
    application.router.add_get("/", site.index)
    application.router.add_get("/page/{name:.+}", site.static)
    application.router.add_get("/save/{name}", site.save)
    application.router.add_get("/socket", site.socket)
    application.on_startup.append(site.begin)
    application.on_shutdown.append(site.close_sockets)
    application.on_cleanup.append(site.close)
    return application


class Site:
    """Handlers of the application's routes; arguments as in `make_application`."""

    def __init__(self, engine: Engine, host: str, folder: Path) -> None:
        self.engine, self.host = engine, host
        self.desk = Desk(engine)
        self.files = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*"))
                      if path.is_file() and not path.is_symlink()}
        self.sockets: set[web.WebSocketResponse] = set()
        self.downloads = 0
        allowed = policy(self.files["index.html"].read_text(encoding="utf-8"), scripts=("'self'",), others=("'self'",))
        self.headers = {
            "Content-Security-Policy": f"{allowed}; frame-ancestors 'none'",
            "X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer",
            "Cache-Control": "no-cache", "Cross-Origin-Resource-Policy": "same-origin"}

    # ---- who may ask ----------------------------------------------------------------------------------------

    @web.middleware
    async def guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse foreign hosts and origins; turn what goes wrong into one sentence."""
        visitor = cast(Visitor, request.protocol)
        visitor.work()
        try:
            response = await self._answer(request, handler)
            if not response.prepared:
                response.headers.update(self.headers)
            async with asyncio.timeout(LONGEST_SENDING):
                await response.prepare(request)
                await response.write_eof()
        except TimeoutError:
            visitor.send_away()
            raise ConnectionError from None
        finally:
            visitor.rest()
        return response

    async def _answer(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        reason = why_foreign(request, self.host)
        if reason:
            return refusal(403, f"{reason}: open the address that it printed", self.headers)
        try:
            return await handler(request)
        except web.HTTPException as error:
            return refusal(error.status, f"{error.reason}: the page is at /", self.headers)
        except (RomError, ValueError) as error:
            return refusal(400, " ".join(str(error).split()), self.headers)
        except ConnectionError:
            raise
        except Exception:  # a fault of ours must not show its insides
            log.exception("a request could not be answered")
            return refusal(500, "the server could not answer this: its log says why", self.headers)

    # ---- what can be asked for ------------------------------------------------------------------------------

    async def index(self, request: web.Request) -> web.StreamResponse:
        """The page, whose address must hold a state or nothing."""
        from_query(request.rel_url.raw_query_string, self.engine.limits)
        return self._file("index.html")

    async def static(self, request: web.Request) -> web.StreamResponse:
        """One of the page's own files."""
        return self._file(request.match_info["name"])

    def _file(self, name: str) -> web.StreamResponse:
        path = self.files.get(name)
        if path is None:
            raise web.HTTPNotFound
        kind = MEDIA_TYPES.get(path.suffix, "text/plain")
        return web.Response(body=path.read_bytes(), content_type=kind,
                            charset="utf-8" if kind.startswith("text/") else None)

    async def save(self, request: web.Request) -> web.StreamResponse:
        """The field of a state as a file."""
        name = request.match_info["name"]
        if name not in FORMATS:
            raise web.HTTPNotFound
        state = from_query(request.rel_url.raw_query_string, self.engine.limits)
        if self.downloads >= MOST_DOWNLOADS:
            return refusal(503, f"{MOST_DOWNLOADS} files are being made already: ask again", self.headers)
        self.downloads += 1
        try:
            answer = await self.desk.answer(state)
            content = await self.desk.run(self.desk.slow, field_file, self.engine, state, answer, name)
        finally:
            self.downloads -= 1
        return web.Response(body=content, content_type=FORMATS[name],
                            headers={"Content-Disposition": f'attachment; filename="fingertip-{name}"'})

    async def socket(self, request: web.Request) -> web.StreamResponse:
        """A browser's connection."""
        if len(self.sockets) >= MOST_PAGES:
            return refusal(503, f"{MOST_PAGES} pages are open already: close one", self.headers)
        # compression costs more time than loopback
        ws = web.WebSocketResponse(max_msg_size=LARGEST_REQUEST, compress=False, heartbeat=30.0)
        await ws.prepare(request)
        self.sockets.add(ws)
        connection = Connection(self.desk, ws.send_bytes)
        try:
            async for message in ws:
                if message.type is WSMsgType.TEXT:
                    await connection.take(message.data)
                else:
                    await ws.close(code=WSCloseCode.UNSUPPORTED_DATA, message=b"requests are JSON text")
                await asyncio.sleep(0)  # whoever sends without a pause lets others have their turn
        finally:
            self.sockets.discard(ws)
            await connection.close()
        return ws

    async def begin(self, _: web.Application) -> None:
        """Begin what takes a moment: matrices, which no picture waits for, and the first answer, which compiles."""
        first = self.desk.answer(State(((self.engine.limits.pad_center, DEFAULT_AMPLITUDE),), 100.0))
        self._beginning = asyncio.gather(self.desk.matrices(), first)

    async def close_sockets(self, _: web.Application) -> None:
        """Tell every browser that the server ends."""
        for ws in list(self.sockets):
            await ws.close(code=WSCloseCode.GOING_AWAY, message=b"the server has ended")

    async def close(self, _: web.Application) -> None:
        """End threads and processes."""
        self._beginning.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._beginning
        self.desk.close()


def listen(host: str, port: int) -> socket.socket:
    """A bound socket, so that a taken port is known before anything is computed.

    Raises
    ------
    ValueError
        Where the port is taken or the address is not this machine's; one sentence.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, UnicodeError) as error:
        raise ValueError(f"the host {host!r} has no address: give one of this machine, such as 127.0.0.1") from error
    bound = socket.socket(family, kind, protocol)
    try:
        if hasattr(socket, "SO_REUSEADDR"):
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        bound.listen(128)
    except OSError as error:
        bound.close()
        if error.errno == errno.EADDRINUSE:
            raise ValueError(f"port {port} is in use: give another with --port, or --port 0 for a free one") from error
        if error.errno in (errno.EACCES, errno.EPERM):
            raise ValueError(f"port {port} may not be opened by this user: give one from 1024 up") from error
        raise ValueError(f"{host} port {port} cannot be listened on ({error.strerror}): give an address of this "
                         "machine, such as 127.0.0.1") from error
    return bound


def address_of(bound: socket.socket) -> str:
    """What to open in a browser."""
    host, port = bound.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


def serve(application: web.Application, bound: socket.socket, ready: Callable[[], None]) -> None:
    """Serve until the process is interrupted or terminated."""
    # the browser that draws wants the cores too: two threads that wait for each other would stall a picture
    with blas_threads(1):
        asyncio.run(_serve(application, bound, ready))


async def _serve(application: web.Application, bound: socket.socket, ready: Callable[[], None]) -> None:
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    for name in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):  # Windows: KeyboardInterrupt ends asyncio.run there
            loop.add_signal_handler(name, ended.set)
    async with opened(application, bound):
        ready()
        await ended.wait()


@contextlib.asynccontextmanager
async def opened(application: web.Application, bound: socket.socket) -> AsyncIterator[Door]:
    """Let visitors in while the context lasts."""
    runner = web.AppRunner(application, shutdown_timeout=1.0, handler_cancellation=True)
    await runner.setup()
    door = Door(cast(web.Server, runner.server), application[HEADERS])
    accepting = asyncio.create_task(door.accept(bound))
    try:
        yield door
    finally:
        accepting.cancel()
        await asyncio.wait([accepting])
        await runner.cleanup()
