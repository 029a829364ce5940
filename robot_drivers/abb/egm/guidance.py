"""EGM Position Guidance as a second way to move: this computer generates every reference, 250 times a second.

The controller has no interpolator then, so this one keeps the straight line, the speed, the acceleration
and the limits. The controller's part is ``rapid/RetractGuidance.mod``. Straight motions by the RAPID server
(:mod:`robot_drivers.abb.irb140`) are the better choice for retractions in steps.
"""

import contextlib
import threading
from collections import deque
from collections.abc import Sequence

from robot_drivers.abb.egm.codec import EgmRobot, MotorState
from robot_drivers.abb.egm.guidance_session import EGMGuidanceSettings, GuidanceSession
from robot_drivers.abb.egm.position_stream import EGMSample, PositionStream, pose_block
from robot_drivers.abb.motion.limits import check_trajectory
from robot_drivers.errors import (
    DeviceFaultError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.motion import poses
from robot_drivers.motion.one_motion import one_motion
from robot_drivers.protocols import DeviceIdentity, Pose, PoseBlock, RobotState, Speed, StreamStatistics
from robot_drivers.real_time import prefer_this_thread

_LONGEST_QUEUE = 100_000
_STANDSTILL_TIMEOUT_S = 5.0


class EGMGuidedRobot:
    """The robot as a :class:`robot_drivers.protocols.Robot`, guided by EGM.

    A thread answers the controller; what it shares is guarded by one condition, notified with each datagram. It runs
    before other programs where the system grants that; a process that guides also does well to call
    :func:`robot_drivers.real_time.shorten_collections` once it is set up.
    """

    def __init__(self, settings: EGMGuidanceSettings) -> None:
        self._settings = settings
        self._changed = threading.Condition()
        self._session = GuidanceSession(settings)
        self._stream: PositionStream | None = None
        self._thread: threading.Thread | None = None
        self._closing = False
        self._held = False
        self._one_motion = threading.Lock()
        self._samples: deque[EGMSample] = deque(maxlen=_LONGEST_QUEUE)

    @property
    def identity(self) -> DeviceIdentity:
        """Who is guided; the protocol tells no serial number."""
        stream = self._opened()
        return DeviceIdentity(
            kind="robot",
            model="ABB IRB 140",
            serial="",
            address=f"UDP port {stream.port}",
            details={"pose_source": f"EGM position guidance, layout {stream.generation}"},
        )

    def connect(self) -> None:
        """Wait for the controller's first datagram and answer from then on. Moves nothing.

        Raises
        ------
        DeviceUnreachableError
            When no datagram comes: EGM is not started, or it sends elsewhere.
        DeviceFaultError
            When the controller is one (RobotWare 6.00 – 6.06) whose angles cannot be trusted.
        ConfigurationError
            When the port cannot be had.
        """
        self.close()
        stream = PositionStream(self._settings.egm)
        stream.open()
        with contextlib.ExitStack() as opened:
            opened.callback(stream.close)
            if not stream.receive(self._settings.connect_timeout_s):
                raise DeviceUnreachableError(
                    f"no EGM datagram at UDP port {stream.port} in {self._settings.connect_timeout_s:g} s, where "
                    f"{self._settings.egm.controller_address or 'this computer'} alone is heard; start EGM on the "
                    "controller, check the remote address of its UDPUC device, and controller_address of the rig file"
                )
            if stream.generation == "A":
                raise DeviceFaultError(
                    "the controller sends EGM without time stamps (RobotWare 6.00 - 6.06), so the unit of its "
                    "angles is uncertain and it is not guided; use the RAPID server"
                )
            opened.pop_all()
        self._stream, self._closing = stream, False
        self._session = GuidanceSession(self._settings)
        self._thread = threading.Thread(target=self._serve, args=(stream,), name="abb-guidance", daemon=True)
        self._thread.start()

    def state(self) -> RobotState:
        """Return the state of the newest datagram."""
        with self._changed:
            sample, message = self._newest()
            reference = self._session.reference
            return RobotState(
                T_base_tool=sample.pose,
                joints=sample.joints,
                moving=sample.moving or (reference is not None and not reference.resting),
                motors_on=message.motor_state is not None and message.motor_state.state == MotorState.ON,
                ready=reference is not None and reference.resting and not self._held,
                stopped=self._held,
                message="" if reference is not None else "guidance does not run on the controller",
            )

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        """Check straight lines from where the tool is through all ``targets``; raises MotionRefusedError."""
        with self._changed:
            self._check(targets, speed)

    def move_linear(self, T_base_tool: Pose, speed: Speed, timeout_s: float) -> Pose:
        """Move the tool along a straight line, wait until it stands there, return the pose reached.

        Whatever ends the wait early, a timeout or an interrupt, makes the reference brake.

        Raises
        ------
        MotionRefusedError
            When a limit, a hold or another motion forbids it; nothing has moved.
        DeviceFaultError
            When it began and was stopped: by :meth:`hold`, the controller, silence, or too large a lag.
        DeviceTimeoutError
            When it was not there in time; it was stopped.
        """
        with one_motion(self._one_motion), self._changed:
            self._check([T_base_tool], speed)
            if self._held:
                raise MotionRefusedError("the robot is held; call resume() before it may move")
            self._session.begin(poses.normalised(T_base_tool), speed)
            return self._wait_for_arrival(timeout_s)

    def hold(self) -> None:
        """Brake on the line and wait until the reference rests, from any thread; moves need :meth:`resume` first.

        Raises
        ------
        DeviceTimeoutError
            When it does not come to rest; guidance is closed then, which makes the controller stop.
        """
        with self._changed:
            self._held = True
            self._opened()
            self._session.brake("hold() was called")
            rests = self._changed.wait_for(self._rests, _STANDSTILL_TIMEOUT_S)
        if not rests:
            self.close()
            raise DeviceTimeoutError("the reference did not come to rest; guidance was closed")

    def resume(self) -> None:
        """Allow motion again; moves nothing by itself."""
        with self._changed:
            self._opened()
            self._held = False

    def read(self, timeout_s: float) -> PoseBlock:
        """Return the samples that arrived since the last call; wait up to ``timeout_s`` for a first one."""
        with self._changed:
            self._opened()
            self._changed.wait_for(lambda: self._samples, timeout_s)
            samples = list(self._samples)
            self._samples.clear()
        return pose_block(samples)

    def statistics(self) -> StreamStatistics:
        """Return the counts of received datagrams."""
        return self._opened().statistics()

    def close(self) -> None:
        """Stop answering: the controller ends its session for want of data (event 41822) and stands."""
        self._closing = True
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._stream is not None:
            self._stream.close()
            self._stream = None
        with self._changed:
            self._session.lapse("guidance was closed")
            self._changed.notify_all()

    def _serve(self, stream: PositionStream) -> None:
        prefer_this_thread()
        while not self._closing:
            samples = stream.receive(self._settings.silence_limit_s)
            with self._changed:
                self._samples.extend(samples)
                if samples:
                    self._answer(stream)
                else:
                    self._session.lapse(f"no datagram came for {self._settings.silence_limit_s:g} s")
                self._changed.notify_all()

    def _answer(self, stream: PositionStream) -> None:
        sample, message = self._newest()
        answer = self._session.answer(sample, message, stream.statistics().restarts)
        if answer is None:
            return
        try:
            stream.reply(answer)
        except OSError as error:
            self._session.lapse(f"the network does not take the answer ({error})")

    def _wait_for_arrival(self, timeout_s: float) -> Pose:
        session = self._session
        try:
            if not self._changed.wait_for(lambda: session.target is None, timeout_s):
                raise DeviceTimeoutError(f"motion not finished in {timeout_s:g} s; it was stopped")
        except BaseException:  # Ctrl-C as well: whoever stops waiting must not leave the arm moving
            self._held = True
            session.brake("nobody waited for it any longer")
            raise
        if session.interruption is not None:
            raise session.interruption
        return self._newest()[0].pose

    def _check(self, targets: Sequence[Pose], speed: Speed) -> None:
        sample, _ = self._newest()
        settings = self._settings
        check_trajectory(settings.limits, sample.pose, sample.joints, targets, speed, settings.T_flange_tool)

    def _rests(self) -> bool:
        reference = self._session.reference
        return reference is None or reference.resting

    def _newest(self) -> tuple[EGMSample, EgmRobot]:
        stream = self._opened()
        if stream.newest_sample is None or stream.newest_message is None:
            raise DeviceUnreachableError("no EGM datagram has come yet; start EGM on the controller")
        return stream.newest_sample, stream.newest_message

    def _opened(self) -> PositionStream:
        if self._stream is None:
            raise DeviceUnreachableError("not connected to the robot's EGM; call connect() first")
        return self._stream
