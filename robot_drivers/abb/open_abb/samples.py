"""What an open-abb server told of the arm, kept until somebody reads it."""

import threading
from collections import deque
from dataclasses import dataclass

import numpy as np

from robot_drivers.abb.motion.kinematics import Joints
from robot_drivers.protocols import Pose, PoseBlock

_LONGEST_QUEUE = 100_000  # the oldest samples go first when nobody reads


@dataclass(frozen=True, slots=True)
class Sample:
    """One answer of the server.

    Attributes
    ----------
    host_time_ns : when it was asked
    T_base_tool : m
    joints : rad
    moving : whether a motion was under way
    """

    host_time_ns: int
    T_base_tool: Pose
    joints: Joints
    moving: bool


class SampleQueue:
    """Samples from any thread to any other."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._waiting: deque[Sample] = deque(maxlen=_LONGEST_QUEUE)
        self._newest: Sample | None = None
        self._received = 0

    @property
    def newest(self) -> Sample | None:
        """The last one that was put in, read or not."""
        return self._newest

    @property
    def received(self) -> int:
        """How many were put in."""
        return self._received

    def put(self, sample: Sample) -> None:
        """Add the newest."""
        with self._changed:
            self._waiting.append(sample)
            self._newest = sample
            self._received += 1
            self._changed.notify_all()

    def wait(self, timeout_s: float) -> bool:
        """Wait up to ``timeout_s`` for one that has not been read; return whether there is one."""
        with self._changed:
            return self._changed.wait_for(lambda: bool(self._waiting), timeout_s)

    def take(self) -> PoseBlock:
        """Return all that have not been read.

        The server tells neither a counter nor a clock: the counter numbers its answers, and the device time is that of
        the request on the host clock.
        """
        with self._changed:
            samples = list(self._waiting)
            first = self._received - len(samples) + 1
            self._waiting.clear()
        n = len(samples)
        stamps = np.array([sample.host_time_ns for sample in samples], np.int64)
        return PoseBlock(
            counter=first + np.arange(n, dtype=np.int64),
            device_time_s=stamps / 1e9,
            host_time_ns=stamps,
            position=np.array([s.T_base_tool.position for s in samples]).reshape(n, 3),
            quaternion_wxyz=np.array([s.T_base_tool.quaternion_wxyz for s in samples]).reshape(n, 4),
            joints=np.array([sample.joints for sample in samples]).reshape(n, 6),
            moving=np.array([sample.moving for sample in samples], np.bool_),
        )
