"""An emulated sensor on RDT on the network: RDT, web pages and command interface, as a client meets them."""

from contextlib import ExitStack, closing

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.command_interface import CommandServer
from robot_drivers.ati.emulator.faults import Faults, LinkCounts
from robot_drivers.ati.emulator.pages import Pages
from robot_drivers.ati.emulator.rdt import RdtCommands, RdtServer
from robot_drivers.ati.emulator.web import WebServer
from robot_drivers.closing import ClosedAtExit


class RdtSensorEmulator(ClosedAtExit):
    """A sensor that serves from construction until :meth:`close`, also as a context manager.

    Parameters
    ----------
    box : what it measures and is set to
    commands : RDT requests that its product knows
    pages : of its product

    Attributes
    ----------
    rdt_port, http_port, command_port : where it listens
    epoch_ns : host time at which the device time that its wrench source is asked for is zero
    """

    def __init__(self, box: Box, commands: RdtCommands, pages: Pages) -> None:
        self._box = box
        self.epoch_ns = box.epoch_ns
        with ExitStack() as servers:
            self._rdt = servers.enter_context(closing(RdtServer(box, commands)))
            web = servers.enter_context(closing(WebServer(box, pages)))
            command = servers.enter_context(closing(CommandServer(box)))
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
        """Trip a monitor condition; its latch stays until a client resets it."""
        self._box.latch()

    def close(self) -> None:
        """Switch the sensor off."""
        self._servers.close()
