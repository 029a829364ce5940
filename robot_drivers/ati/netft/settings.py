"""How to reach and use a sensor on Net F/T."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from robot_drivers.ati.rdt.settings import RdtSettings
from robot_drivers.ati.transducer.gamma import RATED_WRENCH
from robot_drivers.ati.transducer.status import STATUS_MAPS
from robot_drivers.errors import ConfigurationError
from robot_drivers.setting_checks import check_positive
from robot_drivers.specification import Six


@dataclass(frozen=True, slots=True, kw_only=True)
class NetFTSettings(RdtSettings):
    """How to reach and use one sensor; what is not described here is of :class:`RdtSettings`.

    Attributes
    ----------
    command_port : TCP command interface
    scaling_source : where units and factors come from: the active configuration on the web pages, or
        READCALINFO of the command interface where there is no web server; that one tells neither product
        nor rate
    configuration_index : index of the active configuration, for firmware that does not tell (no
        ``setcfgsel``)
    internal_rate_hz : rate of ``ft_sequence``, the device's clock; 7000 on a Net F/T
    rated_wrench : ± N and N·m beyond which a sample is not usable; see the certificate of the unit in use
    status_map : meaning of the status word, ``"net-ft"`` or ``"axia"``; None chooses by the product name. The map
        of the Net F/T waits for confirmation by its manual
    """

    FASTEST_RDT_HZ: ClassVar[int] = 7000

    command_port: int = 49151
    scaling_source: Literal["web", "command-interface"] = "web"
    configuration_index: int | None = None
    internal_rate_hz: float = 7000.0
    rated_wrench: Six = RATED_WRENCH
    status_map: Literal["net-ft", "axia"] | None = None

    def __post_init__(self) -> None:
        RdtSettings.__post_init__(self)  # the class that slots make has no super() of its own
        check_positive(self, "force sensor", "internal_rate_hz")
        if self.scaling_source not in ("web", "command-interface"):
            raise ConfigurationError(
                f"force sensor scaling_source {self.scaling_source!r}: must be 'web' or 'command-interface'"
            )
        if self.status_map is not None and self.status_map not in STATUS_MAPS:
            raise ConfigurationError(
                f"force sensor status_map {self.status_map!r}: must be one of {', '.join(STATUS_MAPS)}"
            )
        if self.rate_hz is not None and self.scaling_source != "web":
            raise ConfigurationError(
                "force sensor rate_hz is set over the web pages: use scaling_source 'web' or omit rate_hz"
            )
