"""The three standard retractions, as sequences of quasi-static steps: move, settle, measure.

All poses are of the gripper relative to its rest pose, in the tissue frame: the gripper's origin moves along x while
its orientation turns about one axis through that origin.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from daq.errors import TrajectoryError
from daq.frames import IDENTITY, pose
from robot_drivers.protocols import Pose, Speed

Phase = Literal["hold", "return_hold"]
Kind = Literal["pull", "gradual_tangent_pull", "twist_and_pull"]


@dataclass(frozen=True, slots=True)
class Step:
    """One row of the experiment to be.

    Attributes
    ----------
    number : of the retraction step, from 0 (at rest)
    phase : of the row that is measured here
    T_rest_gripper : where to stand; axes of the tissue frame, origin at the gripper's rest position
    settle_s : standing still before measuring
    measure_s : length of the measuring window
    """

    number: int
    phase: Phase
    T_rest_gripper: Pose
    settle_s: float
    measure_s: float


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A retraction: its steps, the first of them at rest, and the bounds of the speed between them."""

    kind: Kind
    speed: Speed
    steps: tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class Dwell:
    """How long a step stands.

    Attributes
    ----------
    rest_s : measuring window at rest, from which the force sensor is zeroed
    settle_s, measure_s : at each step
    holds_s : further measuring windows at the last step begin this long after its first, s
    """

    rest_s: float = 2.0
    settle_s: float = 0.5
    measure_s: float = 0.8
    holds_s: tuple[float, ...] = ()


STANDARD_SPEED = Speed(linear=0.005, angular=0.25)


@dataclass(frozen=True, slots=True)
class Retraction:
    """The parameters of a standard retraction; :meth:`trajectory` lays out its steps.

    Attributes
    ----------
    kind : what to call it
    steps, step_length : outward steps, and the way of each along +x, m
    axis : of the turn, unit vector in the tissue frame
    angle : turned in all, rad
    return_steps : the way back, in equal steps
    speed : between the steps
    """

    kind: Kind
    steps: int
    step_length: float
    axis: tuple[float, float, float]
    angle: float
    return_steps: int
    speed: Speed = STANDARD_SPEED
    dwell: Dwell = Dwell()

    def __post_init__(self) -> None:
        if self.steps < 1 or self.return_steps < 0:
            raise TrajectoryError(
                f"{self.kind}: {self.steps} steps out and {self.return_steps} back; at least one step out is needed"
            )
        if not (self.step_length > 0 and self.speed.linear > 0 and self.speed.angular > 0):
            raise TrajectoryError(f"{self.kind}: step length and speeds must be positive")
        if min(self.dwell.rest_s, self.dwell.measure_s) <= 0 or self.dwell.settle_s < 0:
            raise TrajectoryError(f"{self.kind}: rest and measuring windows must be longer than 0 s")

    def pose_at(self, fraction: float) -> Pose:
        """Return ``T_rest_gripper`` at a fraction (0 to 1) of the way out."""
        turn = Rotation.from_rotvec(fraction * self.angle * np.asarray(self.axis))
        return pose((fraction * self.steps * self.step_length, 0.0, 0.0), turn)

    def trajectory(self) -> Trajectory:
        """Lay out rest, outward steps, holds and return steps."""
        dwell = self.dwell
        steps = [Step(0, "hold", IDENTITY, dwell.settle_s, dwell.rest_s)]
        steps += [
            Step(number, "hold", self.pose_at(number / self.steps), dwell.settle_s, dwell.measure_s)
            for number in range(1, self.steps + 1)
        ]
        stood_s = 0.0
        for hold_s in dwell.holds_s:
            wait_s = hold_s - stood_s - dwell.measure_s
            if wait_s < 0:
                raise TrajectoryError(
                    f"{self.kind}: the hold at {hold_s:g} s begins before the one before has ended"
                )
            steps.append(Step(self.steps, "hold", self.pose_at(1.0), wait_s, dwell.measure_s))
            stood_s = hold_s
        steps += [
            Step(
                self.steps + number,
                "return_hold",
                self.pose_at(1.0 - number / self.return_steps),
                dwell.settle_s,
                dwell.measure_s,
            )
            for number in range(1, self.return_steps + 1)
        ]
        return Trajectory(self.kind, self.speed, tuple(steps))


PULL = Retraction("pull", 10, 0.002, (1.0, 0.0, 0.0), 0.0, return_steps=5)
GRADUAL_TANGENT_PULL = Retraction(
    "gradual_tangent_pull", 20, 0.001, (0.0, 0.0, 1.0), math.radians(30.0), return_steps=5
)
TWIST_AND_PULL = Retraction("twist_and_pull", 10, 0.002, (1.0, 0.0, 0.0), math.radians(45.0), return_steps=5)

STANDARD: dict[str, Retraction] = {
    retraction.kind: retraction for retraction in (PULL, GRADUAL_TANGENT_PULL, TWIST_AND_PULL)
}
