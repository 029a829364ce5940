"""Driver of an ATI Ethernet Axia, a sensor with its electronics in it."""

from robot_drivers.ati.axia.configuration import read_configuration
from robot_drivers.ati.axia.settings import AxiaSettings
from robot_drivers.ati.rdt.configuration import RdtConfiguration
from robot_drivers.ati.rdt.sensor import RdtProduct, RdtSensor
from robot_drivers.ati.rdt.stream import RecordMeaning
from robot_drivers.ati.rdt.web import WebPages
from robot_drivers.ati.transducer.status import AXIA
from robot_drivers.errors import ConfigurationError


class Axia(RdtSensor[AxiaSettings]):
    """An Ethernet Axia."""

    def __init__(self, settings: AxiaSettings) -> None:
        super().__init__(settings, _PRODUCT)


def _read(_settings: AxiaSettings, web: WebPages) -> RdtConfiguration:
    return read_configuration(web)


def _meaning(settings: AxiaSettings, configuration: RdtConfiguration) -> RecordMeaning:
    sample_rate_hz = settings.sample_rate_hz or configuration.sample_rate_hz
    if sample_rate_hz is None:
        raise ConfigurationError(
            f"the force sensor {settings.host} does not tell at what rate it samples: set sample_rate_hz to that "
            "of its ADC Settings page"
        )
    rdt_rate_hz = configuration.rdt_rate_hz
    if rdt_rate_hz is not None and rdt_rate_hz > sample_rate_hz:
        raise ConfigurationError(
            f"the force sensor {settings.host} samples {sample_rate_hz:g} times and sends {rdt_rate_hz} records a "
            "second, so that some come twice: set rate_hz to at most the first, or sample faster on its ADC "
            "Settings page"
        )
    rated_wrench = settings.rated_wrench or configuration.rated_wrench
    if rated_wrench is None:
        raise ConfigurationError(
            f"the force sensor {settings.host} does not tell its range: set rated_wrench to that of its certificate"
        )
    return RecordMeaning(
        configuration.scaling.si_per_count,
        rated_wrench,
        AXIA.with_usable(settings.usable_status),
        sample_rate_hz,
        configuration.datagram_period_s(settings.mode),
    )


_PRODUCT = RdtProduct("ATI Ethernet Axia", AXIA, _read, _meaning)
