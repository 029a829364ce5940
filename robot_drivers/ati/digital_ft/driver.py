"""Driver of an ATI Digital F/T: a transducer with electronics inside, on RS-485, that streams raw gages at 7 kHz.

The device keeps its calibrations; the driver reads one, loads the amplifier settings that belong to it, and applies
its matrix. Nothing is biased: the device cannot, and the driver does not.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.digital_ft import protocol
from robot_drivers.ati.digital_ft.modbus import ModbusMaster
from robot_drivers.ati.serial.force_sensor import SerialForceSensor, SerialSettings
from robot_drivers.ati.serial.stream import Samples
from robot_drivers.ati.transducer.gages import saturated
from robot_drivers.errors import ConfigurationError, DeviceError
from robot_drivers.protocols import DeviceIdentity, FloatArray
from robot_drivers.serial_line.line import SerialLine

__all__ = ["DigitalFT", "DigitalFTSettings"]

_BITS_PER_SAMPLE = 11 * protocol.SAMPLE_SIZE  # start, 8 data, parity, stop


@dataclass(frozen=True, slots=True, kw_only=True)
class DigitalFTSettings(SerialSettings):
    """How to reach and use one Digital F/T; see also :class:`SerialSettings`.

    Attributes
    ----------
    bit_rate : 1 250 000 as delivered; the other known ones are 115200 and 19200
    sample_rate_hz : samples per second; 7000 at the full bit rate. That of the lower ones is not documented
    slave_address : Modbus address
    calibration_index : which of the up to 16 calibrations in the device to use
    """

    bit_rate: int = 1_250_000
    sample_rate_hz: float = 7000.0
    slave_address: int = 10
    calibration_index: int = 1

    def __post_init__(self) -> None:
        SerialSettings.__post_init__(self)
        if not 0 < self.sample_rate_hz * _BITS_PER_SAMPLE <= self.bit_rate:
            raise ConfigurationError(
                f"force sensor sample_rate_hz {self.sample_rate_hz}: at {self.bit_rate} bit/s at most "
                f"{self.bit_rate / _BITS_PER_SAMPLE:.0f} samples of {_BITS_PER_SAMPLE} bits fit in a second"
            )
        if not 1 <= self.slave_address <= 247:
            raise ConfigurationError(f"force sensor slave_address {self.slave_address}: must be 1..247")
        if not 1 <= self.calibration_index <= protocol.MAX_CALIBRATIONS:
            raise ConfigurationError(
                f"force sensor calibration_index {self.calibration_index}: must be 1..{protocol.MAX_CALIBRATIONS}"
            )


class _Device:
    """A Digital F/T that answered on an open line."""

    def __init__(self, line: SerialLine, settings: DigitalFTSettings) -> None:
        self._line = line
        self._modbus = ModbusMaster(line, settings.slave_address, settings.answer_timeout_s)
        self.record_rate_hz = settings.sample_rate_hz
        self.interrupt()
        line.read_until_silent()
        self.calibration = protocol.parse_calibration(
            self._modbus.read_holding(
                protocol.calibration_register(settings.calibration_index), protocol.CALIBRATION_REGISTERS
            )
        )
        scaling = self.calibration.scaling
        self.identity = DeviceIdentity(
            kind="force sensor",
            model=f"ATI Digital F/T {self.calibration.part_number}",
            serial=self.calibration.serial,
            address=f"{settings.port}, slave {settings.slave_address}",
            details={
                "calibration": str(settings.calibration_index),
                "units": f"{scaling.force_unit}, {scaling.torque_unit}",
                "counts per unit": f"{scaling.counts_per_force:g}, {scaling.counts_per_torque:g}",
                "bit rate": f"{settings.bit_rate} bit/s",
                "status": "; ".join(self.status()) or "healthy",
            },
        )

    def status(self) -> tuple[str, ...]:
        """Read the status word of a silent device; one line for each bit that is set."""
        word = self._modbus.read_holding(protocol.STATUS_REGISTER, 1)
        return protocol.STATUS_MAP.describe(int.from_bytes(word, "big"))

    def begin(self) -> protocol.SampleDecoder:
        """Load the amplifier settings of the calibration and start the stream."""
        self._modbus.command(protocol.STORAGE_LOCK, protocol.UNLOCK_VALUE)
        try:
            self._modbus.write_holding(protocol.GAINS_REGISTER, self.calibration.gains)
            self._modbus.write_holding(protocol.OFFSETS_REGISTER, self.calibration.offsets)
        finally:
            self._modbus.command(protocol.STORAGE_LOCK, protocol.LOCK_VALUE)
        self._modbus.command(protocol.START_STREAMING, protocol.START_VALUE)
        return protocol.SampleDecoder()

    def interrupt(self) -> None:
        """Jam the line."""
        self._line.write(protocol.JAM)

    def wrench(self, samples: Samples) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Convert gages; a sample with an error, a saturated gage or an axis beyond its rating is not usable."""
        wrench = self.calibration.wrench(samples.values)
        usable = (samples.status == 0) & ~saturated(samples.values) & self.calibration.in_range(wrench)
        return wrench, usable


class DigitalFT(SerialForceSensor[_Device]):
    """A :class:`~robot_drivers.protocols.ForceSensor` on RS-485."""

    def __init__(self, settings: DigitalFTSettings) -> None:
        super().__init__(settings, "E", lambda line: _Device(line, settings))

    def status(self) -> tuple[str, ...]:
        """Read what the device says of itself, one line for each condition; empty when it is healthy.

        Raises
        ------
        DeviceError
            The sensor is streaming, and cannot answer: stop it first.
        """
        _, device = self._connected()
        if self._streaming:
            raise DeviceError("the force sensor cannot tell its status while it streams: call stop() first")
        return device.status()
