"""The ABB IRB 140 behind an open-abb server."""

from robot_drivers.abb.open_abb.driver import OpenABB, OpenABBSettings

__all__ = ["OpenABB", "OpenABBSettings"]
