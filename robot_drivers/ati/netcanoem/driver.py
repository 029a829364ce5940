"""Driver of an ATI NETCANOEM board.

The board has neither a counter nor a clock: a sample's counter is the number of its request, and its device
time the time of that request since the start, on the host clock. It has no bias command either, and the driver
subtracts none.
"""

from collections.abc import Sequence

import numpy as np

from robot_drivers.ati.can.force_sensor import CanForceSensor
from robot_drivers.ati.can.link import Answer, CanLink
from robot_drivers.ati.can.poller import Sample
from robot_drivers.ati.netcanoem.frames import (
    CRITICAL_STATUS,
    STATUS_WORDS,
    Opcode,
    decode_firmware,
    decode_gages,
    decode_matrix,
    decode_scaling,
    decode_serial,
    request,
)
from robot_drivers.ati.netcanoem.settings import NetCANOEMSettings
from robot_drivers.ati.transducer.gages import GageCalibration, saturated
from robot_drivers.ati.transducer.scaling import Scaling
from robot_drivers.ati.transducer.status import describe
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceFaultError, DeviceProtocolError
from robot_drivers.protocols import DeviceIdentity, WrenchBlock

_FIRMWARE_THAT_TELLS_UNITS = (3, 7)


class _Decoder:
    """Turns gages into wrenches; the stream begins with its construction."""

    repeated = 0
    restarts = 0

    def __init__(self, calibration: GageCalibration) -> None:
        self._calibration = calibration
        self._start_ns = host_time_ns()

    def block(self, samples: Sequence[Sample]) -> WrenchBlock:
        """Convert; a critical status, a saturated gage or an axis beyond its rating forbids a sample."""
        decoded = [decode_gages(*sample.answer.frames) for sample in samples]
        status = np.array([status for status, _ in decoded], np.int64)
        gages = np.array([gages for _, gages in decoded], np.int64).reshape(-1, 6)
        requested_ns = np.array([sample.answer.requested_ns for sample in samples], np.int64)
        wrench = self._calibration.wrench(gages)
        sound = (status & CRITICAL_STATUS) == 0
        return WrenchBlock(
            counter=np.array([sample.counter for sample in samples], np.int64),
            device_time_s=(requested_ns - self._start_ns) / 1e9,
            host_time_ns=np.array([sample.answer.received_ns for sample in samples], np.int64),
            status=status,
            usable=sound & ~saturated(gages) & self._calibration.in_range(wrench),
            wrench=wrench,
        )


class _Board:
    """A board that answered on an open bus, with its calibration selected and read."""

    def __init__(self, link: CanLink, settings: NetCANOEMSettings) -> None:
        self._link = link
        self._settings = settings
        self._gages = request(settings.base, Opcode.GAGES)
        self.recover()
        self._refuse_faults()
        firmware = decode_firmware(*self._ask(Opcode.FIRMWARE))
        scaling = Scaling()  # what boards had before they could tell
        if firmware[:2] >= _FIRMWARE_THAT_TELLS_UNITS:
            scaling = decode_scaling(*self._ask(Opcode.COUNTS_PER_UNIT), *self._ask(Opcode.UNITS))
        rows = [b"".join(self._ask(Opcode.MATRIX_ROW, bytes([axis]))) for axis in range(6)]
        self._calibration = GageCalibration(
            matrix=decode_matrix(rows),
            rated_wrench=settings.rated_wrench,
            scaling=scaling,
            serial=decode_serial(*self._ask(Opcode.SERIAL)),
        )
        self.identity = DeviceIdentity(
            kind="force sensor",
            model="ATI NETCANOEM",
            serial=self._calibration.serial,
            address=f"{settings.interface}:{settings.channel}, base {settings.base:#04x}",
            details={
                "firmware": "{}.{} build {}".format(*firmware),
                "calibration": str(settings.calibration),
                "units": f"{scaling.force_unit}, {scaling.torque_unit}",
                "counts per unit": f"{scaling.counts_per_force:g}, {scaling.counts_per_torque:g}",
            },
        )

    def poll(self) -> Answer:
        """Ask for the gages."""
        return self._link.ask(self._gages)

    def recover(self) -> None:
        """Select the calibration: after a reset the board uses slot 0.

        Raises
        ------
        DeviceProtocolError
            The board selected another one.
        """
        wanted = self._settings.calibration
        (echo,) = self._ask(Opcode.CALIBRATION, bytes([wanted]))
        if echo[0] != wanted:
            raise DeviceProtocolError(f"the board selected calibration {echo[0]} instead of {wanted}")

    def begin(self) -> _Decoder:
        """Begin a stream."""
        return _Decoder(self._calibration)

    def _refuse_faults(self) -> None:
        status, _ = decode_gages(*self.poll().frames)
        if status & CRITICAL_STATUS:
            raise DeviceFaultError(
                f"the board reports {'; '.join(describe(status & CRITICAL_STATUS, STATUS_WORDS))}"
            )

    def _ask(self, opcode: Opcode, data: bytes = b"") -> tuple[bytes, ...]:
        return self._link.ask(request(self._settings.base, opcode, data)).frames


class NetCANOEM(CanForceSensor[_Board]):
    """A :class:`~robot_drivers.protocols.ForceSensor` on a NETCANOEM board."""

    def __init__(self, settings: NetCANOEMSettings) -> None:
        super().__init__(
            settings,
            f"NETCANOEM board with base {settings.base:#04x} on {settings.channel}",
            lambda link: _Board(link, settings),
        )

    def describe_status(self, status: int) -> tuple[str, ...]:
        """Return one line for each bit set in a status word."""
        return describe(status, STATUS_WORDS)
