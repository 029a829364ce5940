"""An ATI Net F/T box on its native CAN protocol: resolved counts, polled by the host."""

from robot_drivers.ati.netbox_can.driver import NetBoxCan
from robot_drivers.ati.netbox_can.settings import NetBoxCanSettings

__all__ = ["NetBoxCan", "NetBoxCanSettings"]
