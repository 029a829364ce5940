"""What a rig file names: a driver, which is the dataclass of its settings and what makes the device from them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Driver:
    """A driver, as an entry point of another package declares it too.

    Attributes
    ----------
    settings : a dataclass; its fields are the keys of the rig file, its ``__post_init__`` refuses by ``ValueError``.
        It can be imported by its name: the process that records is another than the one that reads the rig file
    make : makes the device, not connected yet, from such settings
    specify : says from such settings what the device is, as the specification of its role in
        :mod:`robot_drivers.specification`; None says nothing
    """

    settings: type[Any]
    make: Callable[[Any], Any]
    specify: Callable[[Any], object] | None = None
