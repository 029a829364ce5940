"""Driver of an ATI force/torque sensor behind a Net F/T box."""

from robot_drivers.ati.netft.command_interface import CommandInterface
from robot_drivers.ati.netft.configuration import read_configuration
from robot_drivers.ati.netft.settings import NetFTSettings
from robot_drivers.ati.rdt.configuration import RdtConfiguration
from robot_drivers.ati.rdt.protocol import Command
from robot_drivers.ati.rdt.sensor import RdtProduct, RdtSensor
from robot_drivers.ati.rdt.stream import RecordMeaning
from robot_drivers.ati.rdt.web import WebPages
from robot_drivers.ati.transducer.status import NET_FT, STATUS_MAPS, status_map


class NetFT(RdtSensor[NetFTSettings]):
    """A sensor on Net F/T, whose latch of monitor conditions can be cleared, from another thread as well."""

    def __init__(self, settings: NetFTSettings) -> None:
        super().__init__(settings, _PRODUCT)

    def reset_latch(self) -> None:
        """Clear the box's monitor-condition latch (not acknowledged)."""
        self._connected().send(Command.RESET_LATCH)


def _read(settings: NetFTSettings, web: WebPages) -> RdtConfiguration:
    if settings.scaling_source == "web":
        return read_configuration(web, settings.configuration_index)
    with CommandInterface(settings.host, settings.command_port, settings.answer_timeout_s) as interface:
        return RdtConfiguration(scaling=interface.read_calibration().scaling)


def _meaning(settings: NetFTSettings, configuration: RdtConfiguration) -> RecordMeaning:
    chosen = STATUS_MAPS[settings.status_map] if settings.status_map else status_map(configuration.product)
    return RecordMeaning(
        configuration.scaling.si_per_count,
        settings.rated_wrench,
        chosen.with_usable(settings.usable_status),
        settings.internal_rate_hz,
        configuration.datagram_period_s(settings.mode),
    )


_PRODUCT = RdtProduct("ATI Net F/T", NET_FT, _read, _meaning)
