"""How to reach and use a sensor on Net F/T."""

import math
from dataclasses import dataclass
from typing import Literal

from robot_drivers.ati.netft.configuration import MAX_RDT_RATE_HZ
from robot_drivers.ati.transducer.gamma import RATED_WRENCH
from robot_drivers.ati.transducer.status import STATUS_MAPS
from robot_drivers.errors import ConfigurationError


@dataclass(frozen=True, slots=True, kw_only=True)
class NetFTSettings:
    """How to reach and use one sensor.

    Attributes
    ----------
    host : name or IPv4 address (192.168.1.1 from the factory)
    rdt_port, http_port, command_port : UDP stream, web pages, TCP command interface
    mode : ``"real-time"``, one record a datagram, or ``"buffered"``, several, which adds their age as latency
    rate_hz : RDT output rate to set at connection; None leaves the box as it is. The box keeps it
    scaling_source : where units and factors come from: the active configuration on the web pages, or
        READCALINFO of the command interface where there is no web server; that one tells neither product
        nor rate
    configuration_index : index of the active configuration, for firmware that does not tell (no
        ``setcfgsel``)
    internal_rate_hz : rate of ``ft_sequence``, the device's clock; 7000 on a Net F/T
    rated_wrench : ± N and N·m beyond which a sample is not usable; see the certificate of the unit in use
    status_map : meaning of the status word, ``"net-ft"`` or ``"axia"``; None chooses by the product name
    usable_status : status words with which a sample may be used; None takes those of the map. The map of the
        Net F/T waits for confirmation by its manual
    silence_s : silence after which the start request is sent again, then at doubling intervals. A sensor
        may have been powered up anew; the request moves nothing. Never less than three datagram periods
    start_timeout_s : longest wait of ``start`` for a first record
    answer_timeout_s : longest wait for each answer over HTTP and TCP
    request_pause_s : shortest time between two HTTP requests; boxes were seen to drop requests in quick
        succession
    batch_s : shortest time between two batches that ``read`` returns (only where the kernel stamps arrivals)
    """

    host: str
    rdt_port: int = 49152
    http_port: int = 80
    command_port: int = 49151
    mode: Literal["real-time", "buffered"] = "real-time"
    rate_hz: int | None = None
    scaling_source: Literal["web", "command-interface"] = "web"
    configuration_index: int | None = None
    internal_rate_hz: float = 7000.0
    rated_wrench: tuple[float, float, float, float, float, float] = RATED_WRENCH
    status_map: Literal["net-ft", "axia"] | None = None
    usable_status: tuple[int, ...] | None = None
    silence_s: float = 1.0
    start_timeout_s: float = 5.0
    answer_timeout_s: float = 2.0
    request_pause_s: float = 0.1
    batch_s: float = 0.004

    def __post_init__(self) -> None:
        if self.mode not in ("real-time", "buffered"):
            raise ConfigurationError(f"force sensor mode {self.mode!r}: must be 'real-time' or 'buffered'")
        if self.scaling_source not in ("web", "command-interface"):
            raise ConfigurationError(
                f"force sensor scaling_source {self.scaling_source!r}: must be 'web' or 'command-interface'"
            )
        if self.status_map is not None and self.status_map not in STATUS_MAPS:
            raise ConfigurationError(
                f"force sensor status_map {self.status_map!r}: must be one of {', '.join(STATUS_MAPS)}"
            )
        if self.rate_hz is not None and not 1 <= self.rate_hz <= MAX_RDT_RATE_HZ:
            raise ConfigurationError(f"force sensor rate_hz {self.rate_hz}: must be 1..{MAX_RDT_RATE_HZ}")
        if self.rate_hz is not None and self.scaling_source != "web":
            raise ConfigurationError(
                "force sensor rate_hz is set over the web pages: use scaling_source 'web' or omit rate_hz"
            )
        for name in ("internal_rate_hz", "silence_s", "start_timeout_s", "answer_timeout_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ConfigurationError(f"force sensor {name} {value}: must be positive")
