"""A connection to a controller's RTDE server: what is asked and answered before data flow. Nothing here moves."""

import select
import socket
import struct
import time
from collections.abc import Sequence

from robot_drivers.errors import (
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)
from robot_drivers.universal_robots.rtde.packages import (
    PROTOCOL_VERSION,
    Kind,
    Package,
    Recipe,
    accepted,
    controller_version,
    take_package,
)

_RECEIVE_BYTES = 65536


class RTDEConnection:
    """One connection; its socket belongs to one reader, any thread may send.

    Attributes
    ----------
    version : of the controller's software

    Raises
    ------
    DeviceUnreachableError, DeviceTimeoutError, DeviceProtocolError
        From the constructor: nobody listens there, nobody answers, or it is no controller that speaks version 2.
    """

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self.name = f"UR controller {host}:{port}"
        self._timeout_s = timeout_s
        self._received = bytearray()
        try:
            self._socket = socket.create_connection((host, port), timeout=timeout_s)
        except OSError as error:
            raise DeviceUnreachableError(
                f"no {self.name} ({error}); check the address, the network, and that RTDE is enabled under Settings, "
                "Security, Services"
            ) from error
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if not accepted(self._ask(Kind.PROTOCOL, struct.pack(">H", PROTOCOL_VERSION))):
                raise DeviceProtocolError(
                    f"the {self.name} does not speak RTDE version {PROTOCOL_VERSION}; it needs software 3.3 or 5.0"
                )
            self.version = controller_version(self._ask(Kind.CONTROLLER))
        except BaseException:
            self._socket.close()
            raise

    def outputs(self, names: Sequence[str], rate_hz: float) -> Recipe:
        """Choose what the controller tells, and how often; raises DeviceProtocolError for what it does not know."""
        request = struct.pack(">d", rate_hz) + ",".join(names).encode()
        return Recipe.of_answer(self._ask(Kind.OUTPUTS, request), names)

    def inputs(self, names: Sequence[str]) -> Recipe:
        """Choose what is written to the controller; raises DeviceProtocolError where another client writes it."""
        return Recipe.of_answer(self._ask(Kind.INPUTS, ",".join(names).encode()), names)

    def start(self) -> None:
        """Let the data flow."""
        if not accepted(self._ask(Kind.START)):
            raise DeviceProtocolError(f"the {self.name} does not start to send; connect again")

    def send(self, recipe: Recipe, values: Sequence[int | float]) -> None:
        """Write inputs.

        Raises
        ------
        DeviceUnreachableError
            The connection is lost.
        """
        try:
            self._socket.sendall(Package(Kind.DATA, recipe.encode(values)).encode())
        except OSError as error:
            raise self._lost(error) from error

    def receive(self, timeout_s: float) -> list[Package]:
        """Return the packages that have come, waiting so long for a first one.

        Raises
        ------
        DeviceUnreachableError, DeviceProtocolError
            The connection is lost, or what came is no package.
        """
        try:
            readable, _, _ = select.select([self._socket], [], [], max(timeout_s, 0.0))
            if not readable:
                return []
            part = self._socket.recv(_RECEIVE_BYTES)
        except (OSError, ValueError) as error:
            raise self._lost(error) from error
        if not part:
            raise self._lost("it was closed by the controller")
        self._received += part
        packages = []
        while (package := take_package(self._received)) is not None:
            packages.append(package)
        return packages

    def close(self) -> None:
        """Disconnect."""
        self._socket.close()

    def _ask(self, kind: Kind, content: bytes = b"") -> Package:
        """Send a request and return its answer; texts and data on the way are passed over."""
        try:
            self._socket.sendall(Package(kind, content).encode())
        except OSError as error:
            raise self._lost(error) from error
        deadline = time.monotonic() + self._timeout_s
        while (left_s := deadline - time.monotonic()) > 0:
            for package in self.receive(left_s):
                if package.kind is kind:
                    return package
        raise DeviceTimeoutError(f"the {self.name} did not answer {kind.name} in {self._timeout_s:g} s")

    def _lost(self, why: object) -> DeviceUnreachableError:
        return DeviceUnreachableError(f"the connection to the {self.name} is lost ({why}); connect again")
