"""Driver of a Bota Systems force/torque sensor on a serial line. It only listens.

The sensor streams by itself from when it is powered up, as it was set before by the manufacturer's program. Nothing
is sent: neither a bias, nor a setting, nor a request.
"""

import contextlib
import string
import time

import numpy as np
from numpy.typing import NDArray

from robot_drivers.bota.frames import STATUS_MAP, FrameDecoder, Frames
from robot_drivers.bota.sample_clock import SampleClock
from robot_drivers.bota.settings import BotaSettings
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceProtocolError, DeviceTimeoutError, DeviceUnreachableError
from robot_drivers.protocols import DeviceIdentity, FloatArray, IntArray, StreamStatistics, WrenchBlock
from robot_drivers.serial_line.line import SerialLine
from robot_drivers.serial_line.receiver import SerialReceiver

_MEASURED_FRAMES = 20
_BITS_PER_BYTE = 10  # start, 8 data, stop
_LOOK_S, _LONGEST_DISCARD_S = 0.01, 1.0
_TEXT = frozenset(string.printable.encode())


class _Listener:
    """Frames as they come, each with the time at which its last byte was found."""

    def __init__(self, line: SerialLine, settings: BotaSettings) -> None:
        _discard_waiting(line, settings.bit_rate / _BITS_PER_BYTE)
        self.receiver = SerialReceiver(line, settings.batch_s)
        self._decoder = FrameDecoder()
        self._bytes_read = 0
        self.heard = b""

    @property
    def damages(self) -> int:
        """How often a frame did not follow a frame."""
        return self._decoder.damages

    def take(self, timeout_s: float) -> tuple[Frames, IntArray]:
        """Return what is complete, and the receive stamps (n,); wait up to ``timeout_s`` for any byte."""
        ends, stamps, data = [], [], b""
        for chunk in self.receiver.take(timeout_s):
            data += chunk.data
            ends.append(self._bytes_read + len(data))
            stamps.append(chunk.host_time_ns)
        self._bytes_read += len(data)
        self.heard = (self.heard + data)[-64:]
        frames = self._decoder.feed(data)
        # frames that wait for a second one can have ended in a chunk before; they are stamped by this one
        of_chunk = np.searchsorted(np.array(ends, np.int64), frames.end)
        return frames, np.array(stamps, np.int64)[of_chunk]


