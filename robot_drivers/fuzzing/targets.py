"""All fuzzed parsers, in the order in which chunks go to them."""

from robot_drivers.fuzzing import cameras, egm, genicam, open_abb, rapid, rtde
from robot_drivers.fuzzing.force_sensors import axia, bota, can_bus, net_ft, serial_ft
from robot_drivers.fuzzing.target import Target

TARGETS: tuple[Target, ...] = (
    *net_ft.TARGETS,
    *axia.TARGETS,
    *serial_ft.TARGETS,
    *bota.TARGETS,
    *can_bus.TARGETS,
    *egm.TARGETS,
    *rapid.TARGETS,
    *open_abb.TARGETS,
    *rtde.TARGETS,
    *cameras.TARGETS,
    *genicam.TARGETS,
)
