"""The web server of an emulated sensor on RDT."""

from http.server import BaseHTTPRequestHandler
from urllib.parse import parse_qsl, urlsplit

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.pages import DONE, Pages
from robot_drivers.ati.emulator.tcp import TcpServer
from robot_drivers.clock import host_time_ns


class WebServer(TcpServer):
    """Serves one request at a time, as the box does."""

    def __init__(self, box: Box, pages: Pages) -> None:
        self.pages = pages
        self._last_request_ns = 0
        super().__init__(box.settings.http_port, _Request, box, "RDT emulator: web")

    def too_soon(self) -> bool:
        """Tell whether a request follows the one before it faster than the box can serve."""
        before_ns, self._last_request_ns = self._last_request_ns, host_time_ns()
        return self._last_request_ns - before_ns < self.box.settings.min_request_interval_s * 1e9


class _Request(BaseHTTPRequestHandler):
    server: WebServer
    timeout = 1.0

    def do_GET(self) -> None:
        box = self.server.box
        if not box.reachable or self.server.too_soon():
            return
        address = urlsplit(self.path)
        content = self.server.pages.answer(box, address.path, dict(parse_qsl(address.query)))
        if content is None:
            self.send_error(404)
        elif content is DONE:
            self.send_response(302)
            self.send_header("Location", address.path.replace(".cgi", ".htm"))
            self.end_headers()
        else:
            self._page(content)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing: the emulator runs inside tests."""

    def _page(self, content: str) -> None:
        body = content.encode()
        self.send_response(200)
        self.send_header("Content-Type", "text/xml")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)
