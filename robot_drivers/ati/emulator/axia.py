"""An emulated Ethernet Axia: RDT, web pages and command interface, as a client meets them.

Written from 9610-05-Ethernet Axia-09 and 9620-05-C-Ethernet Axia-02; what the tables at hand do not tell is that of the
Net F/T box.
"""

from collections.abc import Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.command_interface import CommandServer
from robot_drivers.ati.emulator.faults import Faults, LinkCounts
from robot_drivers.ati.emulator.rdt import RdtCommands, RdtServer
from robot_drivers.ati.emulator.settings import BoxConfiguration, EmulatorSettings
from robot_drivers.ati.emulator.transducers import AxiaRange
from robot_drivers.ati.emulator.web import DONE, WebServer, set_rdt_rate, xml
from robot_drivers.closing import ClosedAtExit
from robot_drivers.emulated_wrench import WrenchSource

_COMMANDS = RdtCommands(single_block=(0x1, 0x2), resets_latch=False, to_another=False)
_FASTEST_RDT_HZ = 7912
_Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class AxiaEmulatorSettings:
    """What the emulated sensor is like.

    Attributes
    ----------
    host, rdt_port, http_port, command_port : where it listens; port 0 takes a free one
    product, serial, part_number : what it tells about itself and its calibration
    calibration : index of the calibration in force
    rated_wrench : range of that calibration, N and N·m
    tells_range : whether the page of its calibration does; the tables at hand do not say
    counts_per_force, counts_per_torque : per N and N·m
    rdt_enabled, rate_hz, buffer_size : RDT settings at power-up
    sample_rate_hz : at which it samples and counts ``ft_sequence``, on its own clock
    clock_ppm : how much faster than the host's that clock runs, 1e-6
    noise_std : standard deviation of the white noise, N and N·m; that of a real Axia is not known
    seed : of noise and faults
    burst_s : records are produced and sent in bursts this long
    min_request_interval_s : HTTP requests that follow each other faster are dropped without answer
    """

    host: str = "127.0.0.1"
    rdt_port: int = 0
    http_port: int = 0
    command_port: int = 0
    product: str = "Ethernet Axia"
    serial: str = "FT00001"
    part_number: str = "SI-500-20"
    calibration: int = 0
    rated_wrench: _Six = (500.0, 500.0, 900.0, 20.0, 20.0, 20.0)
    tells_range: bool = True
    counts_per_force: float = 1e6
    counts_per_torque: float = 1e6
    rdt_enabled: bool = True
    rate_hz: int = 1000
    buffer_size: int = 10
    sample_rate_hz: int = 3906
    clock_ppm: float = 0.0
    noise_std: _Six = (0.02, 0.02, 0.02, 0.0005, 0.0005, 0.0005)
    seed: int = 0
    burst_s: float = 0.004
    min_request_interval_s: float = 0.0

    def box(self) -> EmulatorSettings:
        """Return what it shares with a Net F/T box."""
        return EmulatorSettings(
            host=self.host,
            rdt_port=self.rdt_port,
            http_port=self.http_port,
            command_port=self.command_port,
            product=self.product,
            serial=self.serial,
            configurations=(
                BoxConfiguration(
                    name=self.part_number,
                    torque_unit="Nm",
                    counts_per_force=self.counts_per_force,
                    counts_per_torque=self.counts_per_torque,
                ),
            ),
            scale_factors=self._scale_factors(),
            rdt_enabled=self.rdt_enabled,
            rate_hz=self.rate_hz,
            buffer_size=self.buffer_size,
            internal_rate_hz=self.sample_rate_hz,
            clock_ppm=self.clock_ppm,
            noise_std=self.noise_std,
            seed=self.seed,
            burst_s=self.burst_s,
            min_request_interval_s=self.min_request_interval_s,
        )

    def _scale_factors(self) -> tuple[int, int, int, int, int, int]:
        """Return counts per 16-bit count that let the range fit."""
        counts = [self.counts_per_force] * 3 + [self.counts_per_torque] * 3
        fx, fy, fz, tx, ty, tz = (
            int(rated * per // 0x7FFF) + 1 for rated, per in zip(self.rated_wrench, counts, strict=True)
        )
        return (fx, fy, fz, tx, ty, tz)


class AxiaEmulator(ClosedAtExit):
    """A sensor that feels ``source``; serving from construction until :meth:`close`, also as a context manager.

    Attributes
    ----------
    rdt_port, http_port, command_port : where it listens
    """

    def __init__(self, source: WrenchSource, settings: AxiaEmulatorSettings | None = None) -> None:
        self._settings = settings or AxiaEmulatorSettings()
        self._box = Box(source, self._settings.box(), AxiaRange(self._settings.rated_wrench))
        with ExitStack() as servers:
            self._rdt = servers.enter_context(closing(RdtServer(self._box, _COMMANDS)))
            web = servers.enter_context(closing(WebServer(self._box, self._pages)))
            command = servers.enter_context(closing(CommandServer(self._box)))
            self._servers = servers.pop_all()
        self.rdt_port, self.http_port, self.command_port = self._rdt.port, web.port, command.port

    @property
    def counts(self) -> LinkCounts:
        """What happened to the records so far."""
        return self._rdt.counts

    def inject(self, faults: Faults) -> None:
        """Replace the faults in force; ``Faults()`` ends them."""
        self._box.inject(faults)

    def latch_monitor_condition(self) -> None:
        """Trip a monitor condition; its latch stays until the command interface clears it."""
        self._box.latch()

    def close(self) -> None:
        """Switch the sensor off."""
        self._servers.close()

    def _pages(self, box: Box, path: str, query: Mapping[str, str]) -> str | None:
        settings = self._settings
        if path == "/netftapi2.xml":
            return xml("netft", self._configuration(box))
        if (
            path == "/netftcalapi.xml"
            and query.get("index", f"{settings.calibration}") == f"{settings.calibration}"
        ):
            return xml("netftCalibration", self._calibration())
        if path == "/comm.cgi":
            set_rdt_rate(box, query, _FASTEST_RDT_HZ)
            return DONE
        return None

    def _configuration(self, box: Box) -> dict[str, object]:
        settings, now = self._settings, box.sample_now()
        return {
            "runstat": f"0x{int(now.status[0]):08X}",
            "runft": ";".join(map(str, now.counts[0].tolist())),
            "setrate": settings.sample_rate_hz,
            "setuserfilter": 0,
            "cfgcalsel": settings.calibration,
            "cfgcalsn": settings.serial,
            "scfgfu": "N",
            "scfgtu": "Nm",
            "cfgcpf": f"{settings.counts_per_force:.10g}",
            "cfgcpt": f"{settings.counts_per_torque:.10g}",
            "comrdte": "Enabled" if settings.rdt_enabled else "Disabled",
            "comrdtrate": box.rate_hz,
            "comrdtbsiz": box.buffer_size,
            "prodname": settings.product,
        }

    def _calibration(self) -> dict[str, object]:
        settings = self._settings
        told = {"calmr": ";".join(f"{rated:g}" for rated in settings.rated_wrench)}
        return {
            "calsn": settings.serial,
            "calpn": settings.part_number,
            "scalfu": "N",
            "scaltu": "Nm",
            **(told if settings.tells_range else {}),
            "calcpf": f"{settings.counts_per_force:.10g}",
            "calcpt": f"{settings.counts_per_torque:.10g}",
        }
