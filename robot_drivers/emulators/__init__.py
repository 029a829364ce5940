"""Every emulator as something that can be started by name, with its settings and faults as options."""

from collections.abc import Mapping

from robot_drivers.emulators.cameras import CAMERAS
from robot_drivers.emulators.force_sensors import FORCE_SENSORS
from robot_drivers.emulators.kind import EmulatorKind
from robot_drivers.emulators.robots import ROBOTS

__all__ = ["KINDS", "EmulatorKind"]

KINDS: Mapping[str, EmulatorKind] = {**FORCE_SENSORS, **ROBOTS, **CAMERAS}
