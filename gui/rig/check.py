"""The run-up checks as a job of their own: the devices have to be let go before."""

from daq.device_checks import DeviceReport, check_devices
from daq.rig import Rig, make_devices
from daq.timing.laboratory_time import in_the_time_of
from gui.jobs.process import Reporter

_SECONDS = 2.0


def check_rig(reporter: Reporter, rig: Rig) -> list[DeviceReport]:
    """Look who answers and what each device delivers; nothing moves."""
    reporter("looking at every device for a few seconds, nothing moves", 0, 1)
    with in_the_time_of(rig):
        return check_devices(rig, make_devices(rig), _SECONDS)
