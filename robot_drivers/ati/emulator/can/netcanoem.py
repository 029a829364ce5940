"""An emulated NETCANOEM board on a CAN bus of python-can, written from the tables of its manual."""

import math
import struct
import time
from dataclasses import dataclass

import can
import numpy as np

from robot_drivers.ati.emulator.can.node import AnswerCounts, CanNode, Frames, astray
from robot_drivers.ati.transducer.gamma import GAGE_MATRIX
from robot_drivers.clock import host_time_ns
from robot_drivers.closing import ClosedAtExit
from robot_drivers.emulated_outages import Outages
from robot_drivers.emulated_wrench import WrenchSource

_GAGES_PER_SI = np.linalg.inv(1e-6 * GAGE_MATRIX)
_EVEN_GAGES, _ODD_GAGES = [0, 2, 4], [1, 3, 5]


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardSettings:
    """What the emulated board is like.

    Attributes
    ----------
    channel, interface : of python-can; ``"virtual"`` reaches this process only
    base : base identifier, before it is shifted
    serial, firmware : what it tells about itself
    calibrations : slots that hold a calibration, all of them that of unit FT33206
    counts_per_force, counts_per_torque, force_code, torque_code : what it tells about its units
    noise_std : white noise of every gage, gage counts
    seed : of noise and faults
    """

    channel: str = "netcanoem"
    interface: str = "virtual"
    base: int = 0x20
    serial: str = "FT33206"
    firmware: tuple[int, int, int] = (3, 8, 27)
    calibrations: tuple[int, ...] = (0,)
    counts_per_force: int = 1_000_000
    counts_per_torque: int = 1_000_000
    force_code: int = 2
    torque_code: int = 3
    noise_std: float = 1.0
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardFaults(Outages):
    """Departures from a healthy board; the default is none. Times count from the injection.

    Attributes
    ----------
    silence, halving, cutting : probability for each answer to the gages to be missing, to lack its second frame,
        or to have a first frame cut short
    status : bits raised in the status word
    broken_gages : gages whose cable is broken
    deaf_to_calibration : whether the selection of a calibration is ignored
    delay_s : extra time before every answer
    unplug_at_s, unplug_for_s : the cable is out meanwhile
    restart_at_s, restart_for_s : the board has no power meanwhile, and then selects calibration 0
    bus_off_at_s, bus_off_for_s : the board's CAN controller has counted too many errors and takes no part in the bus;
        afterwards the status word tells of it until the board is reset
    """

    silence: float = 0.0
    halving: float = 0.0
    cutting: float = 0.0
    status: int = 0
    broken_gages: tuple[int, ...] = ()
    deaf_to_calibration: bool = False
    delay_s: float = 0.0
    bus_off_at_s: float = math.inf
    bus_off_for_s: float = 0.0

    def off_the_bus(self, elapsed_s: float) -> bool:
        """Tell whether the board hears and sends nothing."""
        bus_off = self.bus_off_at_s <= elapsed_s < self.bus_off_at_s + self.bus_off_for_s
        return bus_off or self.out_of_reach(elapsed_s)


class NetCANOEMEmulator(ClosedAtExit):
    """A board that senses ``source``; it answers from construction until :meth:`close`.

    Attributes
    ----------
    settings : as given
    counts : what happened so far
    """

    def __init__(self, source: WrenchSource, settings: BoardSettings) -> None:
        self.counts = AnswerCounts()
        self._faults = BoardFaults()
        self._injected_ns = 0
        self._restart_due = self._bus_off_due = self._bus_error = False
        self._source = source
        self.settings = settings
        self._calibration = 0
        self._epoch_ns = host_time_ns()
        self._random = np.random.default_rng(settings.seed)
        self._node = CanNode(settings.channel, settings.interface, "NETCANOEM emulator", self._answer_message)

    @property
    def faults(self) -> BoardFaults:
        """The faults in force; others can be assigned at any time."""
        return self._faults

    @faults.setter
    def faults(self, faults: BoardFaults) -> None:
        self._injected_ns = host_time_ns()
        self._restart_due = self._bus_off_due = True
        self._faults = faults

    def reset(self) -> None:
        """Do what a loss of power does: select calibration 0."""
        self._calibration = 0
        self._bus_error = False

    def close(self) -> None:
        """Switch the board off."""
        self._node.close()

    def _answer_message(self, message: can.Message | None) -> Frames:
        if not self._works() or message is None or message.arbitration_id >> 4 != self.settings.base:
            return []
        time.sleep(self._faults.delay_s)
        answer = self._answer(message.arbitration_id & 0xF, bytes(message.data))
        return [(self.settings.base << 4 | opcode, data) for opcode, data in answer]

    def _works(self) -> bool:
        """Carry out what has become due; tell whether the board takes part in the bus."""
        elapsed_s = (host_time_ns() - self._injected_ns) * 1e-9
        if self._restart_due and elapsed_s >= self._faults.restart_at_s:
            self._restart_due = False
            self.reset()
        if self._bus_off_due and elapsed_s >= self._faults.bus_off_at_s:
            self._bus_off_due = False
            self._bus_error = True
        return not self._faults.off_the_bus(elapsed_s)

    def _answer(self, opcode: int, data: bytes) -> Frames:
        settings = self.settings
        if opcode == 0x0 and not data:
            return self._gages()
        if opcode == 0x2 and len(data) == 1 and data[0] < 6:
            row = GAGE_MATRIX[data[0]]
            return [(0x2 + k, struct.pack(">2f", *row[2 * k : 2 * k + 2])) for k in range(3)]
        if opcode == 0x5 and not data:
            return [(0x5, settings.serial.encode("ascii").ljust(8, b"\0"))]
        if opcode == 0x6 and len(data) == 1:
            if not self._faults.deaf_to_calibration:
                self._calibration = data[0]
            return [(0x6, bytes([self._calibration]))]
        if opcode == 0x7 and not data and settings.firmware >= (3, 7):
            return [(0x7, struct.pack(">II", settings.counts_per_force, settings.counts_per_torque))]
        if opcode == 0x8 and not data and settings.firmware >= (3, 7):
            return [(0x8, bytes([settings.force_code, settings.torque_code]))]
        if opcode == 0xC and not data:
            self.reset()
        if opcode == 0xF and not data:
            return [(0xF, struct.pack(">BBH", *settings.firmware))]
        return []

    def _gages(self) -> Frames:
        time_s = (host_time_ns() - self._epoch_ns) * 1e-9
        load = _GAGES_PER_SI @ self._source(time_s)
        gages = np.rint(load + self.settings.noise_std * self._random.standard_normal(6))
        gages[list(self._faults.broken_gages)] = 32767
        gages = np.clip(gages, -32768, 32767).astype(np.int64)
        status = self._faults.status
        if self._calibration not in self.settings.calibrations:
            status |= 1 << 15 | 1 << 6
        if self._bus_error:
            status |= 1 << 15 | 1 << 14
        even = struct.pack(">H3h", status, *gages[_EVEN_GAGES].tolist())
        odd = struct.pack(">3h", *gages[_ODD_GAGES].tolist())
        return astray([(0x0, even), (0x1, odd)], self._faults, self._random, self.counts)
