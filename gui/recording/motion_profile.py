"""A trajectory in time: where the gripper is at every moment, and when is measured. For a look before it is done."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from daq.frames import rotation
from daq.trajectories import Trajectory
from daq.trajectories.planned import move_duration_s
from robot_drivers.protocols import FloatArray

_SAMPLES_PER_MOVE = 8


@dataclass(frozen=True, slots=True)
class MotionProfile:
    """The planned motion, in the axes of the tissue frame from the gripper's rest pose on.

    Attributes
    ----------
    time_s : (n,)
    position_m : (n, 3)
    rotation_vector : (n, 3) rad
    windows_s : (m, 2) begin and end of each measuring window
    """

    time_s: FloatArray
    position_m: FloatArray
    rotation_vector: FloatArray
    windows_s: FloatArray

    @property
    def duration_s(self) -> float:
        """How long it takes, without sealing the recording."""
        return float(self.time_s[-1])

    @property
    def turn_deg(self) -> FloatArray:
        """Angle from the rest pose (n,)."""
        return np.degrees(np.linalg.norm(self.rotation_vector, axis=1))


def motion_profile(trajectory: Trajectory) -> MotionProfile:
    """Lay a trajectory out in time: constant speed between the steps, settle and measure at each."""
    rest = trajectory.steps[0]
    now = rest.settle_s + rest.measure_s
    times = [0.0, now]
    positions, rotations = [np.zeros(3)] * 2, [Rotation.identity()] * 2
    windows = [(rest.settle_s, now)]
    present = rest.T_rest_gripper
    for step in trajectory.steps[1:]:
        target = step.T_rest_gripper
        duration_s = move_duration_s(trajectory, present, target)
        if duration_s > 0.0:
            ends = Rotation.concatenate([rotation(present.quaternion_wxyz), rotation(target.quaternion_wxyz)])
            turn = Slerp([0.0, 1.0], ends)
            for share in np.linspace(0.0, 1.0, _SAMPLES_PER_MOVE + 1)[1:].tolist():
                times.append(now + share * duration_s)
                positions.append(
                    (1.0 - share) * np.array(present.position) + share * np.array(target.position)
                )
                rotations.append(turn(share))
        now += duration_s + step.settle_s + step.measure_s
        times.append(now)
        positions.append(np.array(target.position))
        rotations.append(rotation(target.quaternion_wxyz))
        if step.measure_s > 0.0:
            windows.append((now - step.measure_s, now))
        present = target
    return MotionProfile(
        np.array(times), np.array(positions), Rotation.concatenate(rotations).as_rotvec(), np.array(windows)
    )


def in_words(duration_s: float) -> str:
    """Return a duration as an operator would say it."""
    minutes, seconds = divmod(round(duration_s), 60)
    return f"{minutes} min {seconds:02d} s" if minutes else f"{seconds} s"
