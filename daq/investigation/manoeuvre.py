"""Manoeuvres as values: what the gripper does, how long that takes, and what it asks of a person."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.spatial.transform import Rotation

from daq.frames import IDENTITY, pose
from daq.rig import Vector
from daq.trajectories import STANDARD_SPEED, Dwell, Trajectory, lay_out
from daq.trajectories.planned import duration_s
from daq.trajectories.routines import marker_poses, repeated, tare_poses
from robot_drivers.protocols import Pose, Speed

Kind = Literal["pull", "tangent", "twist", "compress", "hold", "still", "tool_poses", "empty_motion", "board"]
KINDS: tuple[Kind, ...] = get_args(Kind)

STRAINING: tuple[Kind, ...] = ("pull", "tangent", "twist", "compress", "hold")
"""Kinds that strain the tissue; during all others nothing pulls at the gripper."""

RELEASED: tuple[Kind, ...] = ("tool_poses", "empty_motion", "board")
"""Kinds for which the tissue has to be out of the jaws."""

# What a person takes to do what is asked, s.
_HAND_S = 60.0
# Between the windows of a still minute, s.
_STILL_EVERY_S = 4.0
_AXES = "xyz"
# Of steps and repetitions: more is a mistake.
_MOST = 1000
_ASKED: dict[Kind, tuple[str, ...]] = {
    "tool_poses": (
        "take the tissue out of the jaws, and clear the way of the empty gripper: nothing may touch it",
    ),
    "empty_motion": (
        "take the tissue out of the jaws, and clear the way of the empty gripper",
        "fix the marker plate to the jaws, where both cameras see it",
    ),
    "board": ("take the tissue away, and lay the ruler board where it lay, in view of both cameras",),
}


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """One thing that the rig can do to learn more.

    Attributes
    ----------
    kind : pull, hold (a pull that stands at its end), tangent (a pull that turns), twist (a turn alone), compress
        (a push), still (nothing moves), tool_poses (the empty gripper turns in the air), empty_motion (it moves in view
        of the cameras), board (the cameras look at known places)
    direction : of the gripper's origin, unit vector in the tissue frame
    amplitude_m : its farthest way
    turn_rad : rotation vector there, about axes of the tissue frame
    speed_m_s : between the steps
    steps, return_steps : out and back
    holds_s : further measuring windows at the end begin this long after its first, s
    repetitions : how often it is gone through
    """

    kind: Kind
    direction: Vector = (1.0, 0.0, 0.0)
    amplitude_m: float = 0.0
    turn_rad: Vector = (0.0, 0.0, 0.0)
    speed_m_s: float = STANDARD_SPEED.linear
    steps: int = 4
    return_steps: int = 2
    holds_s: tuple[float, ...] = ()
    repetitions: int = 1

    def __post_init__(self) -> None:
        numbers = (*self.direction, self.amplitude_m, *self.turn_rad, self.speed_m_s, *self.holds_s)
        if self.kind not in KINDS:
            raise ValueError(f"kind: {self.kind!r} is none; choose one of {', '.join(KINDS)}")
        if not all(map(math.isfinite, numbers)) or self.amplitude_m < 0 or self.speed_m_s <= 0:
            raise ValueError(
                f"{self.kind}: way, turn and holds must be finite, amplitude_m not negative, speed_m_s positive"
            )
        if abs(math.hypot(*self.direction) - 1.0) > 1e-6:
            raise ValueError(
                f"{self.kind}: direction {self.direction} is no unit vector; divide by its length"
            )
        counts = (self.steps, self.return_steps, self.repetitions)
        if min(counts) < 1 or max(counts) > _MOST:
            raise ValueError(
                f"{self.kind}: steps, return_steps and repetitions must be 1 at least, {_MOST} at most"
            )
        if self.strains and not (self.amplitude_m or any(self.turn_rad)):
            raise ValueError(f"{self.kind}: goes nowhere; give it an amplitude or a turn")

    @property
    def strains(self) -> bool:
        """Whether it strains the tissue."""
        return self.kind in STRAINING

    @property
    def name(self) -> str:
        """What files and experiments are called after it."""
        parts: list[str] = [self.kind]
        if self.kind in RELEASED:
            return self.kind
        if self.kind == "still":
            parts.append(f"{self.holds_s[-1] if self.holds_s else 0:g}s")
        if self.amplitude_m:
            parts.append(f"{self.amplitude_m * 1e3:g}mm_{_along(self.direction)}")
        if any(self.turn_rad):
            parts.append(f"{math.degrees(math.hypot(*self.turn_rad)):.0f}deg")
        return "_".join(parts).replace("+", "").replace("-", "minus_").replace(".", "p")

    @property
    def words(self) -> str:
        """What is done, for a person."""
        match self.kind:
            case "still":
                return f"stand still for {self.duration_s:.0f} s"
            case "tool_poses":
                return "tilt the empty gripper four ways in free air"
            case "empty_motion":
                return "move the empty gripper in view of the cameras"
            case "board":
                return "look at the ruler board with the cameras"
        parts = []
        if self.amplitude_m:
            verb = "push" if self.kind == "compress" else "pull"
            parts.append(f"{verb} {self.amplitude_m * 1e3:g} mm along {_along(self.direction)}")
        if any(self.turn_rad):
            parts.append(f"turn by {math.degrees(math.hypot(*self.turn_rad)):.0f}°")
        text = " and ".join(parts)
        if self.holds_s:
            text += f", hold {self.holds_s[-1]:g} s"
        text += ", and return"
        return text if self.repetitions == 1 else f"{text}, {self.repetitions} times"

    @property
    def asks(self) -> tuple[str, ...]:
        """What a person has to do first."""
        return _ASKED.get(self.kind, ())

    def trajectory(self) -> Trajectory:
        """Lay out what the robot does."""
        # a quick pull turns no quicker than a standard one
        slower = min(1.0, self.speed_m_s / STANDARD_SPEED.linear)
        speed = Speed(self.speed_m_s, STANDARD_SPEED.angular * slower)
        if self.kind == "tool_poses":
            return tare_poses(lift_m=self.amplitude_m)
        if self.kind == "empty_motion":
            return marker_poses()
        if not self.strains:
            return lay_out(self.name, lambda _: IDENTITY, 1, 1, speed, Dwell(holds_s=self.holds_s))
        laid = lay_out(
            self.name, self._pose_at, self.steps, self.return_steps, speed, Dwell(holds_s=self.holds_s)
        )
        return repeated(laid, self.repetitions) if self.repetitions > 1 else laid

    @property
    def duration_s(self) -> float:
        """Of the rig, and of the person where something is asked, s."""
        return duration_s(self.trajectory()) + _HAND_S * len(self.asks)

    def _pose_at(self, share: float) -> Pose:
        turn = Rotation.from_rotvec(share * np.asarray(self.turn_rad))
        return pose(share * self.amplitude_m * np.asarray(self.direction), turn)


def still(duration_s: float) -> Manoeuvre:
    """Stand still about so long, in windows at equal distances."""
    windows = max(1, round(duration_s / _STILL_EVERY_S))
    return Manoeuvre("still", holds_s=tuple(_STILL_EVERY_S * number for number in range(1, windows + 1)))


def _along(direction: Vector) -> str:
    """Name a direction by its axis, or by its components."""
    for axis, value in zip(_AXES, direction, strict=True):
        if abs(abs(value) - 1.0) < 1e-6:
            return f"{'+' if value > 0 else '-'}{axis}"
    return "(" + ", ".join(f"{value:.2f}" for value in direction) + ")"