class BotaSerial:
    """A :class:`~robot_drivers.protocols.ForceSensor` that streams by itself, used from one thread.

    Raises
    ------
    DeviceUnreachableError
        The port is not there, or has failed: then ``close`` and ``connect`` again; or nothing comes over it.
    DeviceProtocolError
        From ``connect``: what comes are no frames.
    """

    def __init__(self, settings: BotaSettings) -> None:
        self._settings = settings
        self._line: SerialLine | None = None
        self._identity: DeviceIdentity | None = None
        self._rate_hz = 0.0
        self._listener: _Listener | None = None
        self._clock = SampleClock(1.0)
        self._first: WrenchBlock | None = None

    @property
    def identity(self) -> DeviceIdentity:
        """Who the sensor is; known once connected."""
        if self._identity is None:
            raise self._not_connected()
        return self._identity

    def connect(self) -> None:
        """Open the line, and listen until there are frames enough to know how many come in a second."""
        self.close()
        settings = self._settings
        with contextlib.ExitStack() as on_failure:
            line = SerialLine(settings.port, settings.bit_rate, "N")
            on_failure.callback(line.close)
            times, status, temperature_c = self._listened(line)
            on_failure.pop_all()
        self._line = line
        self._rate_hz = settings.rate_hz or 1e6 / float(np.median(np.diff(times) % 2**32))
        self._identity = DeviceIdentity(
            kind="force sensor",
            model=settings.model,
            serial=settings.serial,
            address=settings.port,
            details={
                "bit rate": f"{settings.bit_rate} bit/s",
                "rate": f"{self._rate_hz:.6g} Hz" + ("" if settings.rate_hz else " (measured)"),
                "temperature": f"{temperature_c:.1f} °C",
                "status": "; ".join(STATUS_MAP.describe(status)) or "healthy",
            },
        )

    def start(self) -> None:
        """Begin to keep samples, and wait for the first one.

        Raises
        ------
        DeviceTimeoutError
            None came.
        """
        if self._line is None:
            raise self._not_connected()
        self.stop()
        self._listener = _Listener(self._line, self._settings)
        self._clock = SampleClock(self._rate_hz)
        first = self._block(self._listener, self._settings.start_timeout_s)
        if not len(first):
            self.stop()
            raise DeviceTimeoutError(
                f"force sensor on {self._settings.port} sent no frame in {self._settings.start_timeout_s} s: check its "
                "power"
            )
        self._first = first

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return everything that arrived since the last call; wait up to ``timeout_s`` for a first sample."""
        if self._listener is None:
            raise DeviceError(f"force sensor on {self._settings.port} was not started: call start() first")
        if self._first is None:
            return self._block(self._listener, timeout_s)
        first, self._first = self._first, None
        return _joined(first, self._block(self._listener, 0.0))

    def statistics(self) -> StreamStatistics:
        """Counts since the stream started; ``malformed`` counts damaged stretches."""
        clock = self._clock
        return StreamStatistics(
            received=clock.received,
            lost=clock.lost,
            duplicated=clock.duplicated,
            restarts=clock.restarts,
            malformed=self._listener.damages if self._listener is not None else 0,
        )

    def describe_status(self, status: int) -> tuple[str, ...]:
        """Return one line for each bit set in a status word."""
        return STATUS_MAP.describe(status)

    def stop(self) -> None:
        """Stop keeping samples; what has arrived can still be read. The sensor goes on by itself."""
        if self._listener is not None:
            self._listener.receiver.stop()

    def close(self) -> None:
        """Release the port."""
        self.stop()
        self._listener = self._first = None
        if self._line is not None:
            self._line.close()
            self._line = None

    def _not_connected(self) -> DeviceError:
        return DeviceError(f"force sensor on {self._settings.port} is not connected: call connect() first")

    def _listened(self, line: SerialLine) -> tuple[IntArray, int, float]:
        """Return the clock of some frames in a row, and status and temperature of the last."""
        listener = _Listener(line, self._settings)
        times = np.empty(0, np.int64)
        deadline_ns = host_time_ns() + round(self._settings.start_timeout_s * 1e9)
        try:
            while True:
                frames, _ = listener.take(max(0.0, (deadline_ns - host_time_ns()) * 1e-9))
                times = np.concatenate([times, frames.time_us])
                if len(times) >= _MEASURED_FRAMES or (len(times) > 1 and host_time_ns() >= deadline_ns):
                    return times, int(frames.status[-1]), float(frames.temperature_c[-1])
                if host_time_ns() >= deadline_ns:
                    raise self._nothing_of_use(listener.heard)
        finally:
            listener.receiver.stop()

    def _nothing_of_use(self, heard: bytes) -> DeviceError:
        where = f"on {self._settings.port} at {self._settings.bit_rate} bit/s"
        if not heard:
            return DeviceUnreachableError(
                f"no force sensor sends {where} in {self._settings.start_timeout_s} s: check power, cable and port"
            )
        if all(byte in _TEXT for byte in heard):
            return DeviceProtocolError(
                f"the force sensor {where} sends text: set it to binary frames, and to run, with its maker's program"
            )
        return DeviceProtocolError(
            f"what comes {where} are no frames of a Bota sensor: check bit rate and kind of device"
        )

    def _block(self, listener: _Listener, timeout_s: float) -> WrenchBlock:
        deadline_ns = host_time_ns() + round(timeout_s * 1e9)
        while True:
            frames, stamps = listener.take(max(0.0, (deadline_ns - host_time_ns()) * 1e-9))
            if len(stamps) or host_time_ns() >= deadline_ns:
                break
        placed = self._clock.place(frames.time_us, stamps)
        wrench = frames.wrench[placed.index]
        status = frames.status[placed.index]
        return WrenchBlock(
            counter=placed.counter,
            device_time_s=placed.device_time_s,
            host_time_ns=stamps[placed.index],
            status=status,
            usable=STATUS_MAP.usable(status) & self._in_range(wrench),
            wrench=wrench,
        )

    def _in_range(self, wrench: FloatArray) -> NDArray[np.bool_]:
        """Tell for each sample (n, 6) whether every axis is a number within its rating, (n,)."""
        rated = self._settings.rated_wrench
        largest = np.full(6, np.finfo(np.float32).max) if rated is None else np.array(rated)
        return np.logical_and.reduce(np.abs(wrench) <= largest, axis=-1)


def _discard_waiting(line: SerialLine, bytes_per_s: float) -> None:
    """Discard what is old: all that comes faster than the line can carry it has waited somewhere."""
    begin_ns = last_ns = host_time_ns()
    line.read()
    while last_ns - begin_ns < _LONGEST_DISCARD_S * 1e9:
        time.sleep(_LOOK_S)
        size, now_ns = len(line.read()), host_time_ns()
        if size <= bytes_per_s * (now_ns - last_ns) * 1e-9:
            return
        last_ns = now_ns


def _joined(first: WrenchBlock, second: WrenchBlock) -> WrenchBlock:
    names = ("counter", "device_time_s", "host_time_ns", "status", "usable", "wrench")
    return WrenchBlock(
        *(np.concatenate([getattr(block, name) for block in (first, second)]) for name in names)
    )
