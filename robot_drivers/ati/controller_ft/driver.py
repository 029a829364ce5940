"""Driver of a stand-alone ATI F/T Controller (CTL) on RS-232, which resolves the wrench and streams counts.

Source: the command list of 9620-05-CTL as open-source drivers render it; the manual itself was not at hand. Its
reply texts and error codes are unknown, so the driver relies on echo and prompt alone and proves the format that it
asked for by one record. The controller is biased on request only.
"""

import time
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robot_drivers.ati.controller_ft.records import (
    AsciiDecoder,
    BinaryDecoder,
    ascii_counts,
    binary_record_size,
)
from robot_drivers.ati.serial.force_sensor import SerialForceSensor, SerialSettings
from robot_drivers.ati.serial.stream import Samples
from robot_drivers.ati.transducer.gamma import RATED_WRENCH
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import ConfigurationError, DeviceError, DeviceProtocolError, DeviceTimeoutError
from robot_drivers.protocols import DeviceIdentity, FloatArray
from robot_drivers.serial_line.line import SerialLine

__all__ = ["ControllerFT", "ControllerFTSettings"]

_PROMPT = b">"
_SILENT_S = 0.1
_STOPPING_LIMIT_S = 2.0
_RATE_MEASUREMENT_S = 0.5
_FORMAT_COMMANDS = {"ascii": "CD A", "binary": "CD B"}
_LARGEST_LOAD = 2.5
"""Times its rating that no axis can read: the gages are at the end of their range before."""
_MOST_FRAMING_BYTES = 5
"""Line ends, acknowledgement: what may stand around a binary record between echo and prompt."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerFTSettings(SerialSettings):
    """How to reach and use one controller; see also :class:`SerialSettings`.

    Attributes
    ----------
    counts_per_newton, counts_per_newton_metre : from the certificate of calibration; the controller does not tell
        them. A Gamma of 65 N and 5 N·m has 20 and 333.3; one of 130 N and 10 N·m should have half of that
    bit_rate : 9600 as delivered; the faster ones pay, since the line limits the record rate
    record_format : ``"ascii"``, or ``"binary"``, which is three times as fast and has no check of its own (see
        :mod:`robot_drivers.ati.controller_ft.records`)
    record_bits : size of a count, by the generation of the controller; None finds out from one record
    record_rate_hz : records per second; None measures it at connection to about a percent
    averaging : samples in the controller's moving average, 0 for none
    rated_wrench : ± N and N·m beyond which a sample is not usable; see the certificate
    transducer_serial : of the certificate, for the record
    """

    counts_per_newton: float
    counts_per_newton_metre: float
    bit_rate: int = 9600
    record_format: Literal["ascii", "binary"] = "ascii"
    record_bits: Literal[16, 24] | None = None
    record_rate_hz: float | None = None
    averaging: int = 0
    rated_wrench: tuple[float, float, float, float, float, float] = RATED_WRENCH
    transducer_serial: str = "not told"

    def __post_init__(self) -> None:
        SerialSettings.__post_init__(self)
        if self.record_format not in _FORMAT_COMMANDS:
            raise ConfigurationError(
                f"force sensor record_format {self.record_format!r}: must be 'ascii' or 'binary'"
            )
        if self.record_bits not in (16, 24, None):
            raise ConfigurationError(
                f"force sensor record_bits {self.record_bits}: must be 16 or 24, or left out"
            )
        for name in ("counts_per_newton", "counts_per_newton_metre", "record_rate_hz"):
            value = getattr(self, name)
            if value is not None and not 0 < value < float("inf"):
                raise ConfigurationError(f"force sensor {name} {value}: must be positive")
        if self.averaging < 0:
            raise ConfigurationError(
                f"force sensor averaging {self.averaging}: must be 0 or a number of samples"
            )

    @property
    def counts_per_si(self) -> FloatArray:
        """Counts per N and N·m, (6,)."""
        return np.repeat([self.counts_per_newton, self.counts_per_newton_metre], 3)


class _Device:
    """A controller that answered on an open line."""

    def __init__(self, line: SerialLine, settings: ControllerFTSettings) -> None:
        self._line = line
        self._settings = settings
        self.interrupt()
        greeting = line.read_until_silent(_SILENT_S, _STOPPING_LIMIT_S, settings.answer_timeout_s)
        if not greeting:
            raise DeviceTimeoutError("an empty command was not answered")
        if not greeting.endswith(_PROMPT):
            raise DeviceProtocolError(
                f"the device on {settings.port} ends with {greeting[-8:].hex(' ')} and not with the prompt '>': "
                f"is it an F/T Controller, set to {settings.bit_rate} bit/s?"
            )
        self._set_up()
        self._bits = settings.record_bits or self._measure_bits()
        self.record_rate_hz = settings.record_rate_hz or self._measure_rate()
        self.identity = DeviceIdentity(
            kind="force sensor",
            model="ATI F/T Controller",
            serial=settings.transducer_serial,
            address=settings.port,
            details={
                "counts per N and N·m": f"{settings.counts_per_newton:g}, {settings.counts_per_newton_metre:g}",
                "records": f"{settings.record_format}, {self._bits} bit",
                "record rate": f"{self.record_rate_hz:.1f} Hz"
                + ("" if settings.record_rate_hz else " (measured)"),
                "averaging": f"{settings.averaging} samples",
                "bit rate": f"{settings.bit_rate} bit/s",
            },
        )

    def set_bias(self) -> None:
        """Have the silent controller subtract the present load."""
        self._command("SB")

    def begin(self) -> AsciiDecoder | BinaryDecoder:
        """Set the controller up, which forgets it when it is powered off, and start the stream."""
        self._set_up()
        self._line.write(b"QS\r")
        echo = self._line.read_exactly(2, self._settings.answer_timeout_s)
        if echo != b"QS":
            raise DeviceProtocolError(f"the controller answered {echo!r} to QS; check wiring and bit rate")
        if self._settings.record_format == "ascii":
            return AsciiDecoder(self._bits)
        largest = _LARGEST_LOAD * np.array(self._settings.rated_wrench) * self._settings.counts_per_si
        return BinaryDecoder(self._bits, largest)

    def interrupt(self) -> None:
        """Send a character, which ends a stream; at the prompt it is an empty command."""
        self._line.write(b"\r")

    def wrench(self, samples: Samples) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Scale counts; a record with an error, a count at its end or an axis beyond its rating is not usable."""
        wrench = samples.values / self._settings.counts_per_si
        largest_count = 2 ** (self._bits - 1) - 1
        usable = (
            (samples.status == 0)
            & (np.abs(samples.values) < largest_count).all(axis=1)
            & (np.abs(wrench) <= self._settings.rated_wrench).all(axis=1)
        )
        return wrench, usable

    def _set_up(self) -> None:
        """Ask for lines that end in CR LF, resolved force and torque, the format, all six axes, averaging."""
        form = _FORMAT_COMMANDS[self._settings.record_format]
        for command in ("CL 1", "CD R", form, "CV 3F", f"SA {self._settings.averaging}"):
            self._command(command)

    def _command(self, command: str) -> None:
        """Send a command and wait for its echo and the prompt; what stands between them is not documented.

        What comes before the echo, a prompt among it, is left of a stream whose end came late.
        """
        self._line.write(command.encode() + b"\r")
        reply = b""
        while not (reply.endswith(_PROMPT) and command.encode() in reply):
            try:
                reply += self._line.read_exactly(1, self._settings.answer_timeout_s)
            except DeviceTimeoutError:
                if not reply.endswith(_PROMPT):
                    raise
                raise DeviceProtocolError(
                    f"the controller answered {reply!r} to {command!r}, without its echo"
                ) from None

    def _measure_bits(self) -> int:
        """Find the size of a count from one record: it fills what lies between echo and prompt."""
        self._line.write(b"QR\r")
        reply = self._line.read_until_silent(_SILENT_S, _STOPPING_LIMIT_S, self._settings.answer_timeout_s)
        body = reply.removeprefix(b"QR").removesuffix(_PROMPT)
        for bits in (16, 24):
            if self._settings.record_format == "ascii":
                found = any(ascii_counts(line, bits) for line in body.splitlines())
            else:
                found = 0 <= len(body) - binary_record_size(bits) <= _MOST_FRAMING_BYTES
            if found:
                return bits
        raise DeviceProtocolError(
            f"the controller answered {reply.hex(' ')} to QR, which is no {self._settings.record_format} record of "
            "16 or 24 bits; set record_bits if you know the size"
        )

    def _measure_rate(self) -> float:
        """Stream for half a second and count; leave the controller silent."""
        record_size = self.begin().record_size
        arrivals = []
        end_ns = host_time_ns() + round(_RATE_MEASUREMENT_S * 1e9)
        while host_time_ns() < end_ns:
            if data := self._line.read():
                arrivals.append((host_time_ns(), len(data)))
            time.sleep(self._settings.batch_s)
        self.interrupt()
        self._line.read_until_silent(_SILENT_S, _STOPPING_LIMIT_S)
        seconds = (arrivals[-1][0] - arrivals[0][0]) * 1e-9 if arrivals else 0.0
        records = sum(size for _, size in arrivals[1:]) / record_size
        if records < 1:
            raise DeviceTimeoutError(f"no records came in {_RATE_MEASUREMENT_S} s after QS")
        return records / seconds


class ControllerFT(SerialForceSensor[_Device]):
    """A :class:`~robot_drivers.protocols.ForceSensor` on RS-232."""

    def __init__(self, settings: ControllerFTSettings) -> None:
        super().__init__(settings, "N", lambda line: _Device(line, settings))

    def set_bias(self) -> None:
        """Have the controller subtract the present load from now on; never done but by this call.

        Raises
        ------
        DeviceError
            The sensor is streaming: stop it first.
        """
        _, device = self._connected()
        if self._streaming:
            raise DeviceError("the F/T Controller takes no command while it streams: call stop() first")
        device.set_bias()
