"""The ABB IRB 140 behind an open-abb server, which many laboratories have installed, as a Robot.

The protocol has neither a stop nor a stream of states, and while a motion runs the server answers nothing. So a
straight line is sent in pieces that last no longer than ``stop_within_s``, each to a stop point: :meth:`OpenABB.hold`
takes effect after the present piece, and the pose is read between the pieces. Poses come in steps of 0.01 mm and 0.1°.
Where the rig's own RAPID modules can be loaded, :mod:`robot_drivers.abb.irb140` is the better choice.
"""

import contextlib
import math
import threading
import time
from collections.abc import Sequence

from robot_drivers.abb.motion.limits import check_trajectory
from robot_drivers.abb.motion.tool_data import check_tool_data
from robot_drivers.abb.open_abb.connection import OpenABBConnection
from robot_drivers.abb.open_abb.messages import (
    Code,
    fine_zone_parameters,
    parse_joints,
    parse_pose,
    pose_parameters,
    speed_parameters,
)
from robot_drivers.abb.open_abb.samples import Sample, SampleQueue
from robot_drivers.abb.open_abb.settings import OpenABBSettings
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import (
    DeviceFaultError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.motion import poses
from robot_drivers.motion.arrival import MotionInterruptedError, check_arrival
from robot_drivers.motion.checks import check_on_line
from robot_drivers.motion.one_motion import one_motion
from robot_drivers.protocols import DeviceIdentity, Pose, PoseBlock, RobotState, Speed, StreamStatistics

__all__ = ["OpenABB", "OpenABBSettings"]

_SLOWEST_PIECE = 3.0  # times its nominal duration: it accelerates and brakes


class OpenABB:
    """One robot. :meth:`hold` works from any thread, also while another waits in :meth:`move_linear`."""

    def __init__(self, settings: OpenABBSettings) -> None:
        self._settings = settings
        self._connection: OpenABBConnection | None = None
        self._one_motion = threading.Lock()
        # Pose and joints of a state are asked for one after the other.
        self._one_state_or_piece = threading.Lock()
        self._held = False
        self._moving = False
        self._samples = SampleQueue()

    @property
    def identity(self) -> DeviceIdentity:
        """Controller and arm, and what this protocol cannot do."""
        settings = self._settings
        serial, robotware, robot_type = [*self._connected().info.split("*"), "", ""][:3]
        return DeviceIdentity(
            kind="robot",
            model="ABB IRB 140",
            serial=serial,
            address=f"{settings.host}:{settings.port}",
            details={
                "robotware": robotware,
                "robot_type": robot_type,
                "pose_source": "polled while the tool stands (open-abb has no state stream)",
                "stop": f"within {settings.stop_within_s:g} s, between pieces of a line (open-abb has no stop)",
            },
        )

    def connect(self) -> None:
        """Connect, hand over tool, work object and stop points, and check the tool. Moves nothing.

        Raises
        ------
        DeviceUnreachableError, DeviceTimeoutError
            When there is no server, or it is still busy.
        ConfigurationError
            When the pose reported does not follow from the joints and ``T_flange_tool``.
        """
        self.close()
        settings = self._settings
        with contextlib.ExitStack() as opened:
            connection = OpenABBConnection(
                settings.host, settings.port, settings.connect_timeout_s, settings.reply_gap_s
            )
            opened.callback(connection.close)
            connection.ask(Code.TOOL, self._parameters(settings.T_flange_tool))
            connection.ask(Code.WORK_OBJECT, self._parameters(poses.IDENTITY))
            connection.ask(Code.ZONE, fine_zone_parameters())
            here = self._ask_state(connection, moving=False)
            check_tool_data(settings.T_flange_tool, here.joints, here.T_base_tool)
            opened.pop_all()
        self._samples = SampleQueue()
        self._samples.put(here)
        self._connection = connection

    def state(self) -> RobotState:
        """Return the present state; while a motion runs, the one before its present piece.

        A server that answers is the program of the motion task, which only runs with the motors on.
        """
        busy = self._one_motion.locked()
        newest = self._samples.newest if busy else self._poll(moving=False)
        if newest is None:
            raise DeviceUnreachableError(f"the open-abb server {self._settings.host} has told no pose yet")
        return RobotState(
            T_base_tool=newest.T_base_tool,
            joints=newest.joints,
            moving=self._moving,
            motors_on=True,
            ready=not (busy or self._held),
            stopped=self._held,
            message="holding; call resume()" if self._held else "",
        )

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        """Check straight lines from where the tool is through all ``targets`` (``T_base_tool``).

        Raises
        ------
        MotionRefusedError
            Naming the first step that would break a limit; nothing has moved.
        """
        here = self._poll(moving=False)
        self._check_from(here, targets, speed)

    def move_linear(self, T_base_tool: Pose, speed: Speed, timeout_s: float) -> Pose:
        """Move the tool along a straight line in pieces, wait until it stands there, return the pose reached.

        Whatever ends the wait early keeps further pieces from being sent, and holds the robot.

        Raises
        ------
        MotionRefusedError
            When a limit, a hold or another motion forbids it; nothing has moved.
        MotionInterruptedError
            When :meth:`hold` came between two pieces.
        DeviceTimeoutError
            When it was not there in time. Where the message says so, a piece may still be running.
        DeviceFaultError
            When the server refused it, it left its straight line, or it stands elsewhere than asked for.
        """
        with one_motion(self._one_motion):
            self._refuse_if_held()
            start = self._poll(moving=False)
            self._check_from(start, [T_base_tool], speed)
            return self._carry_out(start.T_base_tool, poses.normalised(T_base_tool), speed, timeout_s)

    def hold(self) -> None:
        """Send no further piece and wait for the end of the present one; moves need :meth:`resume` first.

        Raises
        ------
        DeviceTimeoutError
            When the present piece does not end. The protocol has no way to stop it: use the wired stop.
        """
        self._held = True
        self._connected()
        patience_s = _SLOWEST_PIECE * self._settings.stop_within_s + self._settings.reply_timeout_s
        if not self._one_motion.acquire(timeout=patience_s):
            raise DeviceTimeoutError(
                f"the robot has not come to stand in {patience_s:.1f} s and open-abb cannot stop it: press the stop"
            )
        self._one_motion.release()

    def resume(self) -> None:
        """Allow motion again after :meth:`hold`; moves nothing by itself.

        Raises
        ------
        DeviceFaultError
            When a motion has not come to its end yet.
        """
        self._connected()
        if self._one_motion.locked():
            raise DeviceFaultError("a motion has not come to its end yet; hold, then resume")
        self._held = False

    def read(self, timeout_s: float) -> PoseBlock:
        """Return the poses read since the last call; wait up to ``timeout_s`` for a first one.

        While the tool stands, this asks for one itself.
        """
        self._connected()
        deadline = time.monotonic() + timeout_s
        came = self._samples.wait(min(timeout_s, self._settings.poll_period_s))
        if not came and self._one_motion.locked():
            came = self._samples.wait(deadline - time.monotonic())
        if not came and time.monotonic() < deadline:
            self._poll(moving=False)
        return self._samples.take()

    def statistics(self) -> StreamStatistics:
        """Return the count of poses read."""
        self._connected()
        return StreamStatistics(received=self._samples.received)

    def close(self) -> None:
        """Disconnect. A piece of a motion that is under way goes on to its end."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()

    def _connected(self) -> OpenABBConnection:
        if self._connection is None:
            raise DeviceUnreachableError(
                f"not connected to the robot at {self._settings.host}; call connect() first"
            )
        return self._connection

    def _parameters(self, pose: Pose) -> tuple[str, ...]:
        return pose_parameters(pose, self._settings.position_decimals)

    def _refuse_if_held(self) -> None:
        if self._held:
            raise MotionRefusedError("the robot is held; call resume() before it may move")

    def _check_from(self, here: Sample, targets: Sequence[Pose], speed: Speed) -> None:
        settings = self._settings
        check_trajectory(
            settings.limits, here.T_base_tool, here.joints, targets, speed, settings.T_flange_tool
        )

    def _carry_out(self, start: Pose, target: Pose, speed: Speed, timeout_s: float) -> Pose:
        settings, connection = self._settings, self._connected()
        connection.ask(Code.SPEED, speed_parameters(speed, settings.position_decimals))
        length, angle = poses.distance(start, target)
        duration_s = max(length / speed.linear, angle / speed.angular)
        pieces = max(1, math.ceil(duration_s / settings.stop_within_s))
        deadline, reached = time.monotonic() + timeout_s, start
        try:
            self._moving = True
            for number in range(1, pieces + 1):
                if self._held:
                    raise MotionInterruptedError("hold() was called", reached)
                if time.monotonic() > deadline:
                    raise DeviceTimeoutError(f"motion not finished in {timeout_s:g} s; it was stopped")
                waypoint = poses.interpolate(start, target, number / pieces)
                self._move_piece(connection, waypoint, duration_s / pieces)
                reached = self._poll(moving=number < pieces).T_base_tool
                check_on_line(settings.limits, start, target, reached)
        except BaseException:  # Ctrl-C as well: after it nobody knows where the tool stands
            self._held = True
            raise
        finally:
            self._moving = False
        check_arrival(target, reached, settings.position_tolerance, settings.angle_tolerance)
        return reached

    def _move_piece(self, connection: OpenABBConnection, waypoint: Pose, duration_s: float) -> None:
        patience_s = _SLOWEST_PIECE * duration_s + self._settings.reply_timeout_s
        try:
            with self._one_state_or_piece:
                connection.ask(Code.MOVE_LINEAR, self._parameters(waypoint), patience_s)
        except DeviceTimeoutError as error:
            raise DeviceTimeoutError(
                f"the motion was not acknowledged in {patience_s:.1f} s: its present piece may still be running, and "
                "open-abb cannot stop it. Look at the robot, then connect again"
            ) from error

    def _poll(self, moving: bool) -> Sample:
        sample = self._ask_state(self._connected(), moving)
        self._samples.put(sample)
        return sample

    def _ask_state(self, connection: OpenABBConnection, moving: bool) -> Sample:
        patience_s = self._settings.reply_timeout_s
        with self._one_state_or_piece:
            asked_ns = host_time_ns()
            pose = parse_pose(connection.ask(Code.POSE, timeout_s=patience_s))
            joints = parse_joints(connection.ask(Code.JOINTS, timeout_s=patience_s))
        return Sample(asked_ns, pose, joints, moving)
