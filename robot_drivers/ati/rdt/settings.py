"""How to reach a sensor that streams RDT, and what to ask of it."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from robot_drivers.errors import ConfigurationError
from robot_drivers.setting_checks import check_positive, check_rated_wrench
from robot_drivers.specification import Six


@dataclass(frozen=True, slots=True, kw_only=True)
class RdtSettings:
    """What every sensor on RDT can be asked; each product adds its own.

    Attributes
    ----------
    host : name or IPv4 address (192.168.1.1 from the factory)
    rdt_port, http_port : UDP stream and web pages
    mode : ``"real-time"``, one record a datagram, or ``"buffered"``, several, which adds their age as latency
    rate_hz : RDT output rate to set at connection; None leaves the sensor as it is. The sensor keeps it
    rated_wrench : ± N and N·m beyond which a sample is not usable; None takes what the sensor tells
    usable_status : status words with which a sample may be used; None takes those of the product
    silence_s : silence after which the start request is sent again, then at doubling intervals. A sensor may have
        been powered up anew; the request moves nothing. Never less than three datagram periods
    start_timeout_s : longest wait for a first record
    answer_timeout_s : longest wait for each answer over HTTP and TCP
    request_pause_s : shortest time between two HTTP requests; boxes were seen to drop requests in quick succession
    batch_s : shortest time between two batches that ``read`` returns (only where the kernel stamps arrivals)
    """

    FASTEST_RDT_HZ: ClassVar[int]

    host: str
    rdt_port: int = 49152
    http_port: int = 80
    mode: Literal["real-time", "buffered"] = "real-time"
    rate_hz: int | None = None
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
        if self.rate_hz is not None and not 1 <= self.rate_hz <= self.FASTEST_RDT_HZ:
            raise ConfigurationError(f"force sensor rate_hz {self.rate_hz}: must be 1..{self.FASTEST_RDT_HZ}")
        check_positive(self, "force sensor", "silence_s", "start_timeout_s", "answer_timeout_s")
        check_rated_wrench(self.rated_wrench)
