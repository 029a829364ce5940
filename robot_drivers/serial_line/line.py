"""A serial port, or a ``socket://`` server that forwards one, opened through pyserial and never blocking."""

import sys
import time
from typing import Literal

import serial

from robot_drivers.clock import host_time_ns
from robot_drivers.errors import (
    ConfigurationError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
)

if sys.platform == "win32":
    _REFUSALS: tuple[type[Exception], ...] = (ValueError,)
else:
    import termios

    _REFUSALS = (ValueError, termios.error)

SILENCE_S, SILENCE_LIMIT_S = 0.05, 1.0
"""A device that said nothing for so long has finished; one that goes on for so long will not."""

_READ_BYTES = 65536
_LOOK_S = 0.001
_WRITE_TIMEOUT_S = 1.0


class SerialLine:
    """An open line; one thread may write while another reads.

    Parameters
    ----------
    port : name of the port (``/dev/ttyUSB0``, ``COM3``) or a URL of pyserial
    bit_rate : bit/s
    parity : ``"N"`` or ``"E"``; always 8 data bits and 1 stop bit

    Raises
    ------
    DeviceUnreachableError
        The port is not there, is in use, or has gone; from every method.
    ConfigurationError
        The port cannot be set to this bit rate.
    """

    def __init__(self, port: str, bit_rate: int, parity: Literal["N", "E"]) -> None:
        self.port = port
        try:
            self._port = _opened(port, bit_rate, parity)
        except _REFUSALS as error:
            raise ConfigurationError(
                f"serial port {port} cannot be set to {bit_rate} bit/s, parity {parity} ({error})"
            ) from error
        except OSError as error:
            raise DeviceUnreachableError(
                f"serial port {port} cannot be opened ({error}): check its name, cable and rights, "
                "and that no other program uses it"
            ) from error

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._port.write(data)
        except OSError as error:
            raise self._gone(error) from error

    def read(self) -> bytes:
        """Return what has arrived, without waiting."""
        pieces = []
        try:
            while piece := self._port.read(_READ_BYTES):
                pieces.append(piece)
        except OSError as error:
            if not pieces:  # otherwise the next call meets the same error
                raise self._gone(error) from error
        return b"".join(pieces)

    def read_exactly(self, size: int, timeout_s: float) -> bytes:
        """Return the next ``size`` bytes, and leave what follows them.

        Raises
        ------
        DeviceTimeoutError
            Fewer came in time.
        """
        received = b""
        deadline_ns = host_time_ns() + round(timeout_s * 1e9)
        try:
            while len(received) < size:
                before_ns = host_time_ns()  # who looks late still takes what came in time
                received += self._port.read(size - len(received))
                if len(received) < size:
                    if before_ns > deadline_ns:
                        raise DeviceTimeoutError(
                            f"serial port {self.port}: {len(received)} of {size} bytes came in {timeout_s} s"
                        )
                    time.sleep(_LOOK_S)
        except serial.SerialException as error:
            raise self._gone(error) from error
        return received

    def read_until_silent(
        self, silence_s: float = SILENCE_S, limit_s: float = SILENCE_LIMIT_S, answer_timeout_s: float = 0.0
    ) -> bytes:
        """Return everything that comes until the line has been silent for ``silence_s``.

        Where an answer is to come, its first byte may take ``answer_timeout_s``.

        Raises
        ------
        DeviceProtocolError
            The line was not silent within ``limit_s``.
        """
        received = b""
        begin_ns = last_ns = host_time_ns()
        while True:
            before_ns = host_time_ns()  # who looks late still takes what came in time
            if piece := self.read():
                received += piece
                last_ns = host_time_ns()
            elif before_ns - last_ns >= 1e9 * (silence_s if received else max(silence_s, answer_timeout_s)):
                return received
            if before_ns - begin_ns > limit_s * 1e9:
                raise DeviceProtocolError(
                    f"serial port {self.port}: the device does not stop sending ({len(received)} bytes in "
                    f"{limit_s} s); check bit rate and kind of device"
                )
            time.sleep(_LOOK_S)

    def close(self) -> None:
        """Release the port."""
        self._port.close()

    def _gone(self, error: OSError) -> DeviceUnreachableError:
        return DeviceUnreachableError(
            f"serial port {self.port} has failed ({error}): check adapter and cable, then connect again"
        )


def _opened(port: str, bit_rate: int, parity: str) -> serial.SerialBase:
    opened = serial.serial_for_url(
        port,
        baudrate=bit_rate,
        parity=parity,
        timeout=0,
        write_timeout=_WRITE_TIMEOUT_S,
        exclusive=True,
    )
    if sys.platform != "win32" and parity != "N" and isinstance(opened, serial.Serial):
        # The system is to lose a byte that came with wrong parity; pyserial would have it passed on. A checksum
        # modulo 128 does not see a flipped top bit, but framing notices a missing byte.
        attributes = termios.tcgetattr(opened.fileno())
        attributes[0] |= termios.INPCK | termios.IGNPAR
        termios.tcsetattr(opened.fileno(), termios.TCSANOW, attributes)
    return opened
