"""The server that viewers connect to: a thread of a client of the acquisition, which passes on what the client is told.

It is no part of the acquisition process: what moves and records neither knows of it nor waits for it. What the client
is told is put into a queue of a few places, of which the oldest gives way; each viewer has a queue of its own, so that
one that does not read loses messages and keeps nobody. A viewer can subscribe and nothing else.
"""

import asyncio
import hmac
import threading
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from daq.acquisition.messages import Telemetry
from daq.acquisition.viewing.channels import Analysis, Shown, channels_of, shown, shown_analysis
from daq.acquisition.viewing.protocol import (
    SUBPROTOCOLS,
    Subscribe,
    UnknownRequestError,
    advertise,
    message_data,
    server_info,
    understood,
    warning,
)
from daq.errors import SessionError
from daq.viewers import Viewers
from robot_drivers.clock import host_time_ns
from robot_drivers.closing import ClosedAtExit

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

_WAITING = 8  # tellings, a quarter of a second
_WAITING_FOR_A_VIEWER = 512  # messages
_MOST_VIEWERS = 8
_MOST_SUBSCRIPTIONS = 100  # of a viewer
_LARGEST_REQUEST = 65536  # bytes
_START_S = 10.0
_BEARER = "Bearer "


@dataclass(slots=True)
class _Viewer:
    """One that is connected: the topic of each of its subscriptions, and what waits for it."""

    subscriptions: dict[int, str] = field(default_factory=dict)
    waiting: deque[bytes] = field(default_factory=lambda: deque(maxlen=_WAITING_FOR_A_VIEWER))
    ready: asyncio.Event = field(default_factory=asyncio.Event)


