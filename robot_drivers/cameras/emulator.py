"""A camera on the loopback interface that free-runs and serves lossless images to whoever opens its URL.

The stream is YUV4MPEG2 with the ``mono`` colour space: one header line, then for every image the line
``FRAME`` and the bytes of the image. FFmpeg, and so ``cv2.VideoCapture``, opens it by URL at the first image,
passes it on bit for bit and holds nothing back. A Bayer mosaic travels as grey levels, as it does from a real
camera in raw mode.

Sources: yuv4mpeg(5) of mjpegtools for the stream; for the embedded information the Flea3 technical reference,
register FRAME_INFO 12F8h, and IEEE 1394 for the cycle time (24.576 MHz = 8000 cycles of 3072 offsets a
second).
"""

import math
import random
import socket
import struct
import threading
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from robot_drivers.clock import host_time_ns, seconds_until
from robot_drivers.closing import ClosedAtExit
from robot_drivers.emulated_clock import ClockError
from robot_drivers.emulated_outages import Outages
from robot_drivers.errors import ConfigurationError

ImageSource = Callable[[float], NDArray[np.uint8]]

_PRESENT = 0x8000_0000
_TIMESTAMP = 0x001
_FRAME_COUNTER = 0x040
_FRAME_INFO_BITS = 10
_POLL_S = 0.05


@dataclass(frozen=True, slots=True)
class BusClock:
    """The cycle timer that all cameras on one bus share: at host time ``origin_ns`` it shows ``offset_s``.

    It gains ``drift`` seconds per host second.
    """

    origin_ns: int
    offset_s: float = 0.0
    drift: float = 0.0

    def time_s(self, host_ns: int) -> float:
        """Return the bus time, s, at a host time."""
        return self.offset_s + (1.0 + self.drift) * (host_ns - self.origin_ns) * 1e-9

    def host_time_ns(self, time_s: float) -> int:
        """Return the host time at a bus time, s."""
        return self.origin_ns + round((time_s - self.offset_s) / (1.0 + self.drift) * 1e9)


