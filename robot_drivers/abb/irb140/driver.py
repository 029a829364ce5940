"""The ABB IRB 140 as a :class:`robot_drivers.protocols.Robot`.

Motion goes through the RAPID server of ``rapid/`` (straight lines to stop points), measurement through EGM's
position stream or, where the controller has no EGM, the server's state stream. Every motion is checked
against the limits before it is sent and watched while it runs; nothing moves on connect, and a motion whose
connection was lost is never repeated.
"""

import contextlib
import threading
from collections.abc import Sequence

from robot_drivers.abb.irb140.session import IRB140Settings, Session, done, open_session
from robot_drivers.abb.motion.limits import check_trajectory
from robot_drivers.abb.rapid_socket.codes import Command, ReplyKind, Status
from robot_drivers.abb.rapid_socket.frames import Reply, TextReply, move_numbers
from robot_drivers.clock import host_time_s
from robot_drivers.errors import (
    DeviceError,
    DeviceProtocolError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.motion import poses
from robot_drivers.motion.arrival import MotionInterruptedError, check_arrival
from robot_drivers.motion.checks import check_on_line
from robot_drivers.motion.one_motion import one_motion
from robot_drivers.protocols import DeviceIdentity, Pose, PoseBlock, RobotState, Speed, StreamStatistics

__all__ = ["IRB140", "IRB140Settings", "MotionInterruptedError"]

_STANDSTILL_TIMEOUT_S = 2.0
_WATCH_PERIOD_S = 0.05
_TROUBLES = {
    Status.WATCHDOG_TRIPPED: "the watchdog missed the heartbeat",
    Status.MOTION_ERROR: "a motion failed",
    Status.HOLDING: "holding; call resume()",
}
_NEEDS = {Status.MOTORS_ON: "motors are off", Status.PROGRAM_RUNNING: "the motion program is stopped"}


class IRB140:
    """One robot. :meth:`hold` works from any thread, also while another waits in :meth:`move_linear`."""

    def __init__(self, settings: IRB140Settings) -> None:
        self._settings = settings
        self._session: Session | None = None
        self._one_motion = threading.Lock()
        self._held = False

    @property
    def identity(self) -> DeviceIdentity:
        """Controller and arm; ``details["pose_source"]`` tells which stream :meth:`read` delivers."""
        return self._connected().identity

    def connect(self) -> None:
        """Connect, hand the limits to the controller, choose the pose source. Moves nothing.

        After a lost connection it connects anew; what was under way is not continued.

        Raises
        ------
        DeviceUnreachableError, DeviceTimeoutError
            When the controller or its RAPID server is not there.
        DeviceProtocolError
            When the RAPID modules on the controller are of another version.
        ConfigurationError
            When the tool data or the base frame of the controller are not those of the settings, when the EGM
            port is taken, or when EGM and the RAPID server do not report the same pose.
        """
        self.close()
        self._session = open_session(self._settings, motion_forbidden=self._held)

    def state(self) -> RobotState:
        """Ask for the present state."""
        reply = self._ask_state()
        status = reply.status
        return RobotState(
            T_base_tool=reply.T_base_tool,
            joints=reply.joints,
            moving=Status.MOVING in status,
            motors_on=Status.MOTORS_ON in status,
            ready=not status & (Status.MOVING | Status.HOLDING) and all(need in status for need in _NEEDS),
            stopped=Status.HOLDING in status,
            message="; ".join(
                [text for bit, text in _NEEDS.items() if bit not in status]
                + [text for bit, text in _TROUBLES.items() if bit in status]
            ),
        )

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        """Check straight lines from where the tool is through all ``targets`` (``T_base_tool``).

        Raises
        ------
        MotionRefusedError
            Naming the first step that would break a limit; nothing has moved.
        """
        self._check_from(self._ask_state(), targets, speed)

    def move_linear(self, T_base_tool: Pose, speed: Speed, timeout_s: float) -> Pose:
        """Move the tool along a straight line, wait until it stands there, return the pose reached.

        Whatever ends the wait early, a timeout or an interrupt, orders a stop.

        Raises
        ------
        MotionRefusedError
            When a limit, a hold or another motion forbids it; nothing has moved.
        MotionInterruptedError
            When it began and was stopped: by :meth:`hold`, the watchdog, or the controller.
        DeviceTimeoutError
            When it was not there in time; it was stopped.
        DeviceFaultError
            When it left its straight line (it was stopped) or stands elsewhere than asked for.
        """
        with one_motion(self._one_motion):
            start = self._ask_state()
            self._check_from(start, [T_base_tool], speed)
            target = poses.normalised(T_base_tool)
            reply = self._carry_out(start.T_base_tool, target, speed, timeout_s)
            return self._verified(reply, target)

    def hold(self) -> None:
        """Stop at once and wait for standstill, from any thread; moves need :meth:`resume` first.

        Raises
        ------
        DeviceError
            When the stop was not confirmed. The connection is closed then, which makes the controller stop.
        """
        self._held = True
        command = self._connected().command
        try:
            done(command.send_stop().outcome(_STANDSTILL_TIMEOUT_S), "STOP")
        except DeviceError:
            command.close()
            raise

    def resume(self) -> None:
        """Allow motion again after :meth:`hold` or a watchdog stop; moves nothing by itself.

        Raises
        ------
        DeviceFaultError
            When the controller cannot take up motion.
        """
        command = self._connected().command
        done(command.request(Command.RESUME), "RESUME")
        command.allow_motion()
        self._held = False

    def read(self, timeout_s: float) -> PoseBlock:
        """Return the samples that arrived since the last call; wait up to ``timeout_s`` for a first one."""
        return self._connected().source.read(timeout_s)

    def statistics(self) -> StreamStatistics:
        """Return the counts of the pose source."""
        return self._connected().source.statistics()

    def close(self) -> None:
        """Disconnect. A motion that is under way is stopped by the controller."""
        session, self._session = self._session, None
        if session is not None:
            session.command.close()
            session.source.close()

    def _connected(self) -> Session:
        if self._session is None:
            raise DeviceUnreachableError(
                f"not connected to the robot at {self._settings.host}; call connect() first"
            )
        return self._session

    def _ask_state(self) -> Reply:
        return done(self._connected().command.request(Command.GET_STATE), "GET_STATE")

    def _check_from(self, start: Reply, targets: Sequence[Pose], speed: Speed) -> None:
        settings = self._settings
        check_trajectory(
            settings.limits, start.T_base_tool, start.joints, targets, speed, settings.T_flange_tool
        )

    def _carry_out(self, start: Pose, target: Pose, speed: Speed, timeout_s: float) -> Reply | TextReply:
        """Send the motion and watch it until its final reply."""
        command = self._connected().command
        deadline = host_time_s() + timeout_s
        try:
            exchange = command.send_move(move_numbers(target, speed.linear, speed.angular))
            while (reply := exchange.poll(_WATCH_PERIOD_S)) is None:
                if host_time_s() > deadline:
                    raise DeviceTimeoutError(f"motion not finished in {timeout_s:g} s; it was stopped")
                newest = command.newest_reply
                if newest is not None:
                    check_on_line(self._settings.limits, start, target, newest.T_base_tool)
        except MotionRefusedError:
            raise
        except BaseException:
            # Whoever stops waiting for a motion, Ctrl-C included, must not leave it running. A controller
            # that cannot be told any more stops by its own watchdog.
            with contextlib.suppress(DeviceError):
                self.hold()
            raise
        return reply

    def _verified(self, reply: Reply | TextReply, target: Pose) -> Pose:
        if isinstance(reply, TextReply):
            raise DeviceProtocolError("text in answer to MOVE_L")
        if reply.kind is ReplyKind.REJECTED:
            raise MotionRefusedError(f"the controller refused the motion, nothing has moved: {reply.cause}")
        if reply.kind is ReplyKind.ABORTED:
            raise MotionInterruptedError(
                f"the motion was stopped on its way: {reply.cause}", reply.T_base_tool
            )
        check_arrival(
            target, reply.T_base_tool, self._settings.position_tolerance, self._settings.angle_tolerance
        )
        return reply.T_base_tool
