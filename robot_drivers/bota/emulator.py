"""An emulated Bota Systems sensor on a serial line, written from the manufacturer's example, not from the driver.

From power-up it says "App Init" and streams. "C" ends that and leads to the configuration, where "c,..." and "f,..."
set communication and filter, and "R" goes back to running. Each is answered by "r,0," and its letter and ",0".
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robot_drivers.emulated_wrench import InterpolatedSource, WrenchSource
from robot_drivers.serial_line.emulator.device import SerialDeviceEmulator
from robot_drivers.serial_line.emulator.line import FarEnd

_SECONDS_PER_TAP = 1 / 51200
_OUT_OF_RANGE, _RAW = 0b0010, 0b1000
_MOST_AT_ONCE = 400
_Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class BotaEmulatorSettings:
    """What the emulated sensor is like.

    Attributes
    ----------
    sinc_length : of its filter, which gives 51200 / sinc_length samples a second
    binary : whether it sends frames; otherwise lines of text
    rated_wrench : N and N·m beyond which it tells that it is out of range
    temperature_c : of the sensor
    clock_ppm : how much faster than the host's its clock runs, 1e-6
    noise_std : standard deviation of the white noise, N and N·m
    status : bits raised in every status word
    seed : of noise and faults
    burst_s : the stream comes in bursts this long
    line : what it is wired to; by default a pseudo-terminal where there is one
    """

    sinc_length: int = 64
    binary: bool = True
    rated_wrench: _Six = (500.0, 500.0, 1200.0, 15.0, 15.0, 12.0)
    temperature_c: float = 31.5
    clock_ppm: float = 0.0
    noise_std: _Six = (0.05, 0.05, 0.05, 0.001, 0.001, 0.001)
    status: int = 0
    seed: int = 0
    burst_s: float = 0.002
    line: FarEnd | None = None


class _Model:
    """The sensor: mode, filter, clock."""

    def __init__(self, source: WrenchSource, settings: BotaEmulatorSettings) -> None:
        self._settings = settings
        self._source = InterpolatedSource(source, 4 * settings.burst_s)
        self._random = np.random.default_rng(settings.seed)
        self.power_up()

    def power_up(self) -> None:
        """Begin as new: greet, then run."""
        self._sinc_length = self._settings.sinc_length
        self._binary, self._calibrated = self._settings.binary, True
        self._running = True
        self._greeting = b"App Init\r\n"
        self._booted_s: float | None = None
        self._since_s: float | None = None
        self._sent = 0

    @property
    def _period_s(self) -> float:
        return self._sinc_length * _SECONDS_PER_TAP

    def hear(self, data: bytes, time_s: float) -> bytes:
        """Take a command; a host waits for the answer to each."""
        return b"".join(self._answers(data.decode("ascii", "replace")))

    def _answers(self, text: str) -> Iterator[bytes]:
        letter, _, rest = text.strip().partition(",")
        numbers = [int(number) for number in rest.split(",") if number.strip().isdecimal()]
        if letter == "C":
            self._running = False
        elif letter == "R" and not self._running:
            self._running, self._since_s = True, None
        elif letter == "c" and not self._running and len(numbers) == 4:
            self._calibrated, self._binary = numbers[1] == 1, numbers[2] == 0
        elif letter == "f" and not self._running and len(numbers) == 4 and numbers[0] > 0:
            self._sinc_length = numbers[0]
        else:
            return
        yield f"r,0,{letter},0".encode()

    def stream(self, time_s: float) -> bytes:
        """Return the samples that have become due."""
        if self._booted_s is None:
            self._booted_s = time_s
        greeting, self._greeting = self._greeting, b""
        if not self._running:
            return greeting
        if self._since_s is None:
            self._since_s, self._sent = time_s, 0
        due = int((time_s - self._since_s) / self._period_s)
        first = max(self._sent, due - _MOST_AT_ONCE)
        self._sent = due
        if first >= due:
            return greeting
        times_s = self._since_s + self._period_s * np.arange(first + 1, due + 1, dtype=np.float64)
        wrench = self._source.wrenches(times_s)
        beyond = (np.abs(wrench) > self._settings.rated_wrench).any(axis=1)
        wrench = wrench + self._random.standard_normal(wrench.shape) * self._settings.noise_std
        clocks_us = np.rint((times_s - self._booted_s) * (1e6 + self._settings.clock_ppm)) % 2**32
        status = (
            np.where(beyond, _OUT_OF_RANGE, 0) | (0 if self._calibrated else _RAW) | self._settings.status
        )
        rows = zip(status.tolist(), wrench.tolist(), clocks_us.tolist(), strict=True)
        return greeting + b"".join(self._record(word, values, int(clock)) for word, values, clock in rows)

    def _record(self, status: int, wrench: list[float], clock_us: int) -> bytes:
        temperature = self._settings.temperature_c
        if not self._binary:
            values = ",".join(f"{value:.4f}" for value in wrench)
            return f"{status},{values},{clock_us},{temperature:.2f}\r\n".encode()
        content = struct.pack("<H6fIf", status, *wrench, clock_us, temperature)
        return b"\xaa" + content + struct.pack("<H", _checksum(content))


def _checksum(content: bytes) -> int:
    """CRC-16/X-25, bit by bit."""
    register = 0xFFFF
    for byte in content:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0x8408 if register & 1 else 0)
    return register ^ 0xFFFF


class BotaEmulator(SerialDeviceEmulator):
    """A sensor at the end of a line that feels ``source``; from construction until ``close``."""

    def __init__(self, source: WrenchSource, settings: BotaEmulatorSettings | None = None) -> None:
        settings = settings or BotaEmulatorSettings()
        super().__init__(_Model(source, settings), settings.seed, settings.burst_s, settings.line)
