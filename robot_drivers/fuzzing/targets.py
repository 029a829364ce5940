"""All fuzzed parsers, in the order in which chunks go to them."""

from robot_drivers.fuzzing import axia, cameras, can_bus, egm, net_ft, open_abb, rapid, rtde, serial_ft
from robot_drivers.fuzzing.target import Target

TARGETS: tuple[Target, ...] = (
    *net_ft.TARGETS,
    *axia.TARGETS,
    *serial_ft.TARGETS,
    *can_bus.TARGETS,
    *egm.TARGETS,
    *rapid.TARGETS,
    *open_abb.TARGETS,
    *rtde.TARGETS,
    *cameras.TARGETS,
)
