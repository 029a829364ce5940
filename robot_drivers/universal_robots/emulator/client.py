"""One client of the emulated RTDE server: what it has asked for, and what it is sent."""

import contextlib
import socket
import struct
from collections.abc import Mapping

from robot_drivers.errors import DeviceProtocolError
from robot_drivers.universal_robots.emulator.settings import CYCLE_S
from robot_drivers.universal_robots.robot.registers import INPUTS, OUTPUTS
from robot_drivers.universal_robots.rtde.packages import (
    PROTOCOL_VERSION,
    Kind,
    Package,
    Recipe,
    Value,
    take_package,
)

_RECEIVE_BYTES = 65536
_VECTORS = {"actual_q", "actual_TCP_pose", "actual_TCP_speed", "ft_raw_wrench", "actual_TCP_force"}
_COUNTS = {"runtime_state", "safety_status_bits", "robot_status_bits"}


def type_of_output(name: str) -> str:
    """Return the type of a variable, ``NOT_FOUND`` for one that is not known."""
    if name not in {*OUTPUTS, *_VECTORS, *_COUNTS}:
        return "NOT_FOUND"
    if name in _VECTORS:
        return "VECTOR6D"
    if name in _COUNTS:
        return "UINT32"
    return "INT32" if "int" in name or name.endswith("mode") else "DOUBLE"


class EmulatedClient:
    """A connection that the server has accepted.

    Attributes
    ----------
    inputs : recipes by their numbers; of each variable one client is the writer
    every : so many cycles it is told, by the rate that it has asked for
    started : whether it is told anything
    """

    def __init__(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket = connection
        self._received = bytearray()
        self._outputs: Recipe | None = None
        self.inputs: dict[int, Recipe] = {}
        self.every, self.started = 4, False

    def writes(self, name: str) -> bool:
        """Tell whether it is the writer of a variable."""
        return any(name in recipe.names for recipe in self.inputs.values())

    def hear(self) -> list[Package]:
        """Return the packages that have come; raises OSError once it is gone, DeviceProtocolError for rubbish."""
        try:
            part = self._socket.recv(_RECEIVE_BYTES)
        except BlockingIOError:
            return []
        if not part:
            raise ConnectionResetError
        self._received += part
        packages = []
        while (package := take_package(self._received)) is not None:
            packages.append(package)
        return packages

    def answer(self, package: Package, software: tuple[int, ...], taken: frozenset[str]) -> None:
        """Answer a request; ``taken`` are the inputs that others write."""
        content = package.content
        match package.kind:
            case Kind.PROTOCOL:
                self.send(Kind.PROTOCOL, bytes([content == struct.pack(">H", PROTOCOL_VERSION)]))
            case Kind.CONTROLLER:
                self.send(Kind.CONTROLLER, struct.pack(">4I", *software))
            case Kind.OUTPUTS:
                (rate_hz,) = struct.unpack(">d", content[:8])
                self.every = max(1, round(1.0 / (rate_hz * CYCLE_S)))
                names = _names(content[8:])
                types = [type_of_output(name) for name in names]
                self._outputs = self._made(Kind.OUTPUTS, 1, names, types)
            case Kind.INPUTS:
                names = _names(content)
                types = [_type_of_input(name, taken) for name in names]
                number = len(self.inputs) + 1
                if (recipe := self._made(Kind.INPUTS, number, names, types)) is not None:
                    self.inputs[number] = recipe
            case Kind.START | Kind.PAUSE:
                self.started = package.kind is Kind.START
                self.send(package.kind, b"\x01")

    def tell(self, values: Mapping[str, Value]) -> bytes:
        """Send the variables that it has asked for, and return the content."""
        if self._outputs is None:
            return b""
        content = self._outputs.encode([values[name] for name in self._outputs.names])
        self.send(Kind.DATA, content)
        return content

    def send(self, kind: Kind, content: bytes) -> None:
        """Send a package; one that does not fit into what the client has not read is left out."""
        with contextlib.suppress(BlockingIOError):
            self._socket.send(Package(kind, content).encode())

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    def _made(self, kind: Kind, number: int, names: list[str], types: list[str]) -> Recipe | None:
        package = Package(kind, bytes([number]) + ",".join(types).encode())
        self.send(kind, package.content)
        try:
            return Recipe.of_answer(package, names)
        except DeviceProtocolError:
            return None


def _type_of_input(name: str, taken: frozenset[str]) -> str:
    if name not in INPUTS:
        return "NOT_FOUND"
    if name in taken:
        return "IN_USE"
    return "INT32" if "int" in name else "DOUBLE"


def _names(content: bytes) -> list[str]:
    """Return the variables of a request; the client of ur_rtde ends its list with a comma, which a controller takes."""
    return content.decode().rstrip(",").split(",")
