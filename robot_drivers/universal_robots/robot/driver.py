"""An e-Series arm as a :class:`robot_drivers.protocols.Robot`: poses over RTDE, motion by a reference in its registers.

The controller runs ``script/retract_servo.script``, which follows the reference with ``servoj`` and brakes by itself
when this computer falls silent. Nothing moves on connect, and a motion whose connection was lost is never repeated.
"""

import contextlib
import threading
from collections.abc import Callable, Sequence

import numpy as np

from robot_drivers.clock import host_time_s
from robot_drivers.errors import (
    ConfigurationError,
    DeviceError,
    DeviceTimeoutError,
    DeviceUnreachableError,
    MotionRefusedError,
)
from robot_drivers.motion import poses
from robot_drivers.motion.one_motion import one_motion
from robot_drivers.protocols import DeviceIdentity, Pose, PoseBlock, RobotState, Speed, StreamStatistics
from robot_drivers.universal_robots.arms import LENGTHS
from robot_drivers.universal_robots.robot.limits import check_path
from robot_drivers.universal_robots.robot.registers import INPUTS, OUTPUTS, Doing, Told, vector_of
from robot_drivers.universal_robots.robot.servo import Servo
from robot_drivers.universal_robots.robot.settings import URSettings
from robot_drivers.universal_robots.rtde.connection import RTDEConnection
from robot_drivers.universal_robots.rtde.packages import Recipe
from robot_drivers.universal_robots.rtde.stream import RTDEStream, Sample

_STANDSTILL_TIMEOUT_S = 5.0
_LOOK_S = 0.05
_SAME_POSITION, _SAME_ANGLE = 1e-4, 1e-3
_MOST_BEATS = 2**31


