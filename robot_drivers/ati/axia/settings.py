"""How to reach and use an Ethernet Axia."""

from dataclasses import dataclass
from typing import ClassVar

from robot_drivers.ati.rdt.settings import RdtSettings
from robot_drivers.setting_checks import check_positive


@dataclass(frozen=True, slots=True, kw_only=True)
class AxiaSettings(RdtSettings):
    """How to reach and use one sensor; what is not described here is of :class:`RdtSettings`.

    Attributes
    ----------
    sample_rate_hz : rate at which the sensor samples, and ``ft_sequence`` counts; None takes what it tells
    """

    FASTEST_RDT_HZ: ClassVar[int] = 7912

    sample_rate_hz: float | None = None

    def __post_init__(self) -> None:
        RdtSettings.__post_init__(self)  # the class that slots make has no super() of its own
        check_positive(self, "force sensor", "sample_rate_hz")
