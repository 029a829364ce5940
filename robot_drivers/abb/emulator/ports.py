"""The two TCP ports of the emulated RAPID server: one client each, as RAPID socket tasks serve them."""

import socket
from collections.abc import Callable

from robot_drivers.abb.emulator.rapid import REQUEST_BYTES
from robot_drivers.clock import host_time_s

_CLIENT_SILENCE_S = 2.0
_RECEIVE_BYTES = 4096


class ServerPort:
    """A listening port with at most one client; the next one waits until the first has gone."""

    def __init__(self, bind_address: str, port: int) -> None:
        self._listener = socket.create_server((bind_address, port), backlog=4)
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self.port = int(self._listener.getsockname()[1])

    @property
    def has_client(self) -> bool:
        """Whether a client is connected."""
        return self._client is not None

    @property
    def waiting_on(self) -> socket.socket:
        """The socket on which something may happen next: the client's, or the listener without one."""
        return self._listener if self._client is None else self._client

    def accept(self) -> bool:
        """Take a client if one waits and there is none; tell whether a new one has come."""
        if self._client is not None:
            return False
        try:
            self._client, _ = self._listener.accept()
        except BlockingIOError:
            return False
        self._client.setblocking(False)
        self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return True

    def receive(self) -> bytes:
        """Return what the client has sent; drops a client that has gone."""
        if self._client is None:
            return b""
        try:
            received = self._client.recv(_RECEIVE_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            received = b""
        if not received:
            self.drop_client()
        return received

    def send(self, frame: bytes) -> None:
        """Send a frame; drops a client that has gone or does not read."""
        if self._client is None:
            return
        try:
            sent = self._client.send(frame)
        except OSError:
            sent = 0
        if sent < len(frame):
            self.drop_client()

    def drop_client(self) -> None:
        """Close the connection."""
        if self._client is not None:
            self._client.close()
            self._client = None

    def close(self) -> None:
        """Close the connection and the port."""
        self.drop_client()
        self._listener.close()


class CommandPort(ServerPort):
    """The command port: cuts requests out of the stream and knows how long the client has been silent."""

    def __init__(self, bind_address: str, port: int) -> None:
        super().__init__(bind_address, port)
        self._buffer = b""
        self._last_request_s = 0.0

    @property
    def client_silence_s(self) -> float | None:
        """Time since the client's last request, None without a client."""
        return host_time_s() - self._last_request_s if self.has_client else None

    def serve(self, begin_session: Callable[[], None], handle: Callable[[bytes], list[bytes] | None]) -> None:
        """Accept, receive and answer whatever is there."""
        if self.accept():
            self._buffer, self._last_request_s = b"", host_time_s()
            begin_session()
        self._buffer += self.receive()
        while len(self._buffer) >= REQUEST_BYTES and self.has_client:
            request, self._buffer = self._buffer[:REQUEST_BYTES], self._buffer[REQUEST_BYTES:]
            self._last_request_s = host_time_s()
            replies = handle(request)
            if replies is None:
                self.drop_client()
                return
            for reply in replies:
                self.send(reply)
        silence = self.client_silence_s
        if silence is not None and silence > _CLIENT_SILENCE_S:
            self.drop_client()
