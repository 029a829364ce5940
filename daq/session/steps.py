"""The steps of a session while it records: rest, move, settle, measure, with an ear to guard and recorder."""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from daq.errors import SessionError, SoftwareStopError
from daq.frames import distance
from daq.progress import Progress
from daq.recording.events import MEASURE_BEGIN, MEASURE_END, MOVE_BEGIN, MOVE_END
from daq.recording.recorder import Recorder
from daq.session.guard import Guard
from daq.trajectories import Step, Trajectory
from robot_drivers.clock import host_time_ns, seconds_until
from robot_drivers.errors import DeviceError, MotionRefusedError
from robot_drivers.protocols import Pose, Robot, Speed

_POLL_S = 0.02
_MOVE_PATIENCE_S = 5.0
_STANDING_M = 1e-6
_STANDING_RAD = 1e-6


@dataclass(frozen=True, slots=True)
class StepRunner:
    """Carries out a trajectory whose targets have been checked."""

    robot: Robot
    guard: Guard
    recorder: Recorder
    progress: Progress

    def run(self, trajectory: Trajectory, targets: Sequence[Pose]) -> None:
        """Rest, then every step.

        Raises
        ------
        SoftwareStopError
            The guard has held the robot.
        SessionError
            The controller has stopped the robot where it stood, or the robot refuses a step although it was checked.
        DeviceError, RecordingError
            A device or the disk has failed.
        """
        total = len(targets)
        rest, *steps = zip(trajectory.steps, targets, strict=True)
        self.progress("zeroing at rest", 0, total)
        present = rest[1]
        self._wait(rest[0].settle_s)
        self.guard.watch_rest()
        self._measure(0, rest[0])
        self.guard.arm()
        for row, (step, target) in enumerate(steps, start=1):
            self.progress(_describe(step), row, total)
            self._move(step, present, target, trajectory.speed)
            self._wait(step.settle_s)
            if step.measure_s > 0:
                self._measure(row, step)
            present = target

    def _move(self, step: Step, present: Pose, target: Pose, speed: Speed) -> None:
        length, angle = distance(present, target)
        if length < _STANDING_M and angle < _STANDING_RAD:
            return
        self.recorder.event(MOVE_BEGIN, number=step.number, T_base_tool=asdict(target))
        self.guard.begin_step(present)
        timeout_s = max(length / speed.linear, angle / speed.angular) + _MOVE_PATIENCE_S
        try:
            reached = self.robot.move_linear(target, speed, timeout_s)
        except MotionRefusedError as refusal:
            self._check_guard(refusal)
            # a refusal tells that nothing has moved, which is not so of a session under way
            raise SessionError(f"step {step.number} was refused under way ({refusal})") from refusal
        except DeviceError as error:
            self._check_guard(error)
            raise
        self.recorder.event(MOVE_END, number=step.number, T_base_tool=asdict(reached))

    def _measure(self, row: int, step: Step) -> None:
        self.recorder.event(MEASURE_BEGIN, row=row, number=step.number, phase=step.phase)
        self._wait(step.measure_s)
        self.recorder.event(MEASURE_END, row=row)
        self._require_ready()

    def _wait(self, duration_s: float) -> None:
        until_ns = host_time_ns() + round(duration_s * 1e9)
        while (pause_s := seconds_until(until_ns)) > 0.0:
            time.sleep(min(_POLL_S, pause_s))
            self._check_guard()
            self.recorder.check()

    def _require_ready(self) -> None:
        """Ask the robot whether it could move: a stop at its controller while it stands shows nowhere else."""
        state = self.robot.state()
        if not state.ready:
            self._check_guard()
            raise SessionError(f"the robot was stopped at its controller while it stood ({state.message})")

    def _check_guard(self, cause: DeviceError | None = None) -> None:
        stop = self.guard.stop
        if stop is not None:
            self.recorder.check_disk()  # where that is what stopped the robot, it is told as what it is
            raise SoftwareStopError(stop.describe()) from cause


def _describe(step: Step) -> str:
    x, y, z = step.T_rest_gripper.position
    way = "returning to" if step.phase == "return_hold" else "pulling to"
    return f"step {step.number}: {way} ({x * 1e3:.1f}, {y * 1e3:.1f}, {z * 1e3:.1f}) mm"
