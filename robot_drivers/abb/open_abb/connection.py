"""The connection to an open-abb server: one request at a time, and a reply that nothing marks the end of."""

import select
import socket
import threading
import time

from robot_drivers.abb.open_abb.messages import Code, find_info, parse_reply, request
from robot_drivers.errors import (
    DeviceError,
    DeviceFaultError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)

_RECEIVE_BYTES = 4096


class OpenABBConnection:
    """One connection, which counts as lost once a reply stayed out: a late one would pass as that of the next request.

    Parameters
    ----------
    host, port : of the server
    connect_timeout_s : longest wait for the connection, and then for the first answer
    reply_gap_s : silence after which a reply counts as whole

    Attributes
    ----------
    info : serial number, software version and robot type, as the server tells them

    Raises
    ------
    DeviceUnreachableError, DeviceTimeoutError
        From the constructor: nobody listens there, or nobody answers.
    """

    def __init__(self, host: str, port: int, connect_timeout_s: float, reply_gap_s: float) -> None:
        self._name = f"open-abb server {host}:{port}"
        self._reply_gap_s = reply_gap_s
        self._one_exchange = threading.Lock()
        self._lost: DeviceError | None = None
        try:
            self._socket = socket.create_connection((host, port), timeout=connect_timeout_s)
        except OSError as error:
            raise DeviceUnreachableError(
                f"no {self._name} ({error}); check the address, the network, and that its RAPID module runs"
            ) from error
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.info = self._greet(connect_timeout_s)
        except BaseException:
            self._socket.close()
            raise

    def ask(self, code: Code, parameters: tuple[str, ...] = (), timeout_s: float = 2.0) -> str:
        """Send a request, wait for its reply and return the payload; requests of several threads follow each other.

        Raises
        ------
        DeviceTimeoutError
            No reply came; the connection is given up.
        DeviceFaultError
            The server refused the request and did nothing.
        DeviceProtocolError
            It sent something else; the connection is given up.
        DeviceUnreachableError
            The connection is lost.
        """
        message = request(code, *parameters)
        with self._one_exchange:
            if self._lost is not None:
                raise self._lost
            try:
                self._socket.sendall(message)
                reply = parse_reply(self._receive(f"an answer to {code.name}", timeout_s))
                if reply.code != code:
                    raise DeviceProtocolError(f"the {self._name} answered request {reply.code}, not {code}")
            except (DeviceError, KeyboardInterrupt):  # whoever stops waiting leaves a reply behind
                self._give_up("a reply stayed out")
                raise
            except OSError as error:
                raise self._give_up(str(error)) from error
        if not reply.ok:
            raise DeviceFaultError(f"the {self._name} refused {message.decode()!r}; nothing was done")
        return reply.payload

    def close(self) -> None:
        """Tell the server to wait for the next client, and disconnect."""
        with self._one_exchange:
            if self._lost is None:
                self._give_up("it was closed", farewell=request(Code.CLOSE))

    def _give_up(self, why: str, farewell: bytes = b"") -> DeviceUnreachableError:
        lost = DeviceUnreachableError(f"the connection to the {self._name} is lost ({why}); connect again")
        self._lost = lost
        with self._socket:
            try:
                self._socket.sendall(farewell)
            except OSError:
                return lost  # the server was quicker
        return lost

    def _greet(self, timeout_s: float) -> str:
        """Ask who is there, and pass over replies that were meant for an earlier client."""
        deadline = time.monotonic() + timeout_s
        self._socket.sendall(request(Code.INFO))
        received = b""
        while True:
            received += self._receive(
                "any answer; it may be carrying out a motion", deadline - time.monotonic()
            )
            info = find_info(received)
            if info is not None:
                return info

    def _receive(self, what: str, timeout_s: float) -> bytes:
        """Return what comes until a gap; nothing else marks the end of a reply."""
        received = b""
        while self._readable(self._reply_gap_s if received else timeout_s):
            part = self._socket.recv(_RECEIVE_BYTES)
            if not part:
                raise DeviceUnreachableError(f"the {self._name} closed the connection; connect again")
            received += part
        if not received:
            raise DeviceTimeoutError(f"the {self._name} did not send {what} in {timeout_s:.1f} s")
        return received

    def _readable(self, timeout_s: float) -> bool:
        readable, _, _ = select.select([self._socket], [], [], max(timeout_s, 0.0))
        return bool(readable)
