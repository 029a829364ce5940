"""An emulated ATI Digital F/T, written from the register and byte tables, not from the driver."""

import struct
from dataclasses import dataclass, field

import numpy as np

from robot_drivers.ati.transducer.gages import FT33206, GageCalibration
from robot_drivers.emulated_wrench import InterpolatedSource, WrenchSource
from robot_drivers.protocols import FloatArray
from robot_drivers.serial_line.emulator.device import SerialDeviceEmulator
from robot_drivers.serial_line.emulator.line import FarEnd

_JAM_SIZE = 14
_LONGEST_PAUSE_S = 0.05  # bytes further apart do not belong to one request
_FORCE_CODES = {"lbf": 1, "N": 2, "klbf": 3, "kN": 4, "kgf": 5, "gf": 6}
_TORQUE_CODES = {"lbf-in": 1, "lbf-ft": 2, "N-m": 3, "N-mm": 4, "kgf-cm": 5, "kN-m": 6}
_ILLEGAL_FUNCTION, _ILLEGAL_ADDRESS, _FAILURE = 1, 2, 4
_NEUTRAL_GAIN, _NEUTRAL_OFFSET = 512, 32768


@dataclass(frozen=True, slots=True, kw_only=True)
class DigitalFTEmulatorSettings:
    """What the emulated transducer is like.

    Attributes
    ----------
    calibrations : those it keeps, by their numbers from 1; the first one is also what its gages obey
    slave_address : Modbus address
    sample_rate_hz : of its stream
    noise_counts : standard deviation of the white noise of every gage
    status : status word; any bit but the first (a restart by the watchdog) marks every sample as erroneous
    seed : of noise and faults
    burst_s : the stream comes in bursts this long; the wrench source is asked once for each
    line : what it is wired to; by default a pseudo-terminal where there is one
    """

    calibrations: dict[int, GageCalibration] = field(default_factory=lambda: {1: FT33206})
    slave_address: int = 10
    sample_rate_hz: float = 7000.0
    noise_counts: float = 1.0
    status: int = 0
    seed: int = 0
    burst_s: float = 0.004
    line: FarEnd | None = None


def calibration_record(calibration: GageCalibration) -> bytes:
    """Return the 168 registers of a calibration record."""
    scaling = calibration.scaling
    si_per_unit = scaling.si_per_count * np.repeat([scaling.counts_per_force, scaling.counts_per_torque], 3)
    record = calibration.serial.encode().ljust(8, b"\0")
    record += calibration.part_number.encode().ljust(32, b"\0")
    record += b"Net\0" + b"2021-01-1905:00:00Z".ljust(20, b"\0")
    record += struct.pack(">36f", *calibration.matrix.ravel())
    record += bytes([_FORCE_CODES[scaling.force_unit], _TORQUE_CODES[scaling.torque_unit]])
    record += struct.pack(">6f", *(calibration.rated_wrench / si_per_unit))
    record += struct.pack(">ii", round(scaling.counts_per_force), round(scaling.counts_per_torque))
    record += struct.pack(">6H6H", *calibration.gains, *calibration.offsets)
    return record.ljust(2 * 168, b"\0")


