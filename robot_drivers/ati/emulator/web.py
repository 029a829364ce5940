"""The web server of an emulated sensor, and the pages of a Net F/T box with the CGI that sets the RDT rate."""

import socketserver
import threading
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler
from urllib.parse import parse_qsl, urlsplit
from xml.sax.saxutils import escape

from robot_drivers.ati.emulator.box import Box
from robot_drivers.clock import host_time_ns

_POLL_S = 0.02

DONE = ""
"""What a page answers that has changed a setting."""

Pages = Callable[[Box, str, Mapping[str, str]], str | None]
"""Box, path and query to the page, to :data:`DONE`, or to None where there is no such page."""


class WebServer(socketserver.TCPServer):
    """Serves one request at a time, as the box does, from a thread of its own."""

    allow_reuse_address = True

    def __init__(self, box: Box, pages: Pages | None = None) -> None:
        super().__init__((box.settings.host, box.settings.http_port), _Request)
        self.box = box
        self.pages = pages or netft_pages
        self._last_request_ns = 0
        self._thread = threading.Thread(
            target=self.serve_forever, args=(_POLL_S,), name="Net F/T emulator: web"
        )
        self._thread.start()

    @property
    def port(self) -> int:
        """The TCP port in use."""
        return int(self.server_address[1])

    def close(self) -> None:
        """Stop serving."""
        self.shutdown()
        self._thread.join()
        self.server_close()

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
        content = self.server.pages(box, address.path, dict(parse_qsl(address.query)))
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


def netft_pages(box: Box, path: str, query: Mapping[str, str]) -> str | None:
    """Answer as a Net F/T box does."""
    index = query.get("index", "0")
    if path == "/netftapi2.xml" and index in map(str, range(len(box.settings.configurations))):
        return _configuration_page(box, int(index))
    if path == "/netftcalapi.xml":
        return _calibration_page(box)
    if path == "/comm.cgi":
        set_rdt_rate(box, query, 7000)
        return DONE
    return None


def _configuration_page(box: Box, index: int) -> str:
    settings = box.settings
    configuration = settings.configurations[index]
    return xml(
        "netft",
        {
            "prodname": settings.product,
            "setcfgsel": settings.active_configuration,
            "cfgnam": configuration.name,
            "cfgcalsel": 0,
            "cfgcpf": f"{configuration.counts_per_force:.10g}",
            "cfgcpt": f"{configuration.counts_per_torque:.10g}",
            "scfgfu": configuration.force_unit,
            "scfgtu": configuration.torque_unit,
            "comrdte": "Enabled" if settings.rdt_enabled else "Disabled",
            "comrdtrate": box.rate_hz,
            "comrdtbsiz": box.buffer_size,
        },
    )


def _calibration_page(box: Box) -> str:
    per_force, per_torque = box.settings.calibration_counts
    return xml(
        "netftCalibration",
        {"calsn": box.settings.serial, "calcpf": f"{per_force:.10g}", "calcpt": f"{per_torque:.10g}"},
    )


def xml(root: str, values: Mapping[str, object]) -> str:
    """Return a page with one tag for each value."""
    lines = "\n".join(f"  <{tag}>{escape(str(value))}</{tag}>" for tag, value in values.items())
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<{root}>\n{lines}\n</{root}>\n'


def set_rdt_rate(box: Box, query: Mapping[str, str], fastest: int) -> None:
    """Take the RDT rate over for the next stream; a value out of range or a misspelt name changes nothing."""
    rate = query.get("comrdtrate", "")
    if rate.isdecimal() and 1 <= int(rate) <= fastest:
        box.rate_hz = int(rate)
