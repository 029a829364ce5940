"""What a rig file names: a driver, which is the dataclass of its settings and what makes the device from them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Driver:
    """A driver, as an entry point of another package declares it too.

    Attributes
    ----------
    settings : a dataclass; its fields are the keys of the rig file, its ``__post_init__`` refuses by ``ValueError``
    make : makes the device, not connected yet, from such settings
    """

    settings: type[Any]
    make: Callable[[Any], Any]
