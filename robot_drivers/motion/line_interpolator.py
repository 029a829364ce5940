"""A reference that moves along straight lines under limits of speed and acceleration, advanced step by step."""

import math

from robot_drivers.motion import poses
from robot_drivers.protocols import Pose, Speed

_SMALLEST = 1e-9  # m, rad: keeps a motion without length or turn finite


class LineInterpolator:
    """Begins at rest at ``pose``; speed and acceleration bound both the tool's way (m) and its turn (rad)."""

    def __init__(self, pose: Pose, acceleration: Speed) -> None:
        self._acceleration = acceleration
        self._start = self._target = pose
        self._done = 1.0
        self._rate = 0.0
        self._top_rate = 0.0
        self._rate_change = 0.0
        self._braking = False

    @property
    def pose(self) -> Pose:
        """Where the reference is."""
        return poses.interpolate(self._start, self._target, self._done)

    @property
    def resting(self) -> bool:
        """Whether it stands."""
        return self._rate == 0.0 and (self._done == 1.0 or self._braking)

    def begin(self, target: Pose, speed: Speed) -> None:
        """Start from rest to ``target``."""
        length, angle = poses.distance(self.pose, target)
        self._start, self._target, self._braking = self.pose, target, False
        self._done = self._rate = 0.0
        self._top_rate = _slower(length, angle, speed)
        self._rate_change = _slower(length, angle, self._acceleration)

    def brake(self) -> None:
        """Come to rest on the line."""
        self._braking = True

    def advance(self, duration_s: float) -> Pose:
        """Move on by ``duration_s`` and return the new pose."""
        if self.resting or duration_s <= 0:
            return self.pose
        change = self._rate_change * duration_s
        rest = 1.0 - self._done
        if self._braking:
            self._rate = max(self._rate - change, 0.0)
        else:
            # the speed from which braking in steps of this duration ends on the target
            stopping_rate = math.sqrt(change * change / 4 + 2 * self._rate_change * rest) - change / 2
            self._rate = min(self._rate + change, self._top_rate, stopping_rate)
        if self._rate * duration_s >= rest:
            self._done, self._rate = 1.0, 0.0
        else:
            self._done += self._rate * duration_s
        return self.pose


def _slower(length: float, angle: float, bound: Speed) -> float:
    return min(bound.linear / max(length, _SMALLEST), bound.angular / max(angle, _SMALLEST))
