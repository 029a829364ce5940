r"""An emulated USB-CAN adapter on a serial port: ASCII lines of the Lawicel protocol, as slcan drivers speak it.

It joins a pseudo-terminal, which any program opens through python-can's ``slcan``, with a virtual bus in this process.
Commands end in CR and are answered by CR, or by BEL where they are not understood: ``Sn`` bit rate, ``O`` open,
``C`` close, ``tiiildd…`` standard frame, ``Tiiiiiiiildd…`` extended frame, ``V`` version, ``F`` flags. Frames from the
bus are written in the same form. Source: Lawicel CAN232 manual, version 3.
"""

import threading

import can

from robot_drivers.closing import ClosedAtExit
from robot_drivers.serial_line.emulator.line import FarEnd, far_end

_POLL_S = 0.001
_FRAMES = {"t": 3, "T": 8}  # digits of the identifier
_UNDERSTOOD, _REFUSED = b"\r", b"\a"


class SlcanAdapterEmulator(ClosedAtExit):
    """An adapter, plugged in from construction until :meth:`close`.

    Parameters
    ----------
    channel : of the virtual bus in this process

    Attributes
    ----------
    port : what a client opens with python-can's interface ``slcan``
    """

    def __init__(self, channel: str, line: FarEnd | None = None) -> None:
        self._line = line or far_end()
        self.port = self._line.port
        self._bus = can.Bus(interface="virtual", channel=channel)
        self._heard = b""
        self._open = False
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"emulated CAN adapter on {self.port}")
        self._thread.start()

    def close(self) -> None:
        """Pull the adapter out."""
        if not self._closing.is_set():
            self._closing.set()
            self._thread.join()
            self._bus.shutdown()
            self._line.close()

    def _run(self) -> None:
        while not self._closing.is_set():
            self._heard += self._line.receive(_POLL_S)
            *commands, self._heard = self._heard.split(b"\r")
            for command in commands:
                self._line.send(self._answer(command.decode("ascii", "replace")))
            while (message := self._bus.recv(0.0)) is not None:
                if self._open:
                    self._line.send(_line(message))

    def _answer(self, command: str) -> bytes:
        kind = command[:1]
        if kind in _FRAMES:
            return self._transmit(command)
        if kind == "V":
            return b"V1013\r"
        if kind == "F":
            return b"F00\r"
        if kind in ("O", "C"):
            self._open = kind == "O"
        return _UNDERSTOOD if kind in ("", "S", "O", "C") else _REFUSED

    def _transmit(self, command: str) -> bytes:
        digits = _FRAMES[command[0]]
        try:
            identifier, length = int(command[1 : 1 + digits], 16), int(command[1 + digits])
            data = bytes.fromhex(command[2 + digits :])
        except (ValueError, IndexError):
            return _REFUSED
        if not self._open or length != len(data) or length > 8:
            return _REFUSED
        extended = command[0] == "T"
        self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=extended))
        return b"Z\r" if extended else b"z\r"


def _line(message: can.Message) -> bytes:
    head = f"T{message.arbitration_id:08X}" if message.is_extended_id else f"t{message.arbitration_id:03X}"
    return f"{head}{message.dlc}{bytes(message.data).hex().upper()}\r".encode()
