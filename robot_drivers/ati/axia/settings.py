"""How to reach and use an Ethernet Axia."""

import math
from dataclasses import dataclass
from typing import Literal

from robot_drivers.errors import ConfigurationError
from robot_drivers.specification import Six

MAX_RDT_RATE_HZ = 7912


@dataclass(frozen=True, slots=True, kw_only=True)
class AxiaSettings:
    """How to reach and use one sensor.

    Attributes
    ----------
    host : name or IPv4 address (192.168.1.1 from the factory)
    rdt_port, http_port : UDP stream and web pages
    mode : ``"real-time"``, one record a datagram, or ``"buffered"``, several, which adds their age as latency
    rate_hz : RDT output rate to set at connection, 1..7912; None leaves the sensor as it is. The sensor keeps it
    sample_rate_hz : rate at which the sensor samples, and ``ft_sequence`` counts; None takes what it tells
    rated_wrench : ± N and N·m beyond which a sample is not usable; None takes what it tells of its calibration
    usable_status : status words with which a sample may be used; None takes those of the manual
    silence_s : silence after which the start request is sent again, then at doubling intervals; the request moves
        nothing. Never less than three datagram periods
    start_timeout_s : longest wait for a first record
    answer_timeout_s : longest wait for each answer over HTTP
    request_pause_s : shortest time between two HTTP requests
    batch_s : shortest time between two batches that ``read`` returns (only where the kernel stamps arrivals)
    """

    host: str
    rdt_port: int = 49152
    http_port: int = 80
    mode: Literal["real-time", "buffered"] = "real-time"
    rate_hz: int | None = None
    sample_rate_hz: float | None = None
    rated_wrench: Six | None = None
    usable_status: tuple[int, ...] | None = None
    silence_s: float = 1.0
    start_timeout_s: float = 5.0
    answer_timeout_s: float = 2.0
    request_pause_s: float = 0.1
    batch_s: float = 0.004

    def __post_init__(self) -> None:
        if self.mode not in ("real-time", "buffered"):
            raise ConfigurationError(f"force sensor mode {self.mode!r}: must be 'real-time' or 'buffered'")
        if self.rate_hz is not None and not 1 <= self.rate_hz <= MAX_RDT_RATE_HZ:
            raise ConfigurationError(f"force sensor rate_hz {self.rate_hz}: must be 1..{MAX_RDT_RATE_HZ}")
        for name in ("sample_rate_hz", "silence_s", "start_timeout_s", "answer_timeout_s"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ConfigurationError(f"force sensor {name} {value}: must be positive")
        if self.rated_wrench is not None and not all(rated > 0 for rated in self.rated_wrench):
            raise ConfigurationError(f"force sensor rated_wrench {self.rated_wrench}: must be positive")
