"""How to reach and use a NETCANOEM board."""

from dataclasses import dataclass

from robot_drivers.ati.can.force_sensor import CanSettings
from robot_drivers.ati.netcanoem.frames import DEFAULT_BASE
from robot_drivers.ati.transducer.gamma import RATED_WRENCH
from robot_drivers.errors import ConfigurationError

_DEFAULT_BITRATE = 250_000
_FASTEST_RATE_HZ = 800  # at the default bit rate, where a request with its answers has some 260 bits


@dataclass(frozen=True, slots=True, kw_only=True)
class NetCANOEMSettings(CanSettings):
    """How to reach and use one board; see also :class:`~robot_drivers.ati.can.force_sensor.CanSettings`.

    Attributes
    ----------
    base : base identifier, the number of 7 bits before it is shifted
    calibration : slot of the calibration, 0..15; selected at connection, as the board forgets it
    rated_wrench : ± N and N·m beyond which a sample is not usable; see the certificate of the unit in use
    """

    bitrate: int = _DEFAULT_BITRATE
    base: int = DEFAULT_BASE
    calibration: int = 0
    rated_wrench: tuple[float, float, float, float, float, float] = RATED_WRENCH

    def __post_init__(self) -> None:
        CanSettings.__post_init__(self)
        if not 0 <= self.base <= 0x7F:
            raise ConfigurationError(f"NETCANOEM base {self.base:#x}: must be 0..0x7f, before it is shifted")
        if not 0 <= self.calibration <= 15:
            raise ConfigurationError(f"NETCANOEM calibration {self.calibration}: must be 0..15")
        fastest = _FASTEST_RATE_HZ * self.bitrate / _DEFAULT_BITRATE
        if self.rate_hz > fastest:
            raise ConfigurationError(
                f"NETCANOEM rate_hz {self.rate_hz}: must be above 0 and at most {fastest:g} "
                f"at {self.bitrate} bit/s"
            )
