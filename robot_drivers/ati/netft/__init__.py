"""An ATI Net F/T box or an Ethernet Axia: RDT over UDP, a command interface over TCP, web pages."""

from robot_drivers.ati.netft.driver import NetFT
from robot_drivers.ati.netft.settings import NetFTSettings

__all__ = ["NetFT", "NetFTSettings"]
