"""How to reach and use a Net F/T box on its native CAN protocol."""

import math
from dataclasses import dataclass
from typing import Literal

from robot_drivers.ati.can.force_sensor import CanSettings
from robot_drivers.ati.netbox_can.frames import FIELDS, LONG_ORDER, Field
from robot_drivers.ati.transducer.gamma import RATED_WRENCH
from robot_drivers.ati.transducer.scaling import Scaling
from robot_drivers.ati.transducer.status import STATUS_MAPS
from robot_drivers.errors import ConfigurationError, DeviceProtocolError

_BITS_LONG, _BITS_SHORT = 55 + 4 * 111, 55 + 2 * 111  # request and answers, before bit stuffing


@dataclass(frozen=True, slots=True, kw_only=True)
class NetBoxCanSettings(CanSettings):
    """How to reach and use one box; see also :class:`~robot_drivers.ati.can.force_sensor.CanSettings`.

    What the manual pages at hand leave open is a setting here; its default is the likeliest reading, and what can be
    checked at connection is checked. "CAN Bus" has to be selected on the box's Communications page, and its Pwr/CAN
    connector powered.

    Attributes
    ----------
    base : 11-bit base identifier, set with ``bitrate`` by the box's DIP switches
    counts_per_force, counts_per_torque, force_unit, torque_unit : of the active configuration, from the box's web
        page; CAN does not carry them
    answer : ``"long"``, 32-bit counts in four messages, or ``"short"``, 16-bit counts in two
    scale_factors : counts per 16-bit count for Fx Fy Fz Tx Ty Tz, which READCALINFO of the TCP command interface tells;
        needed for short answers
    long_request_code, clear_latch_code : request bytes that are inferred from those of short answer and bias
    long_order : fields of the long answer, two in each of the messages base + 1 to base + 4
    sample_rate_hz : rate of the sample number, the device's clock; measured at connection and refused where it
        differs. 0: it is no clock, and the device time is that of the request on the host clock
    short_status : which half of the 32-bit status word a short answer carries
    status_map, usable_status : as in :class:`~robot_drivers.ati.netft.settings.NetFTSettings`
    rated_wrench : ± N and N·m beyond which a sample is not usable; see the certificate of the unit in use
    transducer_serial : of the certificate, for the record
    """

    base: int
    counts_per_force: float
    counts_per_torque: float
    force_unit: str = "N"
    torque_unit: str = "N-m"
    answer: Literal["long", "short"] = "long"
    scale_factors: tuple[float, float, float, float, float, float] | None = None
    long_request_code: int = 0x01
    clear_latch_code: int = 0x08
    long_order: tuple[Field, ...] = LONG_ORDER
    sample_rate_hz: float = 7000.0
    short_status: Literal["upper", "lower"] = "upper"
    status_map: Literal["net-ft", "axia"] = "net-ft"
    usable_status: tuple[int, ...] | None = None
    rated_wrench: tuple[float, float, float, float, float, float] = RATED_WRENCH
    transducer_serial: str = "not told"

    def __post_init__(self) -> None:
        CanSettings.__post_init__(self)
        if not 0 <= self.base <= 0x7FF - 6:
            raise ConfigurationError(f"Net Box base {self.base:#x}: must be 0..0x7f9, as six more follow it")
        if sorted(self.long_order) != sorted(FIELDS):
            raise ConfigurationError(
                f"Net Box long_order {list(self.long_order)}: must name each of {', '.join(LONG_ORDER)} once"
            )
        factors = self.scale_factors or ()
        if self.answer == "short" and not factors:
            raise ConfigurationError("Net Box answer 'short' needs scale_factors, which READCALINFO tells")
        if not all(math.isfinite(factor) and factor > 0 for factor in factors):
            raise ConfigurationError(f"Net Box scale_factors {factors}: must be positive")
        for code in (self.long_request_code, self.clear_latch_code):
            if not 0 <= code <= 0xFF:
                raise ConfigurationError(f"Net Box request code {code:#x}: must be one byte")
        if not 0 <= self.sample_rate_hz < math.inf:
            raise ConfigurationError(f"Net Box sample_rate_hz {self.sample_rate_hz}: must be positive, or 0")
        if self.status_map not in STATUS_MAPS:
            raise ConfigurationError(
                f"Net Box status_map {self.status_map!r}: must be one of {', '.join(STATUS_MAPS)}"
            )
        fastest = self.bitrate / (_BITS_LONG if self.answer == "long" else _BITS_SHORT)
        if self.rate_hz > fastest:
            raise ConfigurationError(
                f"Net Box rate_hz {self.rate_hz}: {self.answer} answers fit at most {fastest:.0f} times a "
                f"second into {self.bitrate} bit/s"
            )
        try:
            _ = self.scaling
        except DeviceProtocolError as error:
            raise ConfigurationError(f"Net Box: {error}") from error

    @property
    def scaling(self) -> Scaling:
        """Units and counts per unit."""
        return Scaling(self.force_unit, self.torque_unit, self.counts_per_force, self.counts_per_torque)
