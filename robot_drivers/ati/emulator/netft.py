"""An emulated Net F/T box."""

from robot_drivers.ati.emulator.box import Box
from robot_drivers.ati.emulator.pages import Pages, Tags, calibration_tags, configuration_tags
from robot_drivers.ati.emulator.rdt import RdtCommands
from robot_drivers.ati.emulator.sensor import RdtSensorEmulator
from robot_drivers.ati.emulator.settings import EmulatorSettings
from robot_drivers.ati.emulator.transducers import GammaGages
from robot_drivers.emulated_wrench import WrenchSource


class NetFTEmulator(RdtSensorEmulator):
    """A box that senses ``source``."""

    def __init__(self, source: WrenchSource, settings: EmulatorSettings | None = None) -> None:
        super().__init__(Box(source, settings or EmulatorSettings(), GammaGages()), RdtCommands(), _PAGES)


def _configuration(box: Box, index: str | None) -> Tags | None:
    settings = box.settings
    shown = "0" if index is None else index
    if shown not in map(str, range(len(settings.configurations))):
        return None
    configuration = settings.configurations[int(shown)]
    return {
        **configuration_tags(box, configuration),
        "setcfgsel": settings.active_configuration,
        "cfgnam": configuration.name,
        "cfgcalsel": 0,
    }


def _calibration(box: Box, _index: str | None) -> Tags:
    return calibration_tags(box, box.settings.calibration_counts)


_PAGES = Pages(_configuration, _calibration, fastest_rdt_hz=7000)
