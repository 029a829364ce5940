"""The software stop: watches every sample where it arrives, and holds the robot when a limit is passed.

It runs in the threads that read the devices, before anything is written. It is no emergency stop: that is a button
on a wire. Once it has stopped, nothing moves until somebody releases it with the words that say so.
"""

import threading
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.errors import SessionError
from daq.frames import inverse, rotation
from daq.limits import Limits
from daq.recording.streams import FORCE, ROBOT
from daq.rig import Frames
from daq.session.latency import LatencyTally
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import FloatArray, Frame, IntArray, Pose, PoseBlock, Robot, WrenchBlock

_SPEED_BASE_S = 0.02
_RATE_BASE_S = 0.02
_STREAMS = {FORCE: "force sensor", ROBOT: "robot"}


@dataclass(frozen=True, slots=True)
class Stop:
    """Why the robot was held.

    Attributes
    ----------
    reason : what happened, with value and limit
    cause_time_ns : receive stamp of the sample that told
    reaction_s : from that stamp to the robot's ``hold``, whose first act is to send the stop
    standstill_s : from that stamp to the return of ``hold``, when the robot has confirmed that it stands
    hold_error : what the robot answered if it could not be held; empty if it could
    """

    reason: str
    cause_time_ns: int
    reaction_s: float
    standstill_s: float
    hold_error: str = ""

    def describe(self) -> str:
        """Return one line for the operator."""
        if self.hold_error:
            return f"{self.reason}, but the robot could not be held ({self.hold_error}): press the emergency stop"
        return f"{self.reason}; the stop was sent {self.reaction_s * 1e3:.0f} ms after that was told"