class _Model:
    """The transducer: registers, storage lock, stream."""

    def __init__(self, source: WrenchSource, settings: DigitalFTEmulatorSettings) -> None:
        self._settings = settings
        self._source = InterpolatedSource(source, settings.burst_s)
        self._transducer = settings.calibrations[1]
        self._random = np.random.default_rng(settings.seed)
        self._registers: dict[int, int] = {}
        self._locked = True
        self._streaming_since_s: float | None = None
        self._sent = 0
        self._heard = b""
        self._heard_at_s = 0.0

    def power_up(self) -> None:
        """Forget everything but the calibrations."""
        self._registers = dict.fromkeys(range(0x0006), _NEUTRAL_GAIN)
        self._registers |= dict.fromkeys(range(0x0006, 0x000C), _NEUTRAL_OFFSET)
        self._registers[0x000C] = 0
        self._registers |= {0x001D: self._settings.status, 0x001E: 0, 0x001F: 0}
        for number, calibration in self._settings.calibrations.items():
            record = struct.unpack(">168H", calibration_record(calibration))
            self._registers |= dict(enumerate(record, start=0x00E3 + 192 * (number - 1)))
        self._locked = True
        self._streaming_since_s = None
        self._heard = b""

    def hear(self, data: bytes, time_s: float) -> bytes:
        """Answer a request; while streaming, end the stream at a burst of 14 bytes."""
        if time_s - self._heard_at_s > _LONGEST_PAUSE_S:
            self._heard = b""
        self._heard_at_s = time_s
        self._heard += data
        if self._streaming_since_s is not None:
            if len(self._heard) >= _JAM_SIZE:
                self._streaming_since_s = None
                self._heard = b""
            return b""
        request, self._heard = _cut_request(self._heard)
        if not request or request[0] != self._settings.slave_address or _crc(request[:-2]) != request[-2:]:
            return b""
        answer = self._answer(request[1:-2], time_s)
        return answer + _crc(answer)

    def _answer(self, request: bytes, time_s: float) -> bytes:
        address, function = bytes([self._settings.slave_address]), request[0]
        refusal = address + bytes([function | 0x80])
        if function == 0x46 and request[1] == 0x55:
            self._streaming_since_s, self._sent = time_s, 0
            return address + bytes([function, 1])
        if function == 0x6A and request[1] in (0xAA, 0x18):
            self._locked = request[1] == 0x18
            return address + bytes([function, 1])
        if function not in (0x03, 0x10):
            return refusal + bytes([_ILLEGAL_FUNCTION])
        first, count = struct.unpack(">HH", request[1:5])
        registers = range(first, first + count)
        if not all(register in self._registers for register in registers) or not 1 <= count <= 125:
            return refusal + bytes([_ILLEGAL_ADDRESS])
        if function == 0x03:
            values = [self._registers[register] for register in registers]
            return address + bytes([function, 2 * count]) + struct.pack(f">{count}H", *values)
        if self._locked:
            return refusal + bytes([_FAILURE])
        self._registers |= zip(registers, struct.unpack(f">{count}H", request[6:]), strict=True)
        return address + request[:5]

    def stream(self, time_s: float) -> bytes:
        """Return the samples that have been taken since the last call, of 13 bytes each."""
        if self._streaming_since_s is None:
            return b""
        rate_hz = self._settings.sample_rate_hz
        due = int((time_s - self._streaming_since_s) * rate_hz)
        if due <= self._sent:
            return b""
        numbers = np.arange(self._sent + 1, due + 1)
        self._sent = due
        gages = self._gages(self._streaming_since_s + numbers / rate_hz)
        samples = np.empty((len(gages), 13), np.uint8)
        samples[:, :12] = np.ascontiguousarray(gages[:, [0, 2, 4, 1, 3, 5]], ">i2").view(np.uint8)
        samples[:, 12] = samples[:, :12].sum(axis=1) & 0x7F
        if self._settings.status & ~1:
            samples[:, 12] |= 0x80
        return samples.tobytes()

    def _gages(self, times_s: FloatArray) -> FloatArray:
        """Return what the amplifiers make of the load: right only with the settings of the calibration."""
        loaded = self._source.wrenches(times_s) @ np.linalg.inv(self._transducer.si_per_gage).T
        loaded += self._random.normal(0, self._settings.noise_counts, loaded.shape)
        gains = np.array([self._registers[register] for register in range(0x0006)])
        offsets = np.array([self._registers[register] for register in range(0x0006, 0x000C)])
        amplified = loaded * gains / self._transducer.gains + (offsets - self._transducer.offsets)
        return np.clip(np.rint(amplified), -32768, 32767)


class DigitalFTEmulator(SerialDeviceEmulator):
    """A transducer that senses ``source``; serving from construction until ``close``."""

    def __init__(self, source: WrenchSource, settings: DigitalFTEmulatorSettings | None = None) -> None:
        settings = settings or DigitalFTEmulatorSettings()
        super().__init__(_Model(source, settings), settings.seed, settings.burst_s, settings.line)


def _cut_request(heard: bytes) -> tuple[bytes, bytes]:
    """Return the first request and what follows it; what is no request is dropped whole."""
    if len(heard) < 2:
        return b"", heard
    sizes = {0x03: 8, 0x04: 8, 0x46: 5, 0x6A: 5, 0x10: 9 + heard[6] if len(heard) > 6 else 9}
    size = sizes.get(heard[1])
    if size is None:
        return b"", b""
    return (heard[:size], heard[size:]) if len(heard) >= size else (b"", heard)


def _crc_table_entry(value: int) -> int:
    for _ in range(8):
        value = value // 2 ^ 0xA001 if value % 2 else value // 2
    return value


_CRC_TABLE = [_crc_table_entry(value) for value in range(256)]


def _crc(data: bytes) -> bytes:
    """Return the two bytes of Modbus' CRC-16, low byte first."""
    crc = 0xFFFF
    for byte in data:
        crc = crc // 256 ^ _CRC_TABLE[(crc ^ byte) % 256]
    return crc.to_bytes(2, "little")
