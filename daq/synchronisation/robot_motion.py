"""The robot's motion as the measure of time: how late another stream of the same recording shows it."""

from dataclasses import dataclass

import numpy as np

from daq.errors import SynchronisationError
from daq.recording.reader import Recording
from daq.rig import Rig
from daq.synchronisation.experiment_rows import gripper_in_tissue
from daq.synchronisation.exposed_images import measured_coordinates
from daq.synchronisation.stream_times import robot_times
from daq.timing.latency import Latency, estimate_latency, main_motion
from robot_drivers.protocols import FloatArray, IntArray

_LARGEST_S = 0.15


@dataclass(frozen=True, slots=True)
class RobotMotion:
    """The gripper's way along its main motion.

    Attributes
    ----------
    origin_ns : of ``time_s``, host clock
    time_s, way : (n,) s and m
    """

    origin_ns: int
    time_s: FloatArray
    way: FloatArray

    def latency_of(self, time_ns: IntArray, signal: FloatArray) -> Latency:
        """Return how late a signal (m,) follows the motion, up to 150 ms.

        Raises
        ------
        SynchronisationError
            The signals overlap by too little, or one of them does not move.
        """
        time_s = np.asarray((time_ns - self.origin_ns) * 1e-9, dtype=np.float64)
        return estimate_latency(self.time_s, self.way, time_s, signal, _LARGEST_S)


def robot_motion(recording: Recording, rig: Rig) -> RobotMotion:
    """Return the motion of a recording; raises SynchronisationError where the robot told fewer than two states."""
    robot = recording.robot
    time_ns = robot_times(robot).time_ns
    position, _ = gripper_in_tissue(robot, rig.frames)
    origin_ns = int(time_ns[0])
    return RobotMotion(origin_ns, np.asarray((time_ns - origin_ns) * 1e-9), main_motion(position))


def bead_motion(positions: FloatArray) -> FloatArray:
    """Return the main motion (p,) of the beads (p, m, 3) that are seen in every pair of images.

    Raises
    ------
    SynchronisationError
        There are no images, or no bead is in all of them.
    """
    positions = positions[..., measured_coordinates(positions)]
    seen = np.isfinite(positions).all(axis=(0, 2))
    if len(positions) == 0 or not seen.any():
        raise SynchronisationError("no bead is seen in every image of the motion; uncover one, or move less")
    return main_motion(positions[:, seen].reshape(len(positions), -1))
