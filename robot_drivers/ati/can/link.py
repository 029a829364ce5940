"""Requests to one device on a CAN bus, and the frames that answer them."""

import threading
from dataclasses import dataclass

import can

from robot_drivers.clock import host_time_ns, wall_to_monotonic_offset_ns
from robot_drivers.errors import DeviceTimeoutError, DeviceUnreachableError

_CLOCK_COMPARISON_NS = 100_000


@dataclass(frozen=True, slots=True)
class Request:
    """A frame to send and the frames to wait for, each as (identifier, bytes of data), in their order."""

    name: str
    identifier: int
    data: bytes = b""
    answers: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Answer:
    """The data of the frames that answered a request, in order, and host times in ns.

    ``received_ns`` is the stamp of the bus adapter where that lies between request and reading, else the time of
    reading.
    """

    frames: tuple[bytes, ...]
    requested_ns: int
    received_ns: int


def open_bus(interface: str, channel: str, bitrate: int) -> can.BusABC:
    """Open a bus of python-can; raises DeviceUnreachableError where there is none."""
    try:
        return can.Bus(channel=channel, interface=interface, bitrate=bitrate)
    except (can.CanError, OSError) as error:
        raise DeviceUnreachableError(
            f"CAN bus {interface}:{channel} cannot be opened ({error}): "
            "check the adapter, and that the interface is up"
        ) from error


class CanLink:
    """One device on a bus. Requests of several threads follow each other.

    Parameters
    ----------
    bus : open bus
    device : what to call the device in messages
    timeout_s : longest wait for an answer

    Attributes
    ----------
    malformed : awaited frames of another length than expected
    """

    def __init__(self, bus: can.BusABC, device: str, timeout_s: float) -> None:
        self.malformed = 0
        self._bus = bus
        self._device = device
        self._timeout_s = timeout_s
        self._one_request = threading.Lock()

    def ask(self, request: Request) -> Answer:
        """Send a request and wait for its whole answer; one without ``answers`` is only sent.

        Raises
        ------
        DeviceTimeoutError
            No answer, or not all of it.
        DeviceUnreachableError
            The bus does not work.
        """
        message = can.Message(arbitration_id=request.identifier, data=request.data, is_extended_id=False)
        with self._one_request:
            try:
                self._discard(0.0)
                requested_ns = host_time_ns()
                self._bus.send(message, timeout=self._timeout_s)
                return self._collect(request, requested_ns)
            except can.CanError as error:
                raise DeviceUnreachableError(
                    f"CAN bus {self._bus.channel_info} fails ({error}): "
                    "check adapter, bit rate and termination"
                ) from error

    def wait_for_silence(self) -> None:
        """Discard what comes until nothing has come for the time that an answer may take."""
        with self._one_request:
            self._discard(self._timeout_s)

    def _collect(self, request: Request, requested_ns: int) -> Answer:
        deadline_ns = requested_ns + round(self._timeout_s * 1e9)
        first_identifier = request.answers[0][0] if request.answers else None
        frames: list[bytes] = []
        received_ns = requested_ns
        while len(frames) < len(request.answers):
            message = self._bus.recv(max(0.0, (deadline_ns - host_time_ns()) * 1e-9))
            if message is None:
                raise DeviceTimeoutError(
                    f"{self._device} answered {len(frames)} of {len(request.answers)} frames to "
                    f"{request.name} in {self._timeout_s} s: check power, base identifier, bit rate and "
                    "termination"
                )
            if not message.is_extended_id and message.arbitration_id == first_identifier:
                frames.clear()  # what came before belongs to an answer that was cut off
            identifier, length = request.answers[len(frames)]
            if message.is_extended_id or message.arbitration_id != identifier:
                continue
            if len(message.data) != length:
                self.malformed += 1
                frames.clear()  # nothing of this answer may be mixed with the next
                continue
            received_ns = received_ns if frames else _stamp(message, requested_ns)
            frames.append(bytes(message.data))
        return Answer(tuple(frames), requested_ns, received_ns)

    def _discard(self, silence_s: float) -> None:
        while self._bus.recv(silence_s) is not None:
            pass


def _stamp(message: can.Message, requested_ns: int) -> int:
    """Return the time of arrival on the host clock; adapters stamp by the wall clock or by one of their own."""
    now_ns = host_time_ns()
    stamp_ns = round(message.timestamp * 1e9) + wall_to_monotonic_offset_ns()
    plausible = requested_ns - _CLOCK_COMPARISON_NS <= stamp_ns <= now_ns + _CLOCK_COMPARISON_NS
    return stamp_ns if plausible else now_ns
