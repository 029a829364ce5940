"""What all force sensors on a serial line share; the devices differ in how they are spoken to."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Literal, Protocol, TypeVar

from numpy import bool_
from numpy.typing import NDArray

from robot_drivers.ati.serial.framing import Decoder
from robot_drivers.ati.serial.stream import Samples, SampleStream
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceTimeoutError, DeviceUnreachableError
from robot_drivers.protocols import DeviceIdentity, FloatArray, StreamStatistics, WrenchBlock
from robot_drivers.serial_line.line import SILENCE_LIMIT_S, SILENCE_S, SerialLine
from robot_drivers.serial_line.receiver import SerialReceiver
from robot_drivers.setting_checks import check_positive

_LONGEST_PATIENCE_S = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialSettings:
    """How to reach a device on a serial line.

    Attributes
    ----------
    port : name of the port (``/dev/ttyUSB0``, ``COM3``) or a URL of pyserial (``socket://host:port``)
    bit_rate : of the line, bit/s; the same must be set at the device
    answer_timeout_s : longest wait for each answer
    start_timeout_s : longest wait of ``start`` for a first record
    silence_s : time without a good record after which the stream is begun anew, then at doubling intervals. The
        device may have been powered up anew; the requests move nothing
    batch_s : time between two looks at the line, by which receive stamps can be late
    """

    port: str
    bit_rate: int
    answer_timeout_s: float = 0.25
    start_timeout_s: float = 2.0
    silence_s: float = 1.0
    batch_s: float = 0.004

    def __post_init__(self) -> None:
        check_positive(
            self, "force sensor", "bit_rate", "answer_timeout_s", "start_timeout_s", "silence_s", "batch_s"
        )


class SerialDevice(Protocol):
    """A device that has been met on an open line."""

    @property
    def identity(self) -> DeviceIdentity:
        """Who it is."""

    @property
    def record_rate_hz(self) -> float:
        """Records per second of its stream, nominally."""

    def begin(self) -> Decoder:
        """Set a silent device up and have it stream; its first record is then the next on the line."""

    def interrupt(self) -> None:
        """Send what ends a stream."""

    def wrench(self, samples: Samples) -> tuple[FloatArray, NDArray[bool_]]:
        """Return the wrench (n, 6), N and N·m, and whether each sample may be used (n,)."""


D = TypeVar("D", bound=SerialDevice)


class SerialForceSensor(Generic[D]):
    """A :class:`~robot_drivers.protocols.ForceSensor` on a serial line, used from one thread.

    Records carry neither counter nor clock. The counter is the driver's own, with an estimate of what is missing
    (:mod:`robot_drivers.ati.serial.stream`); the device time is that counter over the record rate.

    Parameters
    ----------
    settings : how to reach the device
    parity : of the line; always 8 data bits and 1 stop bit
    meet : learns on an open line, where a stream may still be running, what device there is

    Raises
    ------
    DeviceUnreachableError
        Nothing answers; or the port has failed: then ``close`` and ``connect`` again.
    """

    def __init__(
        self, settings: SerialSettings, parity: Literal["N", "E"], meet: Callable[[SerialLine], D]
    ) -> None:
        self._settings = settings
        self._parity: Literal["N", "E"] = parity
        self._meet = meet
        self._line: SerialLine | None = None
        self._device: D | None = None
        self._stream: SampleStream | None = None
        self._streaming = False
        self._last_sign_ns = 0
        self._patience_s = settings.silence_s

    @property
    def identity(self) -> DeviceIdentity:
        """Who the sensor is; known once connected."""
        return self._connected()[1].identity

    def connect(self) -> None:
        """Open the line, end a stream that may still run, and learn who is there. Nothing is biased."""
        self.close()
        settings = self._settings
        with contextlib.ExitStack() as on_failure:
            line = SerialLine(settings.port, settings.bit_rate, self._parity)
            on_failure.callback(line.close)
            try:
                self._device = self._meet(line)
            except DeviceTimeoutError as error:
                raise DeviceUnreachableError(
                    f"no force sensor answers on {settings.port} at {settings.bit_rate} bit/s ({error}): "
                    "check power, cable, port and bit rate"
                ) from error
            on_failure.pop_all()
        self._line, self._stream = line, None

    def start(self) -> None:
        """Begin streaming and wait for the first record.

        Raises
        ------
        DeviceTimeoutError
            No record came.
        """
        line, device = self._connected()
        self.stop()
        decoder = device.begin()
        self._stream = SampleStream(
            SerialReceiver(line, self._settings.batch_s), decoder, device.record_rate_hz
        )
        self._streaming = True
        self._patience_s = self._settings.silence_s
        self._last_sign_ns = host_time_ns()
        if not self._stream.receiver.wait(self._settings.start_timeout_s):
            self.stop()
            raise DeviceTimeoutError(
                f"force sensor on {self._settings.port} answers but sent no record in "
                f"{self._settings.start_timeout_s} s: power it off and on"
            )

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return everything that arrived since the last call; wait up to ``timeout_s`` for a first sample.

        The newest few samples come with the next call: those that follow confirm them. After a long silence the
        stream is begun anew, which can take up to a second longer than ``timeout_s``.
        """
        if self._stream is None:
            raise DeviceError(f"force sensor on {self._settings.port} was not started: call start() first")
        _, device = self._connected()
        samples = self._stream.read(timeout_s)
        if len(samples.counter):
            self._last_sign_ns = host_time_ns()
            self._patience_s = self._settings.silence_s
        elif self._streaming:
            self._revive_when_silent(self._stream)
        wrench, usable = device.wrench(samples)
        return WrenchBlock(
            counter=samples.counter,
            device_time_s=samples.counter / device.record_rate_hz,
            host_time_ns=samples.host_time_ns,
            status=samples.status,
            usable=usable,
            wrench=wrench,
        )

    def statistics(self) -> StreamStatistics:
        """Counts since the stream started; ``lost`` is an estimate, ``malformed`` counts damaged stretches."""
        return self._stream.statistics if self._stream is not None else StreamStatistics()

    def stop(self) -> None:
        """Stop streaming; what has arrived can still be read.

        Raises
        ------
        DeviceTimeoutError
            The device goes on streaming.
        """
        if self._streaming and self._stream is not None:
            self._streaming = False
            _, device = self._connected()
            receiver = self._stream.receiver
            try:
                # a request that cannot be sent is like one that is lost on its way
                with contextlib.suppress(DeviceUnreachableError):
                    device.interrupt()
                silent = receiver.wait_until_silent(SILENCE_S, SILENCE_LIMIT_S)
            finally:
                receiver.stop()
            if not silent:
                raise DeviceTimeoutError(f"force sensor on {self._settings.port} does not stop streaming")

    def close(self) -> None:
        """Stop streaming and release the port."""
        try:
            self.stop()
        finally:
            if self._line is not None:
                self._line.close()
            self._line = self._device = None

    def _connected(self) -> tuple[SerialLine, D]:
        if self._line is None or self._device is None:
            raise DeviceError(f"force sensor on {self._settings.port} is not connected: call connect() first")
        return self._line, self._device

    def _revive_when_silent(self, stream: SampleStream) -> None:
        now_ns = host_time_ns()
        if now_ns - self._last_sign_ns < self._patience_s * 1e9:
            return
        self._last_sign_ns = now_ns
        self._patience_s = min(2 * self._patience_s, max(self._settings.silence_s, _LONGEST_PATIENCE_S))
        line, device = self._connected()
        stream.receiver.stop()
        # as long as the sensor is away nothing of this can succeed; that is the same silence
        with contextlib.suppress(DeviceError):
            device.interrupt()
            line.read_until_silent()
            decoder = device.begin()
            stream.resume(SerialReceiver(line, self._settings.batch_s), decoder)
            return
        stream.receiver = SerialReceiver(line, self._settings.batch_s)