class Guard:
    """Observes a recording and stops the robot. Until :meth:`arm` it only looks on, and nothing may move.

    The order is :meth:`watch_rest`, a while at rest, :meth:`arm`, and before every motion :meth:`begin_step`.

    The limits of force and torque are on the change since the reading at rest, so an unbiased sensor's offset and
    the weight of the tool do not count.

    Attributes
    ----------
    latency : from the receive stamp of the oldest sample in each block of the force sensor until all were checked,
        which is when a stop would have been sent
    """

    def __init__(self, limits: Limits, frames: Frames, robot: Robot) -> None:
        self._limits = limits
        T_tissue_base = inverse(frames.T_base_tissue.pose)
        # a matrix, for this is asked at every sample of the robot
        self._R_tissue_base = rotation(T_tissue_base.quaternion_wxyz).as_matrix()
        self._p_tissue_base = np.array(T_tissue_base.position)
        self._T_tool_gripper = frames.T_tool_gripper.pose
        self._robot = robot
        self._lock = threading.Lock()
        self._stop: Stop | None = None
        self._rest_samples: list[FloatArray] = []
        self._rest_wrench: FloatArray | None = None
        self._step_origin: FloatArray | None = None
        self.latency = LatencyTally()
        self._rate_base = (host_time_ns(), np.zeros(6))
        self._heard_ns = dict.fromkeys(_STREAMS.values(), host_time_ns())
        self._speed_base: tuple[float, FloatArray] | None = None

    @property
    def stop(self) -> Stop | None:
        """Why the robot was held, None while it was not; waits for a hold under way."""
        with self._lock:
            return self._stop

    @property
    def zero(self) -> FloatArray | None:
        """The mean reading at rest (6,), from which force and torque count; None before :meth:`arm`."""
        return self._rest_wrench

    def watch_rest(self) -> None:
        """Begin to take the mean reading at rest."""
        self._rest_samples = []

    def arm(self) -> None:
        """Begin to guard, with the mean of the readings since :meth:`watch_rest` as zero.

        Raises
        ------
        SessionError
            The force sensor gave no usable reading.
        """
        if not self._rest_samples:
            raise SessionError(
                "the force sensor gave no usable sample at rest, so nothing may move; check it for saturation"
            )
        self._rate_base = (host_time_ns(), np.zeros(6))
        self._rest_wrench = np.concatenate(self._rest_samples).mean(axis=0)

    def begin_step(self, T_base_tool: Pose) -> None:
        """Measure the length of the next step from this pose on."""
        position = np.array([T_base_tool.position])
        self._step_origin = self._gripper_positions(position, np.array([T_base_tool.quaternion_wxyz]))[0]

    def on_wrench(self, block: WrenchBlock) -> None:
        """Check force, torque and the usability of a block of samples."""
        if len(block):
            self._heard_ns["force sensor"] = int(block.host_time_ns[-1])
        rest = self._rest_wrench
        if rest is None:
            if np.any(block.usable):
                self._rest_samples.append(block.wrench[block.usable])
            return
        if len(block):
            self._check_wrenches(block, rest)
        if len(block) and self._stop is None:
            self.latency.add((host_time_ns() - int(block.host_time_ns[0])) * 1e-9)
        self._check_ages()

    def on_pose(self, block: PoseBlock) -> None:
        """Check the place, the step and the speed of a block of robot states."""
        if len(block):
            self._heard_ns["robot"] = int(block.host_time_ns[-1])
        if self._rest_wrench is None:
            return
        if len(block):
            self._check_poses(block)
        self._check_ages()

    def on_frames(self, camera: str, frames: Sequence[Frame]) -> None:
        """Images stop nothing."""

    def on_failure(self, stream: str, error: DeviceError) -> None:
        """Hold the robot when a device has failed."""
        if self._rest_wrench is not None:
            self.hold(f"the {_STREAMS.get(stream, stream)} has failed ({error})")

    def hold(self, reason: str, cause_time_ns: int | None = None) -> None:
        """Hold the robot, once, from any thread; ``cause_time_ns`` is when that was told, by default now."""
        cause_ns = host_time_ns() if cause_time_ns is None else cause_time_ns
        with self._lock:
            if self._stop is not None:
                return
            told_ns, hold_error = host_time_ns(), ""
            try:
                self._robot.hold()
            except DeviceError as error:
                hold_error = str(error)
            done_ns = host_time_ns()
            self._stop = Stop(
                reason, cause_ns, (told_ns - cause_ns) * 1e-9, (done_ns - cause_ns) * 1e-9, hold_error
            )

    def _check_wrenches(self, block: WrenchBlock, rest: FloatArray) -> None:
        if not np.all(block.usable):
            # first of all, for what such a sample reads means nothing and would be told as the reason
            first = int(np.argmin(block.usable))
            reason = f"the force sensor is saturated or faulty (status {block.status[first]:#x})"
            self.hold(reason, int(block.host_time_ns[first]))
        change = block.wrench - rest
        force = np.linalg.norm(change[:, :3], axis=1)
        torque = np.linalg.norm(change[:, 3:], axis=1)
        self._check_below(force, self._limits.force_n, "force", "N", block.host_time_ns)
        self._check_below(torque, self._limits.torque_nm, "torque", "N·m", block.host_time_ns)
        self._check_rate(block, change)

    def _check_rate(self, block: WrenchBlock, change: FloatArray) -> None:
        """Check how fast the mean wrench of a block has changed since that of an earlier one."""
        now_ns, present = int(block.host_time_ns[-1]), change.mean(axis=0)
        elapsed_s = (now_ns - self._rate_base[0]) * 1e-9
        if elapsed_s < _RATE_BASE_S:
            return
        rate = (present - self._rate_base[1]) / elapsed_s
        self._rate_base = (now_ns, present)
        force, torque, stamp = np.linalg.norm(rate[:3]), np.linalg.norm(rate[3:]), block.host_time_ns[-1:]
        self._check_below(np.array([force]), self._limits.force_rate_n_s, "force rate", "N/s", stamp)
        self._check_below(np.array([torque]), self._limits.torque_rate_nm_s, "torque rate", "N·m/s", stamp)

    def _check_poses(self, block: PoseBlock) -> None:
        positions = self._gripper_positions(block.position, block.quaternion_wxyz)
        inside = self._limits.workspace.contains(positions)
        if not np.all(inside):
            first = int(np.argmin(inside))
            where = ", ".join(f"{value * 1e3:.1f}" for value in positions[first])
            self.hold(f"the gripper at ({where}) mm is outside the workspace", int(block.host_time_ns[first]))
        if self._step_origin is not None:
            steps = np.linalg.norm(positions - self._step_origin, axis=1)
            self._check_below(steps * 1e3, self._limits.step_m * 1e3, "step", "mm", block.host_time_ns)
        self._check_speed(block, positions)

    def _check_speed(self, block: PoseBlock, positions: FloatArray) -> None:
        for time_s, position, stamp in zip(block.device_time_s, positions, block.host_time_ns, strict=True):
            if self._speed_base is None or time_s < self._speed_base[0]:
                self._speed_base = (float(time_s), position)
            elapsed = time_s - self._speed_base[0]
            if elapsed >= _SPEED_BASE_S:
                speed = np.array([np.linalg.norm(position - self._speed_base[1]) / elapsed])
                self._speed_base = (float(time_s), position)
                limit = self._limits.speed_m_s
                self._check_below(speed * 1e3, limit * 1e3, "speed", "mm/s", np.array([stamp]))

    def _check_below(self, values: FloatArray, limit: float, name: str, unit: str, stamps: IntArray) -> None:
        """Hold the robot when one of the values is above the limit, or no number."""
        beyond = ~(values <= limit)
        if np.any(beyond):
            first = int(np.argmax(beyond))
            reason = f"{name} of {values[first]:.3g} {unit} exceeds the limit of {limit:g} {unit}"
            self.hold(reason, int(stamps[first]))

    def _check_ages(self) -> None:
        now = host_time_ns()
        for stream, heard in self._heard_ns.items():
            age_s = (now - heard) * 1e-9
            if age_s > self._limits.communication_age_s:
                self.hold(
                    f"the {stream} has been silent for {age_s:.3g} s, "
                    f"the limit is {self._limits.communication_age_s:g} s",
                    heard + int(self._limits.communication_age_s * 1e9),
                )

    def _gripper_positions(self, position: FloatArray, quaternion_wxyz: FloatArray) -> FloatArray:
        """Return the gripper's origin (n, 3) in the tissue frame for poses of the tool in the base frame."""
        in_base = position + rotation(quaternion_wxyz).apply(self._T_tool_gripper.position)
        positions: FloatArray = in_base @ self._R_tissue_base.T + self._p_tissue_base
        return positions
