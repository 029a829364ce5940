"""Requests to a NETCANOEM board over a CAN bus, and their answers."""

from dataclasses import dataclass

import can

from robot_drivers.ati.netcanoem.frames import ANSWER_LENGTHS, Opcode, identifier
from robot_drivers.clock import host_time_ns, wall_to_host_offset_ns
from robot_drivers.errors import DeviceProtocolError, DeviceTimeoutError, DeviceUnreachableError

_CLOCK_COMPARISON_NS = 100_000


@dataclass(frozen=True, slots=True)
class Answer:
    """The frames that answered a request, in the order of the manual, and host times in ns.

    ``received_ns`` is the stamp of the bus adapter where that lies between request and reading, else the time of
    reading.
    """

    frames: tuple[bytes, ...]
    requested_ns: int
    received_ns: int


class BoardLink:
    """One board on a bus.

    Attributes
    ----------
    malformed : frames of the board with a length that the manual does not allow
    """

    def __init__(self, bus: can.BusABC, base: int, timeout_s: float) -> None:
        self.malformed = 0
        self._bus = bus
        self._timeout_s = timeout_s
        self._identifiers = {identifier(base, opcode): opcode for opcode in Opcode}
        self._base = base

    def ask(self, opcode: Opcode, data: bytes = b"") -> Answer:
        """Send a request and wait for its whole answer.

        Raises
        ------
        DeviceTimeoutError
            No answer, or not all of it.
        DeviceUnreachableError
            The bus does not work.
        """
        try:
            self._discard_what_came_too_late()
            requested_ns = host_time_ns()
            request = can.Message(
                arbitration_id=identifier(self._base, opcode), data=data, is_extended_id=False
            )
            self._bus.send(request, timeout=self._timeout_s)
            return self._collect(opcode, requested_ns)
        except can.CanError as error:
            raise DeviceUnreachableError(
                f"CAN bus {self._bus.channel_info} fails ({error}): check adapter, bit rate and termination"
            ) from error

    def select_calibration(self, calibration: int) -> None:
        """Make a calibration slot the active one; after a reset of the board it is slot 0 again.

        Raises
        ------
        DeviceProtocolError
            The board selected another one.
        """
        (echo,) = self.ask(Opcode.CALIBRATION, bytes([calibration])).frames
        if echo[0] != calibration:
            raise DeviceProtocolError(f"the board selected calibration {echo[0]} instead of {calibration}")

    def _collect(self, opcode: Opcode, requested_ns: int) -> Answer:
        deadline_ns = requested_ns + round(self._timeout_s * 1e9)
        missing = list(ANSWER_LENGTHS[opcode].items())
        frames: list[bytes] = []
        received_ns = 0
        while missing:
            message = self._bus.recv(max(0.0, (deadline_ns - host_time_ns()) * 1e-9))
            if message is None:
                raise DeviceTimeoutError(
                    f"NETCANOEM board with base {self._base:#04x} answered {len(frames)} of "
                    f"{len(ANSWER_LENGTHS[opcode])} frames to {opcode.name} in {self._timeout_s} s: "
                    "check power, base identifier, bit rate and termination"
                )
            expected, length = missing[0]
            if message.is_extended_id or self._identifiers.get(message.arbitration_id) is not expected:
                continue
            if len(message.data) != length:
                self.malformed += 1
                continue
            received_ns = received_ns or _stamp(message, requested_ns)
            frames.append(bytes(message.data))
            missing.pop(0)
        return Answer(tuple(frames), requested_ns, received_ns)

    def _discard_what_came_too_late(self) -> None:
        while self._bus.recv(0.0) is not None:
            pass


def _stamp(message: can.Message, requested_ns: int) -> int:
    """Return the time of arrival on the host clock; adapters stamp by the wall clock or by one of their own."""
    now_ns = host_time_ns()
    stamp_ns = round(message.timestamp * 1e9) + wall_to_host_offset_ns()
    plausible = requested_ns - _CLOCK_COMPARISON_NS <= stamp_ns <= now_ns + _CLOCK_COMPARISON_NS
    return stamp_ns if plausible else now_ns
