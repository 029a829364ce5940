"""An emulated GigE Vision camera on UDP, from two threads of its own: one answers, one exposes and sends."""

import ipaddress
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np

from robot_drivers.clock import host_time_ns, seconds_until
from robot_drivers.closing import ClosedAtExit
from robot_drivers.emulated_clock import ClockError
from robot_drivers.genicam.emulator import description as of
from robot_drivers.genicam.emulator.control import PORT, ControlChannel
from robot_drivers.genicam.emulator.exposure import DepthSource, Exposure, ImageSource
from robot_drivers.genicam.emulator.registers import (
    MULTIPART,
    STREAM_ADDRESS,
    STREAM_CONFIGURATION,
    STREAM_PACKET_SIZE,
    STREAM_PORT,
    Registers,
)
from robot_drivers.genicam.emulator.settings import (
    PIXEL_FORMATS,
    GigECameraSettings,
    GigEDepthSettings,
    GigEFaults,
)
from robot_drivers.genicam.emulator.stream import Block, MultipartBlock, test_packet

_LONGEST_WAIT_S = 0.02
_FIRE_TEST = 0x8000_0000
_PACKET_SIZE_MASK = 0xFFFF
_TIMESTAMP_SELECTOR = 1
_CHUNK_BYTES = 8 + 8 + 8  # information of the image's chunk, the time, information of the time's chunk
_LISTENING, _SLAVE, _MASTER, _DISABLED = (
    of.PTP_STATES.index(name) for name in ("Listening", "Slave", "Master", "Disabled")
)


