"""The arms of the e-Series: lengths, ends of their joints, range of the sensor in the flange.

Lengths: Denavit-Hartenberg parameters of Universal Robots' support article "DH parameters for calculations of
kinematics and dynamics". Ranges: the data sheets.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from robot_drivers.specification import Six

Arm = Literal["UR3e", "UR5e", "UR10e", "UR16e"]
Joints = tuple[float, float, float, float, float, float]

FULL_TURN = 2.0 * math.pi
JOINT_SPEED = math.radians(120.0)
"""Slowest of the fastest joints of all four arms, rad/s."""

ALPHA: Joints = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)
"""Twists of the links, the same in all arms, rad."""


@dataclass(frozen=True, slots=True)
class Lengths:
    """Denavit-Hartenberg lengths of the six links, m."""

    a: Joints
    d: Joints


LENGTHS: Mapping[Arm, Lengths] = {
    "UR3e": Lengths((0.0, -0.24355, -0.2132, 0.0, 0.0, 0.0), (0.15185, 0.0, 0.0, 0.13105, 0.08535, 0.0921)),
    "UR5e": Lengths((0.0, -0.425, -0.3922, 0.0, 0.0, 0.0), (0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996)),
    "UR10e": Lengths((0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0), (0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655)),
    "UR16e": Lengths((0.0, -0.4784, -0.36, 0.0, 0.0, 0.0), (0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655)),
}

RATED_WRENCH: Mapping[Arm, Six] = {
    "UR3e": (30.0, 30.0, 30.0, 10.0, 10.0, 10.0),
    "UR5e": (50.0, 50.0, 50.0, 10.0, 10.0, 10.0),
    "UR10e": (100.0, 100.0, 100.0, 10.0, 10.0, 10.0),
    "UR16e": (160.0, 160.0, 160.0, 10.0, 10.0, 10.0),
}
"""Range of the sensor in the flange, ± N and ± N·m."""
