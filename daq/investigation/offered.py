"""The manoeuvres among which an investigation chooses."""

import math
from itertools import product

from daq.investigation.manoeuvre import Manoeuvre, still

_LEFT, _RIGHT = (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)
_BACK, _UP = (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
_QUICK_M_S = 0.015

OPENING: tuple[Manoeuvre, ...] = tuple(
    Manoeuvre("pull", amplitude_m=amplitude, steps=3, return_steps=1) for amplitude in (0.006, 0.004, 0.002)
)
"""With which an investigation begins: the first of them that is safe before anything has been measured."""

OFFERED: tuple[Manoeuvre, ...] = (
    Manoeuvre("pull", amplitude_m=0.010),
    Manoeuvre("pull", amplitude_m=0.016, steps=6, return_steps=3),
    Manoeuvre("pull", amplitude_m=0.020, steps=8, return_steps=4),
    Manoeuvre("pull", amplitude_m=0.012, steps=3, speed_m_s=_QUICK_M_S, repetitions=2),
    Manoeuvre("hold", amplitude_m=0.012, holds_s=(2.0, 5.0, 12.0)),
    Manoeuvre("hold", amplitude_m=0.020, steps=8, return_steps=4, holds_s=(2.0, 5.0, 12.0)),
    *(
        Manoeuvre("pull", direction, amplitude, return_steps=3)
        for direction, amplitude in product((_LEFT, _RIGHT), (0.008, 0.014))
    ),
    Manoeuvre("pull", _UP, 0.008),
    Manoeuvre("compress", _BACK, 0.003, steps=3),
    Manoeuvre("tangent", amplitude_m=0.016, turn_rad=(0.0, 0.0, math.radians(30.0)), steps=6, return_steps=3),
    Manoeuvre("tangent", amplitude_m=0.016, turn_rad=(math.radians(45.0), 0.0, 0.0), steps=6, return_steps=4),
    # tissue of a fine mesh folds before the jaws between 20 and 25 degrees
    Manoeuvre("twist", turn_rad=(0.0, 0.0, math.radians(15.0))),
    Manoeuvre("twist", turn_rad=(math.radians(30.0), 0.0, 0.0), return_steps=3),
    still(20.0),
    still(60.0),
    Manoeuvre("tool_poses", amplitude_m=0.005),
    Manoeuvre("empty_motion"),
    Manoeuvre("board"),
)
"""What is chosen from afterwards."""
