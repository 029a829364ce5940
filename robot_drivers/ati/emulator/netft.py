"""An emulated Net F/T box on the network: RDT, web pages and command interface, as a client meets them."""

from contextlib import ExitStack, closing

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.command_interface import CommandServer
from robot_drivers.ati.emulator.faults import Faults, LinkCounts
from robot_drivers.ati.emulator.rdt import RdtServer
from robot_drivers.ati.emulator.settings import EmulatorSettings
from robot_drivers.ati.emulator.web import WebServer
from robot_drivers.closing import ClosedAtExit
from robot_drivers.emulated_wrench import WrenchSource


class NetFTEmulator(ClosedAtExit):
    """A box that senses ``source``; serving from construction until :meth:`close`, also as a context manager.

    Attributes
    ----------
    rdt_port, http_port, command_port : where it listens
    epoch_ns : host time at which the device time that the source is asked for is zero
    """

    def __init__(self, source: WrenchSource, settings: EmulatorSettings | None = None) -> None:
        self._box = Box(source, settings or EmulatorSettings())
        self.epoch_ns = self._box.epoch_ns
        with ExitStack() as servers:
            self._rdt = servers.enter_context(closing(RdtServer(self._box)))
            web = servers.enter_context(closing(WebServer(self._box)))
            command = servers.enter_context(closing(CommandServer(self._box)))
            self._servers = servers.pop_all()
        self.rdt_port, self.http_port, self.command_port = self._rdt.port, web.port, command.port

    @property
    def counts(self) -> LinkCounts:
        """What happened to the records so far."""
        return self._rdt.counts

    @property
    def behind_s(self) -> float:
        """How late the next record of the stream is, s; 0 without one that could come."""
        return self._rdt.behind_s

    def inject(self, faults: Faults) -> None:
        """Replace the faults in force; ``Faults()`` ends them."""
        self._box.inject(faults)

    def disturb_clock(self, jump_s: float, drift_ppm: float) -> None:
        """Let the clock that ``ft_sequence`` counts jump, and drift from now on."""
        self._box.disturb_clock(jump_s, drift_ppm)

    def latch_monitor_condition(self) -> None:
        """Trip a monitor condition; its latch stays until the client resets it."""
        self._box.latch()

    def close(self) -> None:
        """Switch the box off."""
        self._servers.close()
