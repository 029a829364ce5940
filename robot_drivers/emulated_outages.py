"""When an emulated device is out of reach: a cable that is out, a power supply that is off."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Outages:
    """What any device suffers; its own faults begin with these. Times count from the injection of the faults.

    Attributes
    ----------
    unplug_at_s, unplug_for_s : the cable is out meanwhile
    restart_at_s, restart_for_s : the device has no power meanwhile
    """

    unplug_at_s: float = math.inf
    unplug_for_s: float = 0.0
    restart_at_s: float = math.inf
    restart_for_s: float = 0.0

    def unplugged(self, elapsed_s: float) -> bool:
        """Tell whether the cable is out."""
        return self.unplug_at_s <= elapsed_s < self.unplug_at_s + self.unplug_for_s

    def unpowered(self, elapsed_s: float) -> bool:
        """Tell whether the device has no power."""
        return self.restart_at_s <= elapsed_s < self.restart_at_s + self.restart_for_s

    def out_of_reach(self, elapsed_s: float) -> bool:
        """Tell whether nothing comes to the device or from it."""
        return self.unplugged(elapsed_s) or self.unpowered(elapsed_s)
