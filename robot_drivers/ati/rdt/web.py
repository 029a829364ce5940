"""The web pages of a sensor on RDT: GET requests, and XML that cannot hurt the reader."""

import http.client
import time
from collections.abc import Mapping
from xml.parsers import expat

from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceProtocolError, DeviceUnreachableError

MAX_PAGE_BYTES = 256 * 1024


class WebPages:
    """GET requests to one box, each over a connection of its own.

    Parameters
    ----------
    host, port : address of the box
    timeout_s : longest wait for the connection and for each piece of an answer
    pause_s : shortest time between two requests; boxes were seen to drop requests that follow one another
        quickly
    """

    def __init__(self, host: str, port: int, timeout_s: float, pause_s: float) -> None:
        self._host = host
        self._port = port
        self._timeout_s = timeout_s
        self._pause_ns = round(pause_s * 1e9)
        self._not_before_ns = host_time_ns()

    def page(self, path: str) -> bytes:
        """Return the body of a page.

        Raises
        ------
        DeviceUnreachableError
            Nothing answers.
        DeviceProtocolError
            The answer is not a page of acceptable size.
        """
        status, body = self._get(path)
        if status != http.client.OK:
            raise DeviceProtocolError(
                f"{self._url(path)} answers with HTTP status {status} instead of a page"
            )
        return body

    def submit(self, path: str) -> None:
        """Request a CGI path that changes a setting; the box reports success by a redirect (302)."""
        status, _ = self._get(path)
        if status not in (http.client.OK, http.client.FOUND):
            raise DeviceProtocolError(f"{self._url(path)} was refused with HTTP status {status}")

    def _get(self, path: str) -> tuple[int, bytes]:
        time.sleep(max(0, self._not_before_ns - host_time_ns()) * 1e-9)
        connection = http.client.HTTPConnection(self._host, self._port, timeout=self._timeout_s)
        try:
            connection.request("GET", path)
            response = connection.getresponse()
            body = response.read(MAX_PAGE_BYTES + 1)
        except http.client.HTTPException as error:
            raise DeviceProtocolError(
                f"{self._url(path)} does not answer as a web server ({error!r}); check host and HTTP port"
            ) from error
        except OSError as error:
            raise DeviceUnreachableError(
                f"{self._url(path)} does not answer ({error}); check power, cable, address and HTTP port"
            ) from error
        finally:
            connection.close()
            self._not_before_ns = host_time_ns() + self._pause_ns
        if len(body) > MAX_PAGE_BYTES:
            raise DeviceProtocolError(
                f"{self._url(path)} is larger than {MAX_PAGE_BYTES} bytes: not a sensor's page"
            )
        return response.status, body

    def _url(self, path: str) -> str:
        return f"http://{self._host}:{self._port}{path}"


def parse_tags(page: bytes, roots: tuple[str, ...]) -> Mapping[str, str]:
    """Return the text of every element of an XML page that has no children, by tag.

    Document types and entities are refused, so a page cannot grow or reach out while it is read.

    Parameters
    ----------
    page : the page as received
    roots : accepted names of the root element

    Raises
    ------
    DeviceProtocolError
        Not well-formed, a document type, another root, or a tag given twice with different text.
    """
    reader = _TagReader()
    try:
        reader.parse(page)
    except DeviceProtocolError:
        raise
    except (expat.ExpatError, LookupError, ValueError) as error:  # the last two: an unusable encoding
        raise DeviceProtocolError(f"sensor's page is not well-formed XML: {error}") from error
    if reader.root not in roots:
        raise DeviceProtocolError(f"sensor's page has root element {reader.root!r} instead of {roots[0]!r}")
    return reader.tags


class _TagReader:
    def __init__(self) -> None:
        self.root = ""
        self.tags: dict[str, str] = {}
        self._path: list[str] = []
        self._text: list[str] | None = None

    def parse(self, page: bytes) -> None:
        parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = self._refuse_doctype
        parser.StartElementHandler = self._start
        parser.CharacterDataHandler = self._characters
        parser.EndElementHandler = self._end
        parser.Parse(page, True)

    def _refuse_doctype(self, name: str, *_: object) -> None:
        raise DeviceProtocolError(f"sensor's page declares a document type {name!r}: refused")

    def _start(self, tag: str, _attributes: dict[str, str]) -> None:
        self.root = self.root or tag
        self._path.append(tag)
        self._text = []

    def _characters(self, text: str) -> None:
        if self._text is not None:
            self._text.append(text)

    def _end(self, tag: str) -> None:
        self._path.pop()
        if self._text is not None and self._path:
            text = "".join(self._text).strip()
            if self.tags.setdefault(tag, text) != text:
                raise DeviceProtocolError(
                    f"sensor's page gives {tag!r} twice: {self.tags[tag]!r} and {text!r}"
                )
        self._text = None
