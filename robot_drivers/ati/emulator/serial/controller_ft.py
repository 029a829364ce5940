"""An emulated stand-alone ATI F/T Controller, written from the command list and captured bytes, not from the driver.

Averaging lowers its noise; the delay that comes with it is not emulated.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from robot_drivers.ati.transducer.gages import FT33206
from robot_drivers.ati.transducer.gamma import GAGE_NOISE_STD
from robot_drivers.emulated_wrench import InterpolatedSource, WrenchSource
from robot_drivers.protocols import FloatArray, IntArray
from robot_drivers.serial_line.emulator.device import SerialDeviceEmulator
from robot_drivers.serial_line.emulator.line import FarEnd

_BITS_PER_BYTE = 10  # start, 8 data, stop
_BIAS_LEVELS = 3
_SATURATED_FLAG = 1
_FULL_GAGE = 32767


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerFTEmulatorSettings:
    """What the emulated controller is like.

    Attributes
    ----------
    bit_rate : of its line, which paces the stream
    record_bits : size of a count
    counts_per_newton, counts_per_newton_metre : scale; by default that inferred for a Gamma SI-130-10
    record_rate_hz : of a stream, if lower than the line allows; None for all that the line allows
    after_command : what follows the echo of a command. Of these seven bytes only the number and the prompt are known
    before_records : what follows the echo of QR and QS; not known, CR LF is possible
    noise_std : standard deviation of the white noise without averaging, N and N·m
    seed : of noise and faults
    burst_s : the stream comes in bursts this long; the wrench source is asked once for each
    line : what it is wired to; by default a pseudo-terminal where there is one
    """

    bit_rate: int = 9600
    record_bits: Literal[16, 24] = 16
    counts_per_newton: float = 10.0
    counts_per_newton_metre: float = 500 / 3
    record_rate_hz: float | None = None
    after_command: bytes = b"\r\n\r\n\r\n>"
    before_records: bytes = b""
    noise_std: tuple[float, float, float, float, float, float] = GAGE_NOISE_STD
    seed: int = 0
    burst_s: float = 0.004
    line: FarEnd | None = None


class _Model:
    """The controller: command line, settings, bias stack, stream."""

    def __init__(self, source: WrenchSource, settings: ControllerFTEmulatorSettings) -> None:
        self._settings = settings
        self._source = InterpolatedSource(source, settings.burst_s)
        self._random = np.random.default_rng(settings.seed)
        self._counts_per_si = np.repeat([settings.counts_per_newton, settings.counts_per_newton_metre], 3)
        self.power_up()

    def power_up(self) -> None:
        """Take the settings as delivered."""
        self._binary = False
        self._averaging = 1
        self._line_end = b"\r\n"
        self._axes = np.ones(6, np.bool_)
        self._biases: list[FloatArray] = []
        self._typed = b""
        self._streaming_since_s: float | None = None
        self._sent = 0

    def hear(self, data: bytes, time_s: float) -> bytes:
        """Echo what is typed, carry commands out at their CR, and end a stream at the first byte."""
        answer = b""
        for byte in (data[i : i + 1] for i in range(len(data))):
            if self._streaming_since_s is not None:
                self._streaming_since_s = None
                answer += b"\x06\r\n>"
            if byte == b"\r":
                command, self._typed = self._typed.decode("ascii", "replace"), b""
                answer += self._answer(command, time_s) if command else b"\r\n\r\n>"
            else:
                self._typed += byte
                answer += byte
        return answer

    def _answer(self, command: str, time_s: float) -> bytes:
        """Carry a command out; return what follows its echo."""
        match command.split():
            case ["QR"]:
                return self._settings.before_records + self._records(np.array([time_s])) + b"\x06\r\n>"
            case ["QS"]:
                self._streaming_since_s, self._sent = time_s, 0
                return self._settings.before_records
            case ["CD", "A" | "B" as form]:
                self._binary = form == "B"
            case ["CL", "0" | "1" as with_line_feed]:
                self._line_end = b"\r\n" if with_line_feed == "1" else b"\r"
            case ["CV", mask]:
                self._axes = np.array([int(mask, 16) >> axis & 1 for axis in range(6)], np.bool_)
            case ["SA", samples]:
                self._averaging = max(1, int(samples))
            case ["SB"]:
                self._biases = [*self._biases, self._source.wrenches(np.array([time_s]))[0]][-_BIAS_LEVELS:]
            case ["SU"]:
                self._biases = self._biases[:-1]
            case ["SZ"]:
                self._biases = []
        return self._settings.after_command

    def stream(self, time_s: float) -> bytes:
        """Return the records that the line has carried since the last call."""
        if self._streaming_since_s is None:
            return b""
        record_s = len(self._format(0, np.zeros(6, np.int64))) * _BITS_PER_BYTE / self._settings.bit_rate
        if self._settings.record_rate_hz is not None:
            record_s = max(record_s, 1 / self._settings.record_rate_hz)
        due = int((time_s - self._streaming_since_s) / record_s)
        if due <= self._sent:
            return b""
        numbers = np.arange(self._sent + 1, due + 1, dtype=np.float64)
        self._sent = due
        return self._records(self._streaming_since_s + numbers * record_s)

    def _records(self, times_s: FloatArray) -> bytes:
        wrench = self._source.wrenches(times_s)
        saturated = (np.abs(FT33206.gages(wrench)) >= _FULL_GAGE).any(axis=1)
        noise = self._random.standard_normal(wrench.shape) * self._settings.noise_std
        measured = wrench + noise / np.sqrt(self._averaging) - (self._biases[-1] if self._biases else 0)
        end = 2 ** (self._settings.record_bits - 1)
        counts = np.clip(np.rint(measured * self._counts_per_si), -end, end - 1).astype(np.int64)
        flags = np.where(saturated, _SATURATED_FLAG, 0)
        return b"".join(self._format(int(flag), row) for flag, row in zip(flags, counts, strict=True))

    def _format(self, flag: int, counts: IntArray) -> bytes:
        chosen = counts[self._axes].tolist()
        bits = self._settings.record_bits
        if self._binary:
            return bytes([flag]) + b"".join(count.to_bytes(bits // 8, "big", signed=True) for count in chosen)
        width = {16: 6, 24: 8}[bits]
        fields = ",".join([str(flag), *(f"{count:{width}d}" for count in chosen)])
        return fields.encode() + self._line_end


class ControllerFTEmulator(SerialDeviceEmulator):
    """A controller whose transducer senses ``source``; serving from construction until ``close``."""

    def __init__(self, source: WrenchSource, settings: ControllerFTEmulatorSettings | None = None) -> None:
        settings = settings or ControllerFTEmulatorSettings()
        super().__init__(_Model(source, settings), settings.seed, settings.burst_s, settings.line)
