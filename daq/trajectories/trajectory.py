"""Trajectories as sequences of quasi-static steps, move, settle, measure, and the three standard retractions.

All poses are of the gripper relative to its rest pose, in the tissue frame: the gripper's origin moves along x while
its orientation turns about one axis through that origin.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.spatial.transform import Rotation

from daq.errors import TrajectoryError
from daq.frames import IDENTITY, pose
from estimator.experiment.model import TrajectoryKind
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
    measure_s : length of the measuring window; a step of 0 s is only passed through
    """

    number: int
    phase: Phase
    T_rest_gripper: Pose
    settle_s: float
    measure_s: float


@dataclass(frozen=True, slots=True)
class Trajectory:
    """What to call it, the bounds of the speed between its steps, and the steps, the first of them at rest."""

    kind: str
    speed: Speed
    steps: tuple[Step, ...]


def experiment_kind(kind: str) -> TrajectoryKind:
    """Return what the experiment format calls a trajectory of this kind: its own name, or "other"."""
    known: dict[str, TrajectoryKind] = {name: name for name in get_args(TrajectoryKind)}
    return known.get(kind, "other")


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


_MOST_STEPS = 100_000

STANDARD_SPEED = Speed(linear=0.005, angular=0.25)


def lay_out(
    kind: str,
    pose_at: Callable[[float], Pose],
    steps: int,
    return_steps: int,
    speed: Speed = STANDARD_SPEED,
    dwell: Dwell | None = None,
) -> Trajectory:
    """Lay out rest, equal steps along a path, holds at its end, and equal steps back.

    Parameters
    ----------
    pose_at : ``T_rest_gripper`` at a fraction (0 to 1) of the way out; 0 is at rest

    Raises
    ------
    TrajectoryError
        Two holds overlap, or there is no step.
    """
    dwell = dwell or Dwell()
    _require_steps(kind, steps, return_steps)
    laid = [Step(0, "hold", IDENTITY, dwell.settle_s, dwell.rest_s)]
    laid += [
        Step(number, "hold", pose_at(number / steps), dwell.settle_s, dwell.measure_s)
        for number in range(1, steps + 1)
    ]
    stood_s = 0.0
    for hold_s in dwell.holds_s:
        wait_s = hold_s - stood_s - dwell.measure_s
        if wait_s < 0:
            raise TrajectoryError(f"{kind}: the hold at {hold_s:g} s begins before the one before has ended")
        laid.append(Step(steps, "hold", pose_at(1.0), wait_s, dwell.measure_s))
        stood_s = hold_s
    laid += [
        Step(
            steps + number,
            "return_hold",
            pose_at(1.0 - number / return_steps),
            dwell.settle_s,
            dwell.measure_s,
        )
        for number in range(1, return_steps + 1)
    ]
    return Trajectory(kind, speed, tuple(laid))


def _require_steps(kind: str, steps: int, return_steps: int) -> None:
    if not (1 <= steps <= _MOST_STEPS and 0 <= return_steps <= _MOST_STEPS):
        raise TrajectoryError(
            f"{kind}: {steps} steps out and {return_steps} back; at least one step out is needed, at most {_MOST_STEPS}"
        )


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
        _require_steps(self.kind, self.steps, self.return_steps)
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
        return lay_out(self.kind, self.pose_at, self.steps, self.return_steps, self.speed, self.dwell)


PULL = Retraction("pull", 10, 0.002, (1.0, 0.0, 0.0), 0.0, return_steps=5)
GRADUAL_TANGENT_PULL = Retraction(
    "gradual_tangent_pull", 20, 0.001, (0.0, 0.0, 1.0), math.radians(30.0), return_steps=5
)
TWIST_AND_PULL = Retraction("twist_and_pull", 10, 0.002, (1.0, 0.0, 0.0), math.radians(45.0), return_steps=5)

STANDARD: dict[str, Retraction] = {
    retraction.kind: retraction for retraction in (PULL, GRADUAL_TANGENT_PULL, TWIST_AND_PULL)
}
