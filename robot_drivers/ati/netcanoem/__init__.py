"""An ATI NETCANOEM board: strain gages over CAN, polled and resolved by the host."""

from robot_drivers.ati.netcanoem.driver import NetCANOEM
from robot_drivers.ati.netcanoem.settings import NetCANOEMSettings

__all__ = ["NetCANOEM", "NetCANOEMSettings"]
