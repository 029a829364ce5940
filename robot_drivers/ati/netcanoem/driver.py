"""Driver of an ATI NETCANOEM board.

The board has neither a counter nor a clock: a sample's counter is the number of its request, and its device
time the time of that request since the start, on the host clock. It has no bias command either: as the
conversion is linear, a bias subtracted from the wrench is the same as one subtracted from the gages.
"""

from dataclasses import dataclass

import can
import numpy as np

from robot_drivers.ati.netcanoem.frames import (
    CRITICAL_STATUS,
    STATUS_WORDS,
    Opcode,
    decode_firmware,
    decode_gages,
    decode_matrix,
    decode_scaling,
    decode_serial,
)
from robot_drivers.ati.netcanoem.link import BoardLink
from robot_drivers.ati.netcanoem.poller import GageSample, Poller
from robot_drivers.ati.netcanoem.settings import NetCANOEMSettings
from robot_drivers.ati.scaling import Scaling
from robot_drivers.ati.status import describe
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError, DeviceFaultError, DeviceUnreachableError
from robot_drivers.protocols import DeviceIdentity, FloatArray, StreamStatistics, WrenchBlock

_FIRMWARE_THAT_TELLS_UNITS = (3, 7)
_FULL_GAGE = 0x7FFF  # at either end of its range a gage is saturated, or its cable broken


@dataclass(frozen=True, slots=True)
class _Board:
    """What the board told at connection."""

    serial: str
    firmware: tuple[int, int, int]
    scaling: Scaling
    si_per_gage: FloatArray


class NetCANOEM:
    """A :class:`~robot_drivers.protocols.ForceSensor` on a NETCANOEM board, polled from ``start`` to ``stop``.

    Raises
    ------
    DeviceUnreachableError, DeviceTimeoutError, DeviceProtocolError, DeviceFaultError
        From ``connect``: there is no such bus, no board answers, or it is not fit for use. ``read`` raises the
        first when the bus fails and the third when the board does not select its calibration again after a
        silence; a silent board gives empty blocks.
    """

    def __init__(self, settings: NetCANOEMSettings) -> None:
        self._settings = settings
        self._bus: can.BusABC | None = None
        self._board: _Board | None = None
        self._poller: Poller | None = None
        self._start_ns = 0

    @property
    def identity(self) -> DeviceIdentity:
        """Who the sensor is; known once connected."""
        _, board = self._connected()
        scaling, settings = board.scaling, self._settings
        return DeviceIdentity(
            kind="force sensor",
            model="ATI NETCANOEM",
            serial=board.serial,
            address=f"{settings.interface}:{settings.channel}, base {settings.base:#04x}",
            details={
                "firmware": "{}.{} build {}".format(*board.firmware),
                "calibration": str(settings.calibration),
                "units": f"{scaling.force_unit}, {scaling.torque_unit}",
                "counts per unit": f"{scaling.counts_per_force:g}, {scaling.counts_per_torque:g}",
            },
        )

    def connect(self) -> None:
        """Open the bus, select the calibration and read it."""
        self.close()
        settings = self._settings
        try:
            self._bus = can.Bus(
                channel=settings.channel, interface=settings.interface, bitrate=settings.bitrate
            )
        except (can.CanError, OSError) as error:
            raise DeviceUnreachableError(
                f"CAN bus {settings.interface}:{settings.channel} cannot be opened ({error}): "
                "check the adapter, and that the interface is up"
            ) from error
        try:
            self._board = _read_board(self._link(self._bus), settings.calibration)
        except DeviceError:
            self.close()
            raise

    def start(self) -> None:
        """Begin polling."""
        bus, _ = self._connected()
        self.stop()
        self._start_ns = host_time_ns()
        self._poller = Poller(self._link(bus), self._settings.calibration, self._settings.rate_hz)

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return everything that arrived since the last call; wait up to ``timeout_s`` for a first sample."""
        if self._poller is None:
            raise DeviceError(
                f"NETCANOEM board on {self._settings.channel} was not started: call start() first"
            )
        return self._block(self._poller.take(timeout_s))

    def statistics(self) -> StreamStatistics:
        """Return the counts of this stream."""
        return self._poller.statistics if self._poller else StreamStatistics()

    def describe_status(self, status: int) -> tuple[str, ...]:
        """Return one line for each bit set in a status word."""
        return describe(status, STATUS_WORDS)

    def stop(self) -> None:
        """End polling; what has arrived can still be read."""
        if self._poller is not None:
            self._poller.stop()

    def close(self) -> None:
        """End polling and leave the bus."""
        self.stop()
        self._poller = None
        self._board = None
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None

    def _connected(self) -> tuple[can.BusABC, _Board]:
        if self._bus is None or self._board is None:
            raise DeviceError(
                f"NETCANOEM board on {self._settings.channel} is not connected: call connect() first"
            )
        return self._bus, self._board

    def _link(self, bus: can.BusABC) -> BoardLink:
        return BoardLink(bus, self._settings.base, self._settings.answer_timeout_s)

    def _block(self, samples: list[GageSample]) -> WrenchBlock:
        _, board = self._connected()
        gages = np.array([sample.gages for sample in samples], np.int64).reshape(-1, 6)
        status = np.array([sample.status for sample in samples], np.int64)
        requested_ns = np.array([sample.requested_ns for sample in samples], np.int64)
        wrench = gages @ board.si_per_gage.T
        sound = (status & CRITICAL_STATUS) == 0
        unsaturated = ((gages > -_FULL_GAGE - 1) & (gages < _FULL_GAGE)).all(axis=1)
        return WrenchBlock(
            counter=np.array([sample.counter for sample in samples], np.int64),
            device_time_s=(requested_ns - self._start_ns) / 1e9,
            host_time_ns=np.array([sample.received_ns for sample in samples], np.int64),
            status=status,
            usable=sound & unsaturated & (np.abs(wrench) <= self._settings.rated_wrench).all(axis=1),
            wrench=wrench,
        )


def _read_board(link: BoardLink, calibration: int) -> _Board:
    link.select_calibration(calibration)
    status, _ = decode_gages(*link.ask(Opcode.GAGES).frames)
    if status & CRITICAL_STATUS:
        raise DeviceFaultError(
            f"the board reports {'; '.join(describe(status & CRITICAL_STATUS, STATUS_WORDS))}"
        )
    firmware = decode_firmware(*link.ask(Opcode.FIRMWARE).frames)
    scaling = Scaling()  # what boards had before they could tell
    if firmware[:2] >= _FIRMWARE_THAT_TELLS_UNITS:
        scaling = decode_scaling(*link.ask(Opcode.COUNTS_PER_UNIT).frames, *link.ask(Opcode.UNITS).frames)
    rows = [b"".join(link.ask(Opcode.MATRIX_ROW, bytes([axis])).frames) for axis in range(6)]
    return _Board(
        serial=decode_serial(*link.ask(Opcode.SERIAL).frames),
        firmware=firmware,
        scaling=scaling,
        si_per_gage=scaling.si_per_count[:, np.newaxis] * decode_matrix(rows),
    )