@dataclass(frozen=True, slots=True)
class CameraEmulatorSettings:
    """What the emulated camera is set to.

    Attributes
    ----------
    width, height : image size, px
    fps : images per second of bus time; exposures fall on its multiples, so cameras of one clock expose
        together
    buffered : images that wait for a client or a machine that is late; beyond that exposures are missed
    readout_s : from an exposure until its image begins to leave the camera, as long as the image is there by then
    bind_address, port : where it listens; port 0 takes any free one
    send_timeout_s : a client that takes no image for so long is left
    frame_info : the register 12F8h; by default cycle time and frame counter are embedded, 0x8000_0000 embeds
        nothing
    """

    width: int = 1288
    height: int = 964
    fps: float = 15.0
    buffered: int = 0
    readout_s: float = 0.0
    bind_address: str = "127.0.0.1"
    port: int = 0
    send_timeout_s: float = 2.0
    frame_info: int = _PRESENT | _TIMESTAMP | _FRAME_COUNTER

    def __post_init__(self) -> None:
        if self.width < 4 * _FRAME_INFO_BITS or self.height < 1 or not self.fps > 0:
            raise ConfigurationError(
                f"camera emulator: {self.width}x{self.height} at {self.fps:g}/s; use at least 40x1 and a "
                "positive rate"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraFaults(Outages):
    """Departures from a healthy camera; the default is none. Times count from the injection.

    Attributes
    ----------
    loss : probability of each image to be exposed and counted but not sent
    delay_s : extra time that every image spends on its way
    slow_start_s : time between a client's connection and the first image
    saturated : everything is overexposed
    unplug_at_s, unplug_for_s : the cable is out meanwhile; the camera goes on counting
    restart_at_s, restart_for_s : the camera has no power meanwhile, and then counts from 0
    """

    loss: float = 0.0
    delay_s: float = 0.0
    slow_start_s: float = 0.0
    saturated: bool = False


class CameraEmulator(ClosedAtExit):
    """A camera at ``url`` whose images come from ``image_source(bus time in s)``: uint8, (height, width).

    It runs from construction to :meth:`close`, serves one client at a time, and calls the source only for
    images that it sends. When the source or the client falls behind the frame rate by more than is buffered,
    exposures are missed; as in a camera, the embedded counter tells.

    Attributes
    ----------
    port : int
    url : str, for :class:`robot_drivers.cameras.opencv_capture.OpenCVCameraSettings`
    """

    def __init__(
        self,
        image_source: ImageSource,
        settings: CameraEmulatorSettings | None = None,
        clock: BusClock | None = None,
        seed: int = 0,
    ) -> None:
        self._random = random.Random(seed)
        self._faults = CameraFaults()
        self._injected_ns = host_time_ns()
        self._restart_due = False
        self._clock_error = ClockError()
        self._image_source = image_source
        self._settings = settings or CameraEmulatorSettings()
        self._clock = clock or BusClock(host_time_ns())
        self._first_exposure = self._next_exposure()
        self._due_ns: int | None = None
        self._stopping = threading.Event()
        self._stalled = threading.Event()
        self._disconnecting = threading.Event()
        self._to_drop = 0
        self._listener = socket.create_server((self._settings.bind_address, self._settings.port))
        self._listener.settimeout(_POLL_S)
        self.port: int = self._listener.getsockname()[1]
        self.url = f"tcp://{self._settings.bind_address}:{self.port}"
        self._thread = threading.Thread(target=self._serve, name=f"camera emulator {self.port}")
        self._thread.start()

    @property
    def behind_s(self) -> float:
        """How late the next image is, s; 0 while nobody opens the stream."""
        due_ns = self._due_ns
        return 0.0 if due_ns is None else max(0.0, (host_time_ns() - due_ns) * 1e-9)

    def close(self) -> None:
        """End the stream and stop listening."""
        self._stopping.set()
        self._thread.join()
        self._listener.close()

    def inject(self, faults: CameraFaults) -> None:
        """Replace the faults in force; ``CameraFaults()`` ends them."""
        self._injected_ns = host_time_ns()
        self._restart_due = True
        self._faults = faults

    def disturb_clock(self, jump_s: float, drift_ppm: float) -> None:
        """Fault: the cycle time in the images jumps, and drifts from now on."""
        now_s = self._clock.time_s(host_time_ns())
        self._clock_error = self._clock_error.disturbed(now_s, jump_s, drift_ppm)

    def drop(self, frames: int) -> None:
        """Fault: expose and count the next ``frames`` images without sending them."""
        self._to_drop = frames

    def stall(self) -> None:
        """Fault: send nothing until :meth:`resume`; the camera goes on counting."""
        self._stalled.set()

    def resume(self) -> None:
        """End a :meth:`stall`."""
        self._stalled.clear()

    def disconnect(self) -> None:
        """Fault: break the connection; the client may open the URL again."""
        self._disconnecting.set()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            try:
                connection, _ = self._listener.accept()
            except TimeoutError:
                continue
            with connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                connection.settimeout(self._settings.send_timeout_s)
                self._disconnecting.clear()
                if self._unreachable():
                    continue
                try:
                    self._stream(connection)
                except (ConnectionError, TimeoutError):
                    continue  # the client has left, or no longer reads
                finally:
                    self._due_ns = None

    def _stream(self, connection: socket.socket) -> None:
        settings = self._settings
        rate = Fraction(settings.fps).limit_denominator(1001)
        size_and_rate = f"W{settings.width} H{settings.height} F{rate.numerator}:{rate.denominator}"
        connection.sendall(f"YUV4MPEG2 {size_and_rate} Ip A1:1 Cmono XCOLORRANGE=FULL\n".encode())
        self._stopping.wait(self._faults.slow_start_s)
        exposure = self._next_exposure()
        while True:
            time_s = exposure / settings.fps
            self._due_ns = self._clock.host_time_ns(time_s + settings.readout_s)
            self._wait_until(time_s)
            if self._stopping.is_set() or self._disconnecting.is_set() or self._unreachable():
                return
            if self._to_drop:
                self._to_drop -= 1
            elif not (self._stalled.is_set() or self._random.random() < self._faults.loss):
                image = self._expose(time_s, exposure - self._first_exposure)
                self._wait_until(time_s + settings.readout_s)
                self._stopping.wait(self._faults.delay_s)
                connection.sendall(b"FRAME\n")
                connection.sendall(image.data)
            exposure = max(exposure + 1, self._next_exposure() - settings.buffered)

    def _wait_until(self, time_s: float) -> None:
        time_ns = self._clock.host_time_ns(time_s)
        while (pause_s := seconds_until(time_ns)) > 0.0 and not self._stopping.wait(pause_s):
            pass

    def _unreachable(self) -> bool:
        elapsed_s = (host_time_ns() - self._injected_ns) * 1e-9
        faults = self._faults
        if self._restart_due and elapsed_s >= faults.restart_at_s:
            self._restart_due = False
            back_ns = self._injected_ns + round((faults.restart_at_s + faults.restart_for_s) * 1e9)
            self._first_exposure = math.ceil(self._clock.time_s(back_ns) * self._settings.fps)
        return faults.out_of_reach(elapsed_s)

    def _next_exposure(self) -> int:
        return math.ceil(self._clock.time_s(host_time_ns()) * self._settings.fps)

    def _expose(self, time_s: float, counter: int) -> NDArray[np.uint8]:
        image = self._image_source(time_s)
        shape = (self._settings.height, self._settings.width)
        if image.shape != shape or image.dtype != np.uint8:
            raise ConfigurationError(
                f"camera emulator: the image source gave {image.dtype} {image.shape}; it must give uint8 "
                f"{shape}"
            )
        information = self._frame_information(time_s + self._clock_error.at(time_s), counter)
        image = np.full(shape, 255, np.uint8) if self._faults.saturated else np.array(image, order="C")
        image[0, : len(information)] = np.frombuffer(information, np.uint8)
        return image

    def _frame_information(self, time_s: float, counter: int) -> bytes:
        """Return four bytes for every bit of FRAME_INFO that is on, lowest bit first; other items are 0."""
        values = {_TIMESTAMP: _cycle_time(time_s), _FRAME_COUNTER: counter % (1 << 32)}
        bits = (1 << place for place in range(_FRAME_INFO_BITS))
        return b"".join(
            struct.pack(">I", values.get(bit, 0)) for bit in bits if self._settings.frame_info & bit
        )


def _cycle_time(time_s: float) -> int:
    ticks = math.floor(time_s * 24_576_000)
    return (ticks // 24_576_000 % 128) << 25 | (ticks // 3072 % 8000) << 12 | ticks % 3072
