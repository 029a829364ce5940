"""A TCP server of an emulated sensor, which serves from a thread of its own."""

import socketserver
import threading

from robot_drivers.ati.emulator.box import Box

POLL_S = 0.02


class TcpServer(socketserver.TCPServer):
    """Serves one client at a time from construction to :meth:`close`.

    Parameters
    ----------
    port : where it listens; 0 takes a free one
    handler : of one connection
    box : what the handlers tell of
    name : of its thread
    """

    allow_reuse_address = True

    def __init__(
        self, port: int, handler: type[socketserver.BaseRequestHandler], box: Box, name: str
    ) -> None:
        super().__init__((box.settings.host, port), handler)
        self.box = box
        self.closing = False
        self._thread = threading.Thread(target=self.serve_forever, args=(POLL_S,), name=name)
        self._thread.start()

    @property
    def port(self) -> int:
        """The TCP port in use."""
        return int(self.server_address[1])

    def close(self) -> None:
        """Stop serving."""
        self.closing = True
        self.shutdown()
        self._thread.join()
        self.server_close()
