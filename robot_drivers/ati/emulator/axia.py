"""An emulated Ethernet Axia.

Written from 9610-05-Ethernet Axia-09 and 9620-05-C-Ethernet Axia-02; what the tables at hand do not tell is that of the
Net F/T box.
"""

from dataclasses import dataclass

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.pages import Pages, Tags, calibration_tags, configuration_tags
from robot_drivers.ati.emulator.rdt import RdtCommands
from robot_drivers.ati.emulator.sensor import RdtSensorEmulator
from robot_drivers.ati.emulator.settings import BoxConfiguration, EmulatorSettings
from robot_drivers.ati.emulator.transducers import AxiaRange
from robot_drivers.emulated_wrench import WrenchSource

_COMMANDS = RdtCommands(single_block=(0x1, 0x2), resets_latch=False, to_another=False)
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


class AxiaEmulator(RdtSensorEmulator):
    """A sensor that feels ``source``."""

    def __init__(self, source: WrenchSource, settings: AxiaEmulatorSettings | None = None) -> None:
        settings = settings or AxiaEmulatorSettings()
        super().__init__(
            Box(source, settings.box(), AxiaRange(settings.rated_wrench)),
            _COMMANDS,
            Pages(
                lambda box, _index: _configuration(settings, box),
                lambda box, index: _calibration(settings, box, index),
                fastest_rdt_hz=7912,
            ),
        )


def _configuration(settings: AxiaEmulatorSettings, box: Box) -> Tags:
    now = box.sample_now()
    return {
        **configuration_tags(box, box.configuration),
        "runstat": f"0x{int(now.status[0]):08X}",
        "runft": ";".join(map(str, now.counts[0].tolist())),
        "setrate": settings.sample_rate_hz,
        "setuserfilter": 0,
        "cfgcalsel": settings.calibration,
        "cfgcalsn": settings.serial,
    }


def _calibration(settings: AxiaEmulatorSettings, box: Box, index: str | None) -> Tags | None:
    if index not in (None, f"{settings.calibration}"):
        return None
    told = {"calmr": ";".join(f"{rated:g}" for rated in settings.rated_wrench)}
    return {
        **calibration_tags(box, (settings.counts_per_force, settings.counts_per_torque)),
        "calpn": settings.part_number,
        "scalfu": "N",
        "scaltu": "Nm",
        **(told if settings.tells_range else {}),
    }