class URRobot:
    """One arm. :meth:`hold` works from any thread, also while another waits in :meth:`move_linear`."""

    def __init__(self, settings: URSettings) -> None:
        self._settings = settings
        self._changed = threading.Condition()
        self._servo = Servo(settings)
        self._connection: RTDEConnection | None = None
        self._stream: RTDEStream | None = None
        self._inputs: Recipe | None = None
        self._told: Told | None = None
        self._beat = 0
        self._held = False
        self._one_motion = threading.Lock()

    @property
    def identity(self) -> DeviceIdentity:
        """Who is moved; RTDE tells the controller's software, not the arm."""
        self._opened()
        assert self._connection is not None
        settings = self._settings
        details = {"software": self._connection.version, "rate": f"{settings.rate_hz:g} Hz"}
        address = f"{settings.host}:{settings.port}"
        return DeviceIdentity("robot", f"Universal Robots {settings.arm}", settings.serial, address, details)

    def connect(self) -> None:
        """Connect, and send with every sample that the arm is to stand. Moves nothing.

        Raises
        ------
        DeviceUnreachableError, DeviceTimeoutError
            The controller is not there, or falls silent.
        DeviceProtocolError
            It does not know a variable, or another client writes the registers.
        ConfigurationError
            Its tool centre point is not that of the settings.
        """
        self.close()
        settings = self._settings
        with contextlib.ExitStack() as opened:
            connection = RTDEConnection(settings.host, settings.port, settings.connect_timeout_s)
            opened.callback(connection.close)
            recipe = connection.outputs(OUTPUTS, settings.rate_hz)
            self._inputs = connection.inputs(INPUTS)
            self._servo, self._connection, self._told = Servo(settings), connection, None
            connection.start()
            stream = RTDEStream(
                connection, recipe, settings.rate_hz, settings.silence_limit_s, on_sample=self._answer
            )
            opened.callback(stream.close)
            stream.wait_for_first(settings.connect_timeout_s)
            if wrong := self._wrong_tool(self._newest()):
                raise ConfigurationError(wrong)
            opened.pop_all()
        self._stream = stream

    def state(self) -> RobotState:
        """Return the state of the newest sample."""
        self._opened().check()
        with self._changed:
            told = self._newest()
            moving = told.moving or not self._servo.resting
            trouble = told.trouble or self._wrong_tool(told)
            return RobotState(
                T_base_tool=told.T_base_tool,
                joints=told.joints,
                moving=moving,
                motors_on=told.powered,
                ready=not (trouble or moving or self._held),
                stopped=self._held or not told.safe,
                message=trouble or ("holding; call resume()" if self._held else ""),
            )

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        """Check straight lines from where the tool is through all ``targets``; raises MotionRefusedError."""
        self._opened().check()
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
            When it began and was stopped: by :meth:`hold`, the controller, or a limit.
        DeviceTimeoutError, DeviceUnreachableError
            When it was not there in time, or the connection was lost; it was stopped.
        """
        with one_motion(self._one_motion):
            self._opened().check()
            with self._changed:
                if self._held:
                    raise MotionRefusedError("the robot is held; call resume() before it may move")
                told = self._newest()
                if trouble := told.trouble or self._wrong_tool(told):
                    raise MotionRefusedError(f"nothing has moved: {trouble}")
                self._check([T_base_tool], speed)
                self._servo.begin(told.T_base_tool, poses.normalised(T_base_tool), speed)
                return self._wait_for_arrival(timeout_s)

    def hold(self) -> None:
        """Brake on the line and wait until the arm stands, from any thread; moves need :meth:`resume` first.

        Raises
        ------
        DeviceError
            When it is not seen to stand; the connection is closed then, which makes the program brake.
        """
        self._held = True
        self._opened()
        try:
            with self._changed:
                self._servo.brake("hold() was called", self._newest().T_base_tool)
                if not self._wait(self._stands, _STANDSTILL_TIMEOUT_S):
                    raise DeviceTimeoutError("the arm was not seen to stand; the connection was closed")
        except DeviceError:
            self.close()
            raise

    def resume(self) -> None:
        """Allow motion again after :meth:`hold`; moves nothing by itself."""
        self._opened().check()
        self._held = False

    def read(self, timeout_s: float) -> PoseBlock:
        """Return the samples that arrived since the last call; wait up to ``timeout_s`` for a first one."""
        return _block(self._opened().take(timeout_s))

    def statistics(self) -> StreamStatistics:
        """Return the counts of received samples."""
        return self._opened().statistics()

    def close(self) -> None:
        """Disconnect. A motion that is under way is ended: the program brakes when no beat comes any more."""
        stream, self._stream = self._stream, None
        connection, self._connection = self._connection, None
        if stream is not None:
            stream.close()
        if connection is not None:
            connection.close()
        with self._changed:
            if self._told is not None:
                self._servo.brake("the connection was closed", self._told.T_base_tool)
            self._changed.notify_all()

    def _answer(self, sample: Sample) -> None:
        """Send the reference that belongs to a sample; in the thread of the stream."""
        connection, inputs = self._connection, self._inputs
        if connection is None or inputs is None:
            return
        with self._changed:
            self._told = told = Told.by(sample.values)
            order, reference = self._servo.next(sample.device_time_s, told)
            self._beat = (self._beat + 1) % _MOST_BEATS
            connection.send(inputs, (int(order), self._beat, *vector_of(reference)))
            self._changed.notify_all()

    def _wait_for_arrival(self, timeout_s: float) -> Pose:
        servo = self._servo
        try:
            if not self._wait(lambda: servo.target is None, timeout_s):
                raise DeviceTimeoutError(f"motion not finished in {timeout_s:g} s; it was stopped")
        except BaseException:  # Ctrl-C as well: whoever stops waiting must not leave the arm moving
            self._held = True
            servo.brake("nobody waited for it any longer", self._newest().T_base_tool)
            raise
        if servo.interruption is not None:
            raise servo.interruption
        self._wait(self._stands, _STANDSTILL_TIMEOUT_S)
        return self._newest().T_base_tool

    def _wait(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Wait for something that a sample brings; raises what has ended the stream."""
        deadline = host_time_s() + timeout_s
        while not condition():
            if self._stream is not None:
                self._stream.check()
            if host_time_s() > deadline:
                return False
            self._changed.wait(_LOOK_S)
        return True

    def _stands(self) -> bool:
        told = self._newest()
        return self._servo.resting and not told.moving and told.doing != Doing.FOLLOWING

    def _check(self, targets: Sequence[Pose], speed: Speed) -> None:
        told, settings = self._newest(), self._settings
        check_path(settings.limits, LENGTHS[settings.arm], (told.T_base_tool, told.joints), targets, speed)

    def _wrong_tool(self, told: Told) -> str:
        """Return how the tool of the installation differs from that of the settings; empty where it does not."""
        if told.trouble:
            return ""  # the program, which tells it, does not run
        position, angle = poses.distance(told.T_flange_tool, self._settings.T_flange_tool)
        if position <= _SAME_POSITION and angle <= _SAME_ANGLE:
            return ""
        return (
            f"the tool centre point of the controller is {position * 1e3:.2f} mm and {angle * 1e3:.2f} mrad off "
            "T_flange_tool of the rig file; make them agree"
        )

    def _newest(self) -> Told:
        if self._told is None:
            raise DeviceUnreachableError(
                f"the robot at {self._settings.host} has told nothing yet; connect again"
            )
        return self._told

    def _opened(self) -> RTDEStream:
        if self._stream is None:
            raise DeviceUnreachableError(
                f"not connected to the robot at {self._settings.host}; call connect() first"
            )
        return self._stream


def _block(samples: Sequence[Sample]) -> PoseBlock:
    told = [Told.by(sample.values) for sample in samples]
    return PoseBlock(
        counter=np.array([sample.counter for sample in samples], dtype=np.int64),
        device_time_s=np.array([sample.device_time_s for sample in samples], dtype=np.float64),
        host_time_ns=np.array([sample.host_time_ns for sample in samples], dtype=np.int64),
        position=np.array([one.T_base_tool.position for one in told], dtype=np.float64).reshape(-1, 3),
        quaternion_wxyz=np.array([one.T_base_tool.quaternion_wxyz for one in told]).reshape(-1, 4),
        joints=np.array([one.joints for one in told], dtype=np.float64).reshape(-1, 6),
        moving=np.array([one.moving for one in told], dtype=np.bool_),
    )
