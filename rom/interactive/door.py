"""Who may come in: hosts and origins, how many connections at a time, and what a request that is none is told.

A browser lets any page of the net send requests to loopback; hence the check of Host (against rebinding of names) and
of Origin (against foreign pages) on every request. Connections that ask for nothing hold up nobody: they are closed
after a while, and earlier where the limit is reached and another knocks.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import logging
import math
import re
import socket
from http import HTTPStatus
from typing import Any

from aiohttp import web

log = logging.getLogger(__name__)

LOOPBACK = ("localhost", "127.0.0.1", "::1")
MOST_VISITORS = 256
"""Connections at a time, pages' sockets among them; fewer where the process may not open twice as many files."""
IDLE = 10.0
"""Seconds without a whole request after which a connection is closed."""
PAUSE, SILENCE = 0.2, 60.0
"""Seconds after a failed accept until the next, and between two words of the log on those."""
_HOST = re.compile(r"(?:\[([0-9a-f.:]*:[0-9a-f.:]*)\]|([0-9a-z.-]{1,253}))(?::[0-9]{1,5})?", re.ASCII | re.IGNORECASE)


def why_foreign(request: web.BaseRequest, own: str) -> str:
    """Why a request is none of a page of this server; empty where it is.

    Parameters
    ----------
    request : Request
    own : str
        Address that the server listens on; names in Host and Origin must be loopback's or this.
    """
    hosts = request.headers.getall("Host", [])
    if len(hosts) != 1 or not _is_ours(hosts[0], own):
        return "the Host of this request is not this server's"
    origin = request.headers.get("Origin", f"http://{hosts[0]}")
    foreign = request.headers.get("Sec-Fetch-Site") in ("cross-site", "same-site") and request.path != "/"
    if foreign or origin.lower() != f"http://{hosts[0].lower()}":
        return "another page may not talk to this server"
    return ""


def _is_ours(host: str, own: str) -> bool:
    found = _HOST.fullmatch(host)
    if found is None:
        return False
    name = (found[1] or found[2]).lower()
    if name in LOOPBACK or name == own.lower():
        return True
    if own in ("0.0.0.0", "::"):  # every address of this machine was asked for; names can be rebound
        with contextlib.suppress(ValueError):
            ipaddress.ip_address(name)
            return True
        return name == socket.gethostname().lower()
    return False


class Visitor(web.RequestHandler):
    """One connection of HTTP; while no request is being answered, its time runs.

    Parameters
    ----------
    door : Door
    """

    def __init__(self, door: Door) -> None:
        super().__init__(door.server, loop=asyncio.get_running_loop(), lingering_time=1.0)
        self._door = door
        self.rests: asyncio.TimerHandle | None = None
        """Set while nothing is being answered."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._wire: Any = transport
        super().connection_made(transport)
        self.rest()

    def connection_lost(self, error: BaseException | None) -> None:
        self.work()
        self._door.visitors.pop(self, None)
        super().connection_lost(error)

    def work(self) -> None:
        """A request has come."""
        if self.rests is not None:
            self.rests.cancel()
        self.rests = None

    def rest(self) -> None:
        """Wait for the next request, as the last who may stay."""
        self.work()
        if self.transport is not None:  # else the browser has gone
            self.rests = asyncio.get_running_loop().call_later(IDLE, self.send_away)
            self._door.visitors.pop(self, None)
            self._door.visitors[self] = None

    def send_away(self) -> None:
        """Close at once; what has not been read is lost."""
        self._door.visitors.pop(self, None)
        self._wire.abort()

    def handle_error(self, request: web.BaseRequest, status: int = 500, exc: BaseException | None = None,
                     message: str | None = None) -> web.StreamResponse:
        """What is sent where a request cannot be read, or no handler could answer it."""
        if status >= HTTPStatus.INTERNAL_SERVER_ERROR:
            log.error("a request could not be answered", exc_info=exc)
        response = refusal(status, f"{HTTPStatus(status).phrase}: the page is at /", self._door.headers)
        response.force_close()
        return response


class Door:
    """Accepts connections, as many as are allowed.

    Parameters
    ----------
    server : Server
        Of a runner that is set up.
    headers : dict of str
        Of what is said to those whose request cannot be read.
    """

    def __init__(self, server: web.Server, headers: dict[str, str]) -> None:
        self.server, self.headers = server, headers
        self.visitors: dict[Visitor, None] = {}
        """Who is here; of those that wait for nothing, who has done so for longest comes first."""
        self.most = min(MOST_VISITORS, most_files() // 2)
        self._told = -math.inf

    async def accept(self, bound: socket.socket) -> None:
        """Accept until cancelled."""
        loop = asyncio.get_running_loop()
        bound.setblocking(False)
        while True:
            while len(self.visitors) >= self.most and not self._make_room():
                await asyncio.sleep(PAUSE)
            try:
                connection, _ = await loop.sock_accept(bound)
            except OSError as error:  # no descriptor left, say
                if loop.time() - self._told > SILENCE:
                    self._told = loop.time()
                    log.warning("no connection can be accepted (%s); the server tries on", error)
                self._make_room()
                await asyncio.sleep(PAUSE)
            else:
                await loop.connect_accepted_socket(lambda: Visitor(self), connection)

    def _make_room(self) -> bool:
        """Send away who has asked for nothing for longest; False where all are being answered."""
        found = next((one for one in self.visitors if one.rests), None)
        if found is not None:
            found.send_away()
        return found is not None


def refusal(status: int, text: str, headers: dict[str, str]) -> web.Response:
    """One sentence."""
    return web.Response(status=status, text=f"{text}\n", headers=headers)


def most_files() -> int:
    """How many files this process may have open."""
    try:
        import resource
    except ImportError:  # Windows, where sockets count for themselves
        return 2 * MOST_VISITORS
    limit: Any = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    return 2 * MOST_VISITORS if limit == resource.RLIM_INFINITY else limit
