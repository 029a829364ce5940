"""The TCP command interface of the emulated box, written from the byte tables of the manual."""

import socketserver
import struct

import numpy as np

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.tcp import POLL_S, TcpServer

_HEADER = 0x1234
_REQUEST_LENGTH = 20
_READFT, _READCALINFO, _WRITETRANSFORM = 0, 1, 2


class CommandServer(TcpServer):
    """Answers requests of 20 bytes."""

    def __init__(self, box: Box) -> None:
        super().__init__(box.settings.command_port, _Client, box, "RDT emulator: commands")


class _Client(socketserver.BaseRequestHandler):
    server: CommandServer

    def handle(self) -> None:
        self.request.settimeout(POLL_S)
        received = b""
        while not self.server.closing:
            try:
                piece = self.request.recv(_REQUEST_LENGTH)
            except TimeoutError:
                continue
            except ConnectionError:
                return
            if not piece or not self.server.box.reachable:
                return
            received += piece
            while len(received) >= _REQUEST_LENGTH:
                self.request.sendall(_answer(self.server.box, received[:_REQUEST_LENGTH]))
                received = received[_REQUEST_LENGTH:]


def _answer(box: Box, request: bytes) -> bytes:
    """Return the answer to one request; an unknown command has none."""
    command = request[0]
    if command == _READFT:
        (system_commands,) = struct.unpack_from(">H", request, 18)
        if system_commands & 1:
            box.set_bias()
        if system_commands & 2:
            box.clear_latch()
        return _reading(box)
    if command == _READCALINFO:
        configuration = box.configuration
        return struct.pack(
            ">HBBII6H",
            _HEADER,
            configuration.force_code,
            configuration.torque_code,
            round(configuration.counts_per_force),
            round(configuration.counts_per_torque),
            *box.settings.scale_factors,
        )
    if command == _WRITETRANSFORM:
        box.tool_transform = struct.unpack_from(">BB6h", request, 1)
        return struct.pack(">HBB", _HEADER, command, 0)
    return b""


def _reading(box: Box) -> bytes:
    measured = box.sample_now()
    counts16 = np.clip(measured.counts[0] // box.settings.scale_factors, -0x8000, 0x7FFF)
    return struct.pack(">HH6h", _HEADER, int(measured.status[0]) >> 16, *counts16.tolist())