class LiveServer(ClosedAtExit):
    """Listens from construction to :meth:`close`; a context manager.

    Attributes
    ----------
    port : on which it listens

    Raises
    ------
    SessionError
        The library is not installed, or nobody may listen there.
    """

    def __init__(self, viewers: Viewers, cameras: tuple[str, ...]) -> None:
        try:
            import websockets  # noqa: F401 - only whether it is there
        except ImportError:
            raise SessionError(
                "[viewers] of the rig file needs the library websockets; pip install 'retraction[live]'"
            ) from None
        self.port = 0
        self._viewers = viewers
        self._channels = {channel.number: channel for channel in channels_of(cameras)}
        self._shift_ns = time.time_ns() - host_time_ns()
        self._told: deque[Telemetry | Analysis] = deque(maxlen=_WAITING)
        self._connected: dict[Any, _Viewer] = {}
        self._loop = asyncio.new_event_loop()
        self._ended = asyncio.Event()
        self._started = threading.Event()
        self._failure = ""
        self._thread = threading.Thread(target=self._run, name="viewers", daemon=True)
        self._thread.start()
        if not self._started.wait(_START_S) or self._failure:
            where = f"{viewers.bind_address} port {viewers.port}"
            why = self._failure or "it does not start"
            raise SessionError(
                f"[viewers] of the rig file: nobody can listen on {where} ({why}); name another port"
            )

    def tell(self, what: Telemetry | Analysis) -> None:
        """Show viewers what a client was told, or has made of it; returns at once, whoever looks on."""
        if self._connected:
            self._told.append(what)
            self._call(self._pass_on)

    def close(self) -> None:
        """Part from all viewers and stop listening."""
        self._call(self._ended.set)
        self._thread.join(_START_S)

    def _call(self, what: Any) -> None:
        try:
            self._loop.call_soon_threadsafe(what)
        except RuntimeError:
            return  # it has ended

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        except OSError as error:
            self._failure = error.strerror or str(error)
        finally:
            self._started.set()
            self._loop.close()

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        async with serve(
            self._look_on,
            self._viewers.bind_address,
            self._viewers.port,
            process_request=self._refused,
            subprotocols=SUBPROTOCOLS,  # type: ignore[arg-type] # names of subprotocols are plain text
            max_size=_LARGEST_REQUEST,
            max_queue=4,
            compression=None,
        ) as server:
            self.port = next(iter(server.sockets)).getsockname()[1]
            self._started.set()
            await self._ended.wait()

    def _refused(self, connection: "ServerConnection", request: "Request") -> "Response | None":
        """Return why a viewer is not let in; None for one that is."""
        if len(self._connected) >= _MOST_VIEWERS:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many look on already\n")
        if self._knows_the_token(request):
            return None
        if self._viewers.token:
            return connection.respond(
                HTTPStatus.UNAUTHORIZED, "the token is missing or wrong: ws://.../?token=...\n"
            )
        # a page of any site in a browser of this computer can connect to it
        origin = request.headers.get("Origin", "")
        if origin.startswith(("http://", "https://")) and origin not in self._viewers.origins:
            return connection.respond(
                HTTPStatus.FORBIDDEN, "this web page is not among the origins of [viewers]\n"
            )
        return None

    def _knows_the_token(self, request: "Request") -> bool:
        if not self._viewers.token:
            return False
        asked = parse_qs(urlsplit(request.path).query).get("token", [""])[0]
        header = request.headers.get("Authorization", "")
        offered = header[len(_BEARER) :] if header.startswith(_BEARER) else asked
        return hmac.compare_digest(offered.encode(), self._viewers.token.encode())

    async def _look_on(self, connection: "ServerConnection") -> None:
        from websockets.exceptions import ConnectionClosed

        viewer = self._connected[connection] = _Viewer()
        sending: asyncio.Task[None] | None = None
        try:
            await connection.send(server_info("retraction", str(self._shift_ns)))
            await connection.send(advertise(tuple(self._channels.values())))
            sending = asyncio.create_task(_send(connection, viewer))
            async for request in connection:
                if complaint := self._obeyed(viewer, request):
                    await connection.send(warning(complaint))
        except ConnectionClosed:
            return
        finally:
            del self._connected[connection]
            if sending is not None:
                sending.cancel()

    def _obeyed(self, viewer: _Viewer, request: str | bytes) -> str:
        """Subscribe or unsubscribe; return what a viewer is told of anything else."""
        try:
            asked = understood(request)
        except UnknownRequestError as error:
            return str(error)
        if not isinstance(asked, Subscribe):
            for subscription in asked.subscriptions:
                viewer.subscriptions.pop(subscription, None)
            return ""
        for subscription, number in asked.channels.items():
            if number not in self._channels:
                return f"there is no channel {number}"
            if len(viewer.subscriptions) >= _MOST_SUBSCRIPTIONS:
                return f"there are {_MOST_SUBSCRIPTIONS} subscriptions already"
            viewer.subscriptions[subscription] = self._channels[number].topic
        return ""

    def _pass_on(self) -> None:
        """Put what was told into the queues of those who want it."""
        while self._told:
            told = self._told.popleft()
            wanted = frozenset(
                topic for one in self._connected.values() for topic in one.subscriptions.values()
            )
            for topic, time_ns, data in self._messages(told, wanted):
                for viewer in self._connected.values():
                    for subscription, subscribed in viewer.subscriptions.items():
                        if subscribed == topic:
                            viewer.waiting.append(message_data(subscription, time_ns, data))
                            viewer.ready.set()

    def _messages(self, told: Telemetry | Analysis, wanted: frozenset[str]) -> Iterator[Shown]:
        if isinstance(told, Analysis):
            return shown_analysis(told, self._shift_ns, wanted)
        return shown(told, self._shift_ns, wanted)


async def _send(connection: "ServerConnection", viewer: _Viewer) -> None:
    """Send what waits for a viewer, as fast as it reads."""
    from websockets.exceptions import ConnectionClosed

    try:
        while True:
            await viewer.ready.wait()
            viewer.ready.clear()
            while viewer.waiting:
                await connection.send(viewer.waiting.popleft())
    except ConnectionClosed:
        return
