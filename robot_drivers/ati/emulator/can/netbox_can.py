"""An emulated Net F/T box on a CAN bus of python-can, set to "CAN Bus", written from its manual's tables."""

import struct
from dataclasses import dataclass, field

import can
import numpy as np

from robot_drivers.ati.emulator.box import Box, Measurement
from robot_drivers.ati.emulator.can.node import AnswerCounts, CanNode, Frames, astray
from robot_drivers.ati.emulator.faults import Faults
from robot_drivers.ati.emulator.settings import EmulatorSettings
from robot_drivers.ati.emulator.transducers import GammaGages
from robot_drivers.closing import ClosedAtExit
from robot_drivers.emulated_wrench import WrenchSource

_LONG, _SHORT, _BIAS, _CLEAR_LATCH = 0x01, 0x02, 0x04, 0x08


@dataclass(frozen=True, slots=True, kw_only=True)
class NetBoxCanEmulatorSettings:
    """What the emulated box is like.

    Attributes
    ----------
    channel, interface : of python-can; ``"virtual"`` reaches this process only
    base : base identifier
    box : the box behind the connector; its network settings mean nothing here
    short_status_shift : which bits of the status word a short answer carries, from this one on
    seed : of the faults
    """

    channel: str
    interface: str = "virtual"
    base: int = 0x1B0
    box: EmulatorSettings = field(default_factory=EmulatorSettings)
    short_status_shift: int = 16
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class CanFaults:
    """Departures from a healthy bus; the default is none.

    Attributes
    ----------
    silence, halving, cutting : probability for each answer to be missing, to lack its last message, or to have a first
        message cut short
    bus_off : the controller has left the bus: it neither hears nor sends
    """

    silence: float = 0.0
    halving: float = 0.0
    cutting: float = 0.0
    bus_off: bool = False


class NetBoxCanEmulator(ClosedAtExit):
    """A box that senses ``source``; it answers from construction until :meth:`close`.

    Attributes
    ----------
    settings : as given
    faults : those of the bus in force; assign others at any time. Those of the box go to :meth:`inject`
    counts : what happened so far
    """

    def __init__(self, source: WrenchSource, settings: NetBoxCanEmulatorSettings) -> None:
        self.settings = settings
        self.faults = CanFaults()
        self.counts = AnswerCounts()
        self._box = Box(source, settings.box, GammaGages())
        self._random = np.random.default_rng(settings.seed)
        self._node = CanNode(
            settings.channel, settings.interface, "Net F/T emulator: CAN", self._answer_message
        )

    def inject(self, faults: Faults) -> None:
        """Replace the faults of the box in force; its cable is that of the bus, other network faults mean nothing."""
        self._box.inject(faults)

    def latch_monitor_condition(self) -> None:
        """Trip a monitor condition; its latch stays until the client clears it."""
        self._box.latch()

    def close(self) -> None:
        """Switch the box off."""
        self._node.close()

    def _answer_message(self, message: can.Message | None) -> Frames:
        self._box.update()
        if message is None or message.is_extended_id or message.arbitration_id != self.settings.base:
            return []
        if not self._box.reachable or self.faults.bus_off or len(message.data) != 1:
            return []
        answer = self._answer(message.data[0])
        return [(self.settings.base + offset, data) for offset, data in answer]

    def _answer(self, code: int) -> Frames:
        if code == _LONG:
            return self._disturbed(self._long(self._box.sample_now()))
        if code == _SHORT:
            return self._disturbed(self._short(self._box.sample_now()))
        if code == _BIAS:
            self._box.set_bias()
        elif code == _CLEAR_LATCH:
            self._box.clear_latch()
        return []

    def _long(self, measured: Measurement) -> Frames:
        fx, fy, fz, tx, ty, tz = measured.counts[0].tolist()
        status, sample = int(measured.status[0]), int(measured.ft_sequence[0])
        return [
            (1, struct.pack("<ii", fx, tx)),
            (2, struct.pack("<ii", fy, ty)),
            (3, struct.pack("<ii", fz, tz)),
            (4, struct.pack("<II", status, sample)),
        ]

    def _short(self, measured: Measurement) -> Frames:
        scaled = np.rint(measured.counts[0] / self.settings.box.scale_factors)
        fx, fy, fz, tx, ty, tz = np.clip(scaled, -(2**15), 2**15 - 1).astype(int).tolist()
        status = int(measured.status[0]) >> self.settings.short_status_shift & 0xFFFF
        return [
            (5, struct.pack("<hhhh", fx, tx, fy, ty)),
            (6, struct.pack("<hhHH", fz, tz, status, int(measured.ft_sequence[0]) & 0xFFFF)),
        ]

    def _disturbed(self, answer: Frames) -> Frames:
        return astray(answer, self.faults, self._random, self.counts)
