"""From counts to SI: the units an ATI device can be set to, and its counts per unit."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robot_drivers.errors import DeviceProtocolError
from robot_drivers.protocols import FloatArray

POUND_FORCE = 4.4482216152605
"""N, exact by definition."""
KILOGRAM_FORCE = 9.80665
"""N, exact by definition."""
INCH = 0.0254
"""m, exact by definition."""
FOOT = 12 * INCH

_NEWTONS_BY_UNIT = {
    "lbf": POUND_FORCE,
    "n": 1.0,
    "klbf": 1000 * POUND_FORCE,
    "kn": 1000.0,
    "kgf": KILOGRAM_FORCE,
    "gf": KILOGRAM_FORCE / 1000,
    "g": KILOGRAM_FORCE / 1000,
}
_NEWTON_METRES_BY_UNIT = {
    "lbf-in": POUND_FORCE * INCH,
    "lbf-ft": POUND_FORCE * FOOT,
    "n-m": 1.0,
    "nm": 1.0,
    "n-mm": 0.001,
    "nmm": 0.001,
    "kgf-cm": KILOGRAM_FORCE * 0.01,
    "kg-cm": KILOGRAM_FORCE * 0.01,
    "kn-m": 1000.0,
}

FORCE_UNIT_BY_CODE = {1: "lbf", 2: "N", 3: "klbf", 4: "kN", 5: "kgf", 6: "gf"}
TORQUE_UNIT_BY_CODE = {1: "lbf-in", 2: "lbf-ft", 3: "N-m", 4: "N-mm", 5: "kgf-cm", 6: "kN-m"}


@dataclass(frozen=True, slots=True)
class Scaling:
    """Units and counts per unit of a device's output, by default those of a Gamma as delivered.

    ``force_unit`` and ``torque_unit`` in the device's own spelling, ``counts_per_force`` and
    ``counts_per_torque`` per that unit (not always integers).

    Raises
    ------
    DeviceProtocolError
        An unknown unit, or counts that are not a positive finite number.
    """

    force_unit: str = "N"
    torque_unit: str = "N-m"
    counts_per_force: float = 1e6
    counts_per_torque: float = 1e6

    def __post_init__(self) -> None:
        _size(self.force_unit, _NEWTONS_BY_UNIT, "force")
        _size(self.torque_unit, _NEWTON_METRES_BY_UNIT, "torque")
        for name in ("counts_per_force", "counts_per_torque"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise DeviceProtocolError(
                    f"{name.replace('_', ' ')} is {value}: must be positive; check the sensor's configuration"
                )

    @property
    def si_per_count(self) -> FloatArray:
        """The six factors, (6,): N per count for Fx Fy Fz, N·m per count for Tx Ty Tz."""
        force = _size(self.force_unit, _NEWTONS_BY_UNIT, "force") / self.counts_per_force
        torque = _size(self.torque_unit, _NEWTON_METRES_BY_UNIT, "torque") / self.counts_per_torque
        return np.array([force] * 3 + [torque] * 3)


def _size(unit: str, sizes: Mapping[str, float], quantity: str) -> float:
    size = sizes.get(unit.strip().lower())
    if size is None:
        raise DeviceProtocolError(f"unknown {quantity} unit {unit!r}: known are {', '.join(sizes)}")
    return size
