"""What the gripper is told to do: the rows of the three trajectories."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.experiment.model import TrajectoryKind

FloatArray = NDArray[np.float64]

KINDS: tuple[TrajectoryKind, ...] = ("pull", "gradual_tangent_pull", "twist_and_pull")
GRIPPER_AT_REST = np.array([0.04, 0.0, 0.0])

_STEPS = {"pull": 10, "gradual_tangent_pull": 20, "twist_and_pull": 10}
_TURNING_AXIS = {
    "pull": (0.0, 0.0, 0.0),
    "gradual_tangent_pull": (0.0, 0.0, 1.0),
    "twist_and_pull": (1.0, 0.0, 0.0),
}
_TURN_DEG = {"pull": 0.0, "gradual_tangent_pull": 30.0, "twist_and_pull": 45.0}
_RETURN_STEPS = 5
_HALF_STEP_S = 0.5
_HOLD_S = 2.0
# Further rows of the hold at the end, s after the one before.
_LONG_HOLD_S = (3.0, 5.0, 10.0)


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """One row an instant.

    Attributes
    ----------
    kind : of trajectory
    order : of the experiment on this mounting, from 1
    time : (n,) s
    phase, step : as the experiment folder has them
    position : (n, 3) gripper's origin, m
    rotation : n orientations of the gripper
    """

    kind: TrajectoryKind
    order: int
    time: FloatArray
    phase: tuple[str, ...]
    step: NDArray[np.int64]
    position: FloatArray
    rotation: Rotation

    @property
    def travel(self) -> FloatArray:
        """Distance from the first row's position, (n,) m."""
        return np.linalg.norm(self.position - self.position[0], axis=1)

    def moved(self, position: FloatArray) -> "Rows":
        """Return the same rows at other positions."""
        return replace(self, position=position)

    def turned(self, rotation: Rotation) -> "Rows":
        """Return the same rows at other orientations."""
        return replace(self, rotation=rotation)


@dataclass(frozen=True, slots=True)
class Manner:
    """How far, how fast, and with which holds.

    Attributes
    ----------
    distance : total pull, m
    turn : share of the usual one
    slowness : factor of all times
    hold : after a step, s
    long_hold : further rows of the hold at the end, s after the one before
    steps : share of the usual number
    """

    distance: float = 0.02
    turn: float = 1.0
    slowness: float = 1.0
    hold: float = _HOLD_S
    long_hold: tuple[float, ...] = _LONG_HOLD_S
    steps: float = 1.0


def rows_of(kind: TrajectoryKind, order: int, manner: Manner) -> Rows:
    """Return the rows of a trajectory: retraction in steps of two rows and a hold, a long hold, the way back."""
    steps = round(_STEPS[kind] * manner.steps)
    table: list[tuple[float, str, int, float]] = [(0.0, "hold", 0, 0.0)]

    def add(after: float, phase: str, step: int, done: float) -> None:
        table.append((table[-1][0] + after * manner.slowness, phase, step, done))

    for step in range(1, steps + 1):
        add(_HALF_STEP_S, "ramp", step, (step - 0.5) / steps)
        add(_HALF_STEP_S, "ramp", step, step / steps)
        add(manner.hold, "hold", step, step / steps)
    for pause in manner.long_hold:
        add(pause, "hold", steps, 1.0)
    for back in range(1, _RETURN_STEPS + 1):
        add(_HALF_STEP_S, "return", steps + back, 1 - (back - 0.5) / _RETURN_STEPS)
        add(_HALF_STEP_S, "return", steps + back, 1 - back / _RETURN_STEPS)
        add(manner.hold, "return_hold", steps + back, 1 - back / _RETURN_STEPS)
    times, phases, numbers, shares = zip(*table, strict=True)
    done = np.array(shares)
    angle = np.radians(_TURN_DEG[kind]) * manner.turn
    return Rows(
        kind,
        order,
        np.round(times, 3),
        tuple(phases),
        np.array(numbers, dtype=np.int64),
        GRIPPER_AT_REST + np.outer(done * manner.distance, [1.0, 0.0, 0.0]),
        Rotation.from_rotvec(np.outer(done * angle, _TURNING_AXIS[kind])),
    )