class GigECameraEmulator(ClosedAtExit):
    """A camera that sees ``source``, and where it sends depth ``depth_source``.

    It answers from construction until :meth:`close`.
    """

    def __init__(
        self,
        source: ImageSource,
        settings: GigECameraSettings | None = None,
        seed: int = 0,
        depth_source: DepthSource | None = None,
    ) -> None:
        self._source, self._depth_source = source, depth_source
        self.settings = settings or GigECameraSettings()
        self._random = np.random.default_rng(seed)
        self._readout_ns = round(self.settings.readout_s * 1e9)
        self._born_ns = self._booted_ns = host_time_ns()
        self._faults, self._injected_ns, self._restart_due = GigEFaults(), self._born_ns, False
        self._clock_error = ClockError()
        self._to_drop = 0
        self._lock = threading.RLock()
        self._power_up()
        self._control_socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._control_socket.bind((self.settings.host, PORT))
        except OSError:
            self._control_socket.close()
            raise
        self._stream_socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._stream_socket.bind((self.settings.host, 0))
        self._closing = threading.Event()
        name = f"GigE camera on {self.settings.host}"
        self._threads = [threading.Thread(target=work, name=name) for work in (self._answer, self._transmit)]
        for thread in self._threads:
            thread.start()

    def inject(self, faults: GigEFaults) -> None:
        """Replace the faults in force; ``GigEFaults()`` ends them."""
        with self._lock:
            self._faults, self._injected_ns, self._restart_due = faults, host_time_ns(), True

    def drop(self, images: int) -> None:
        """Lose the next images on their way."""
        with self._lock:
            self._to_drop += images

    def disturb_clock(self, jump_s: float, drift_ppm: float) -> None:
        """Let the camera's own clock jump, and drift from now on."""
        with self._lock:
            self._clock_error = self._clock_error.disturbed(self._awake_s(), jump_s, drift_ppm)

    @property
    def behind_s(self) -> float:
        """How late the next image is, s; 0 while nobody has it transmit."""
        return max(0.0, (host_time_ns() - self._leaving_ns()) * 1e-9) if self._acquiring else 0.0

    @property
    def born_ns(self) -> int:
        """Host time from which the times of the sources count."""
        return self._born_ns

    def close(self) -> None:
        """Switch the camera off."""
        if not self._closing.is_set():
            self._closing.set()
            for thread in self._threads:
                thread.join()
            self._control_socket.close()
            self._stream_socket.close()

    def _power_up(self) -> None:
        self._booted_ns = host_time_ns()
        self._chunk_enabled = False
        self._components = {of.COMPONENTS["Intensity"]}
        self._leaving: deque[tuple[int, list[bytes]]] = deque()
        self._ptp_since_ns: int | None = None
        self._number, self._next_ns = 0, 0
        self._under_way_ns: int | None = None
        self._acquiring = False
        self._registers = Registers(
            self.settings,
            {
                of.PAYLOAD_SIZE: self._payload_size,
                of.CHUNK_ENABLE: lambda: int(self._chunk_enabled and self._selected_timestamp()),
                of.PTP_STATUS: self._ptp_status,
                **({} if self.settings.depth is None else self._of_components(self.settings.depth)),
            },
        )
        self._control = ControlChannel(self._registers, self._written)

    def _answer(self) -> None:
        """Answer requests, whatever time an exposure takes."""
        while not self._closing.is_set():
            asked, _, _ = select.select([self._control_socket], [], [], _LONGEST_WAIT_S)
            with self._lock:
                if self._restart_due and self._elapsed_s() >= self._faults.restart_at_s:
                    self._restart_due = False
                    self._power_up()
                if asked:
                    request, peer = self._control_socket.recvfrom(2048)
                    answer = self._control.answer(request, peer) if self._reachable() else None
                    if answer is not None:
                        self._control_socket.sendto(answer, peer)
                if self._acquiring and not self._control.controlled:
                    self._stop()

    def _transmit(self) -> None:
        """Expose, and send what was exposed."""
        while not self._closing.wait(self._pause_s()):
            with self._lock:
                exposure = self._begun()
            if exposure is not None:
                time_s = (exposure.due_ns - self._born_ns) * 1e-9
                block = exposure.block(time_s, self.settings, self._source, self._depth_source)
                with self._lock:
                    self._end(exposure, block)
            with self._lock:
                self._send()

    def _pause_s(self) -> float:
        if not self._acquiring:
            return _LONGEST_WAIT_S
        return min(seconds_until(min(self._next_ns, self._leaving_ns())), _LONGEST_WAIT_S)

    def _leaving_ns(self) -> int:
        """Return when the next image leaves the camera; without the lock, which others must not wait for."""
        try:
            return self._leaving[0][0]
        except IndexError:
            return (self._under_way_ns or self._next_ns) + self._readout_ns

    def _elapsed_s(self) -> float:
        return (host_time_ns() - self._injected_ns) * 1e-9

    def _reachable(self) -> bool:
        return not self._faults.out_of_reach(self._elapsed_s())

    def _stop(self) -> None:
        self._acquiring = False
        self._leaving.clear()

    def _begun(self) -> Exposure | None:
        """Begin the exposure that is due; None where none is, or its image gets lost."""
        due_ns = self._next_ns
        if not self._acquiring or host_time_ns() < due_ns:
            return None
        self._next_ns += round(1e9 / self.settings.fps)
        extended = self._extended_ids()
        self._number = self._number + 1 if extended else self._number % 0xFFFF + 1
        dropped = self._to_drop > 0
        self._to_drop -= dropped
        sent = self._reachable() and not self._faults.stalled
        if not sent or dropped or self._random.random() < self._faults.loss:
            return None
        self._under_way_ns = due_ns
        asked = (self._in_parts(), self._chunks_on(), extended)
        return Exposure(self._number, due_ns, self._clock(due_ns), *asked, self._booted_ns)

    def _end(self, exposure: Exposure, block: Block | MultipartBlock) -> None:
        """Have an exposure leave the camera once it is read out, unless the camera was stopped meanwhile."""
        self._under_way_ns = None
        if not self._acquiring or exposure.booted_ns != self._booted_ns:
            return
        packets = block.packets(self._registers.read(STREAM_PACKET_SIZE) & _PACKET_SIZE_MASK)
        if self._random.random() < self._faults.packet_loss:
            del packets[int(self._random.integers(1, len(packets) - 1))]
        self._leaving.append((exposure.due_ns + self._readout_ns, packets))

    def _send(self) -> None:
        while self._leaving and host_time_ns() >= self._leaving[0][0]:
            for packet in self._leaving.popleft()[1]:
                self._stream_socket.sendto(packet, self._destination())

    def _written(self, address: int, value: int) -> None:
        if address == STREAM_PACKET_SIZE and value & _FIRE_TEST:
            self._registers.write(address, value & ~_FIRE_TEST)
            self._stream_socket.sendto(test_packet(value & _PACKET_SIZE_MASK), self._destination())
        elif address == of.ACQUISITION_START:
            self._acquiring, self._next_ns = True, host_time_ns()
        elif address == of.ACQUISITION_STOP:
            self._stop()
        elif address == of.COMPONENT_ENABLE and self.settings.depth is not None:
            change = self._components.add if value else self._components.discard
            change(self._registers.read(of.COMPONENT_SELECTOR))
        elif address == of.CHUNK_ENABLE and self._selected_timestamp():
            self._chunk_enabled = value == 1
        elif address == of.PTP_ENABLE:
            self._ptp_since_ns = host_time_ns() if value else None

    def _destination(self) -> tuple[str, int]:
        address = ipaddress.IPv4Address(self._registers.read(STREAM_ADDRESS))
        return str(address), self._registers.read(STREAM_PORT) & 0xFFFF

    def _selected_timestamp(self) -> bool:
        return self._registers.read(of.CHUNK_SELECTOR) == _TIMESTAMP_SELECTOR

    def _chunks_on(self) -> bool:
        return self._chunk_enabled and self._registers.read(of.CHUNK_MODE) == 1

    def _of_components(self, depth: GigEDepthSettings) -> dict[int, Callable[[], int]]:
        """Return what the registers tell that depend on the selected component."""
        formats = {
            of.COMPONENTS["Intensity"]: PIXEL_FORMATS[self.settings.pixel_format],
            of.COMPONENTS["Range"]: PIXEL_FORMATS[depth.depth_format],
        }
        return {
            of.COMPONENT_ENABLE: lambda: self._registers.read(of.COMPONENT_SELECTOR) in self._components,
            of.PIXEL_FORMAT: lambda: formats.get(self._registers.read(of.COMPONENT_SELECTOR), 0),
        }

    def _in_parts(self) -> bool:
        asked = bool(self._registers.read(STREAM_CONFIGURATION) & MULTIPART)
        return asked and of.COMPONENTS["Range"] in self._components

    def _extended_ids(self) -> bool:
        return self.settings.depth is not None and self._registers.read(of.EXTENDED_IDS) == 1

    def _payload_size(self) -> int:
        if self._in_parts():
            return self.settings.image_bytes + self.settings.depth_bytes
        return self.settings.image_bytes + (_CHUNK_BYTES if self._chunks_on() else 0)

    def _ptp_status(self) -> int:
        if self._ptp_since_ns is None:
            return _DISABLED
        if self.settings.ptp == "never" or (
            (host_time_ns() - self._ptp_since_ns) * 1e-9 < self.settings.ptp_settle_s
        ):
            return _LISTENING
        return _SLAVE if self.settings.ptp == "slave" else _MASTER

    def _awake_s(self) -> float:
        return (host_time_ns() - self._booted_ns) * 1e-9

    def _clock(self, at_ns: int) -> int:
        """Return the camera's clock, in ticks of 1 ns, at a host time."""
        if self._ptp_status() == _SLAVE:
            return at_ns + time.time_ns() - host_time_ns()
        awake_s = (at_ns - self._booted_ns) * 1e-9
        own_s = awake_s * (1 + self.settings.clock_ppm * 1e-6) + self._clock_error.at(awake_s)
        return max(0, round(own_s * 1e9))
