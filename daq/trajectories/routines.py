"""Trajectories beside the retractions: lift, relaxation, free-air poses, motions for calibrations, and repetition.

Long ways are cut into pieces that the usual limits of a step allow; the pieces are passed through, and only where
they end is measured.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from daq.errors import TrajectoryError
from daq.frames import IDENTITY, pose, rotation
from daq.trajectories.trajectory import STANDARD, STANDARD_SPEED, Phase, Step, Trajectory
from robot_drivers.protocols import Pose, Speed

PIECE_M = 0.005
PIECE_RAD = math.radians(10.0)

_REST_S = 1.0
_SWAY_SPEED = Speed(linear=0.015, angular=0.25)
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def lift(height_m: float = 0.005, steps: int = 5, measure_s: float = 0.5) -> Trajectory:
    """Go straight up along z in equal steps, measure at each, and come down again."""
    heights = height_m * np.arange(1, steps + 1) / steps
    stops = [Pose((0.0, 0.0, height)) for height in heights.tolist()]
    return through("lift", [*stops, IDENTITY], STANDARD_SPEED, measure_s)


def relaxation(
    way_m: float = 0.01, holds_s: Sequence[float] = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0), measure_s: float = 0.5
) -> Trajectory:
    """Pull along x without stopping to measure, watch the force relax at ``holds_s`` after arrival, and return.

    Raises
    ------
    TrajectoryError
        The holds do not ascend by at least the measuring window.
    """
    out = Pose((way_m, 0.0, 0.0))
    trajectory = through("relaxation", [out], STANDARD_SPEED, measure_s, settle_s=0.0)
    last, stood_s, holds = trajectory.steps[-1].number, 0.0, []
    for hold_s in holds_s:
        wait_s = hold_s - stood_s - measure_s
        if wait_s < 0:
            raise TrajectoryError(
                f"relaxation: the hold at {hold_s:g} s begins before the one before has ended"
            )
        holds.append(Step(last, "hold", out, wait_s, measure_s))
        stood_s = hold_s
    back = _pieces(out, IDENTITY, last + 1, "return_hold", measure_s)
    return replace(trajectory, steps=(*trajectory.steps, *holds, *back))


def tare_poses(
    tilt_rad: float = math.radians(20.0), lift_m: float = 0.0, measure_s: float = 1.0
) -> Trajectory:
    """Tilt the unloaded gripper about its origin both ways about x and y, so that gravity turns in the sensor.

    It is for free air: nothing may be held, and ``lift_m`` takes the gripper clear of the table first.
    """
    up = (0.0, 0.0, lift_m)
    tilts = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)]
    stops = [pose(up, Rotation.identity())]
    for axis in tilts:
        stops += [pose(up, Rotation.from_rotvec(tilt_rad * np.array(axis))), pose(up, Rotation.identity())]
    return through("tare_poses", [*stops, IDENTITY], STANDARD_SPEED, measure_s)


def marker_poses(
    reach_m: float = 0.008, tilt_rad: float = math.radians(20.0), measure_s: float = 0.8
) -> Trajectory:
    """Show a marker on the gripper to the cameras: to both sides along x, y and z, and turned about each."""
    stops = []
    for number, axis in enumerate(np.vstack([np.eye(3), -np.eye(3)])):
        turn = Rotation.from_rotvec(tilt_rad * np.roll(axis, number % 3 + 1))
        stops += [pose(reach_m * axis, Rotation.identity()), pose(0.5 * reach_m * axis, turn)]
    return through("marker_poses", [*stops, IDENTITY], STANDARD_SPEED, measure_s)


def sway(
    amplitude_m: float = 0.0025, periods: int = 10, axis: Sequence[float] = (1.0, 0.0, 0.0)
) -> Trajectory:
    """Go to and fro along an axis of the tissue frame without a stop, to find the latency between streams."""
    ends = [amplitude_m * sign * np.asarray(axis) for _ in range(periods) for sign in (1.0, -1.0)]
    return _unmeasured("sway", [pose(end, Rotation.identity()) for end in ends], 0.0)


def tap(way_m: float = 0.001, taps: int = 12, axis: Sequence[float] = (1.0, 0.0, 0.0)) -> Trajectory:
    """Make brisk small moves, out and back, with pauses of which no two are alike."""
    out = pose(way_m * np.asarray(axis), Rotation.identity())
    return _unmeasured("tap", [out, IDENTITY] * taps, 0.4)


def repeated(trajectory: Trajectory, times: int) -> Trajectory:
    """Go through the steps after rest several times in one recording; the trajectory has to end at rest.

    Raises
    ------
    TrajectoryError
        It ends elsewhere, or ``times`` is not positive.
    """
    rest, *steps = trajectory.steps
    if times < 1 or not np.allclose(steps[-1].T_rest_gripper.position, 0.0, atol=1e-9):
        raise TrajectoryError(
            f"{trajectory.kind}: {times} repetitions of a trajectory that ends at "
            f"{steps[-1].T_rest_gripper.position} m; let it return to rest"
        )
    rounds = max(step.number for step in steps)
    again = [replace(step, number=step.number + turn * rounds) for turn in range(times) for step in steps]
    return replace(trajectory, steps=(rest, *again))


def through(
    kind: str, stops: Sequence[Pose], speed: Speed, measure_s: float, settle_s: float = 0.3
) -> Trajectory:
    """Return rest, and then each of the ``stops`` (``T_rest_gripper``), measured after its pieces."""
    steps = [Step(0, "hold", IDENTITY, settle_s, _REST_S)]
    present = IDENTITY
    for number, stop in enumerate(stops, start=1):
        steps += _pieces(present, stop, number, "hold", measure_s, settle_s)
        present = stop
    return Trajectory(kind, speed, tuple(steps))


def _pieces(
    start: Pose, stop: Pose, number: int, phase: Phase, measure_s: float, settle_s: float = 0.3
) -> Iterator[Step]:
    """Yield the steps of one straight way: pieces that are passed through, then the stop."""
    way = np.subtract(stop.position, start.position)
    first = rotation(start.quaternion_wxyz)
    turn = (rotation(stop.quaternion_wxyz) * first.inv()).as_rotvec()
    count = max(1, math.ceil(np.linalg.norm(way) / PIECE_M - 1e-9))
    count = max(count, math.ceil(np.linalg.norm(turn) / PIECE_RAD - 1e-9))
    for piece in range(1, count):
        share = piece / count
        between = pose(start.position + share * way, Rotation.from_rotvec(share * turn) * first)
        yield Step(number, phase, between, 0.0, 0.0)
    yield Step(number, phase, stop, settle_s, measure_s)


def _unmeasured(kind: str, stops: Sequence[Pose], longest_pause_s: float) -> Trajectory:
    """Return a motion through ``stops`` and back to rest, with irregular pauses, and a window only at its end."""
    pauses = [longest_pause_s * (_GOLDEN * number % 1.0) for number in range(1, len(stops) + 1)]
    moves = [
        Step(number, "hold", stop, pause_s, 0.0)
        for number, (stop, pause_s) in enumerate(zip(stops, pauses, strict=True), start=1)
    ]
    rest = Step(0, "hold", IDENTITY, 0.3, _REST_S)
    end = Step(len(stops) + 1, "return_hold", IDENTITY, 0.3, 0.5)
    return Trajectory(kind, _SWAY_SPEED, (rest, *moves, end))


RETRACTIONS: Mapping[str, Callable[[], Trajectory]] = {
    **{kind: retraction.trajectory for kind, retraction in STANDARD.items()},
    "lift": lift,
    "relaxation": relaxation,
}
"""The trajectories with a name that move the tissue which the gripper holds, with their usual parameters."""

NAMED: Mapping[str, Callable[[], Trajectory]] = {
    **RETRACTIONS,
    "tare_poses": tare_poses,
    "marker_poses": marker_poses,
    "sway": sway,
    "tap": tap,
}
"""Every trajectory that has a name of its own: the retractions, and the motions that calibrations are made from."""
