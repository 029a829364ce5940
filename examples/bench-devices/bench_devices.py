"""A force sensor, an arm of seven joints and a camera, made of arithmetic: a whole rig without any hardware.

They show what a driver in a package of its own consists of: settings, what is made of them, and what is known of the
device beforehand. ``pyproject.toml`` declares the three of them as entry points.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from robot_drivers.clock import host_time_ns
from robot_drivers.driver import Driver
from robot_drivers.errors import DeviceFaultError, DeviceTimeoutError, MotionRefusedError
from robot_drivers.protocols import (
    DeviceIdentity,
    Frame,
    IntArray,
    Pose,
    PoseBlock,
    RobotState,
    Speed,
    StreamStatistics,
    WrenchBlock,
)
from robot_drivers.specification import CameraSpecification, ForceSensorSpecification, RobotSpecification, Six

JOINTS = 7
_STEP_S = 0.005


@dataclass
class Ticks:
    """A stream of so many samples a second, which nobody has to send: they fall due by the clock of this computer."""

    rate_hz: float
    _origin_ns: int = field(default_factory=host_time_ns)
    _taken: int = 0

    def due(self, timeout_s: float) -> tuple[IntArray, IntArray]:
        """Return counters and stamps, ns, of the samples since the last call; wait so long for a first one."""
        deadline = time.monotonic() + timeout_s
        while (count := self._passed() - self._taken) < 1 and time.monotonic() < deadline:
            time.sleep(min(0.5 / self.rate_hz, timeout_s))
        counter = self._taken + np.arange(max(count, 0), dtype=np.int64)
        self._taken += len(counter)
        return counter, self._origin_ns + np.rint(counter / self.rate_hz * 1e9).astype(np.int64)

    def statistics(self) -> StreamStatistics:
        """Return the counts."""
        return StreamStatistics(received=self._taken)

    def _passed(self) -> int:
        return int((host_time_ns() - self._origin_ns) * 1e-9 * self.rate_hz)


# ---- the force sensor


@dataclass(frozen=True, slots=True)
class SensorSettings:
    """The keys of ``[force_sensor.settings]``; the wrench is what it reads at rest, N and N·m."""

    rate_hz: float = 500.0
    rated_wrench: Six = (50.0, 50.0, 70.0, 2.0, 2.0, 2.0)
    wrench: Six = (0.0, 0.0, -3.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not self.rate_hz > 0:
            raise ValueError(f"rate_hz must be positive, not {self.rate_hz}")


class Sensor:
    """A :class:`robot_drivers.protocols.ForceSensor`."""

    def __init__(self, settings: SensorSettings) -> None:
        self._settings = settings
        self._ticks = Ticks(settings.rate_hz)
        self._random = np.random.default_rng()

    @property
    def identity(self) -> DeviceIdentity:
        """Who it is."""
        return DeviceIdentity("force sensor", "bench sensor", "S1", "this computer")

    def connect(self) -> None:
        """Begin anew."""
        self._ticks = Ticks(self._settings.rate_hz)

    def start(self) -> None:
        """Begin anew."""
        self.connect()

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return the samples that have fallen due."""
        counter, stamps = self._ticks.due(timeout_s)
        noise = self._random.standard_normal((len(counter), 6)) * _noise_std(self._settings)
        return WrenchBlock(
            counter=counter,
            device_time_s=counter / self._settings.rate_hz,
            host_time_ns=stamps,
            status=np.zeros(len(counter), dtype=np.int64),
            usable=np.ones(len(counter), dtype=np.bool_),
            wrench=noise + self._settings.wrench,
        )

    def statistics(self) -> StreamStatistics:
        """Return the counts."""
        return self._ticks.statistics()

    def stop(self) -> None:
        """Do nothing: what is not read is not made."""

    def close(self) -> None:
        """Do nothing."""


def _noise_std(settings: SensorSettings) -> Six:
    """Return a ten-thousandth of the range, N and N·m."""
    fx, fy, fz, tx, ty, tz = (1e-4 * rated for rated in settings.rated_wrench)
    return (fx, fy, fz, tx, ty, tz)


SENSOR = Driver(
    SensorSettings,
    Sensor,
    lambda settings: ForceSensorSpecification(
        rated_wrench=settings.rated_wrench, noise_std=_noise_std(settings), rate_hz=settings.rate_hz
    ),
)


# ---- the arm


@dataclass(frozen=True, slots=True)
class ArmSettings:
    """The keys of ``[robot.settings]``: where the tool stands at first, base frame, and how fast it may be."""

    T_base_tool: Pose
    rate_hz: float = 200.0
    fastest_m_s: float = 0.05


class Arm:
    """A :class:`robot_drivers.protocols.Robot` of seven joints, which turn with the place of its tool."""

    def __init__(self, settings: ArmSettings) -> None:
        self._settings = settings
        self._pose = settings.T_base_tool
        self._moving = False
        self._held = threading.Event()
        self._one_motion = threading.Lock()
        self._ticks = Ticks(settings.rate_hz)

    @property
    def identity(self) -> DeviceIdentity:
        """Who it is."""
        return DeviceIdentity("robot", "bench arm", "R1", "this computer")

    def connect(self) -> None:
        """Begin the stream anew; it stands where it stood."""
        self._ticks = Ticks(self._settings.rate_hz)

    def state(self) -> RobotState:
        """Return where it is."""
        held = self._held.is_set()
        ready = not (held or self._moving)
        return RobotState(self._pose, self._joints(), self._moving, True, ready, held, "held" if held else "")

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        """Refuse what is too fast."""
        if not 0 < speed.linear <= self._settings.fastest_m_s:
            raise MotionRefusedError(
                f"{speed.linear} m/s is not above 0 and at most {self._settings.fastest_m_s} m/s"
            )

    def move_linear(self, T_base_tool: Pose, speed: Speed, timeout_s: float) -> Pose:
        """Move along a straight line, its orientation at once, and return where it then stands."""
        self.check_trajectory([T_base_tool], speed)
        if self._held.is_set() or not self._one_motion.acquire(blocking=False):
            raise MotionRefusedError("the arm is held, or moves already")
        start = np.array(self._pose.position)
        way = T_base_tool.position - start
        steps = max(1, int(np.linalg.norm(way) / speed.linear / _STEP_S))
        deadline = time.monotonic() + timeout_s
        try:
            self._moving = True
            for number in range(1, steps + 1):
                if self._held.wait(_STEP_S):
                    raise DeviceFaultError("the arm was held on its way")
                if time.monotonic() > deadline:
                    self._held.set()
                    raise DeviceTimeoutError(f"not there in {timeout_s:g} s; the arm was held")
                x, y, z = (start + number / steps * way).tolist()
                self._pose = replace(T_base_tool, position=(x, y, z))
        finally:
            self._moving = False
            self._one_motion.release()
        return self._pose

    def hold(self) -> None:
        """Stand at once."""
        self._held.set()

    def resume(self) -> None:
        """Allow motion again."""
        self._held.clear()

    def read(self, timeout_s: float) -> PoseBlock:
        """Return the samples that have fallen due, all of them as it stands now."""
        counter, stamps = self._ticks.due(timeout_s)
        n = len(counter)
        return PoseBlock(
            counter=counter,
            device_time_s=counter / self._settings.rate_hz,
            host_time_ns=stamps,
            position=np.tile(self._pose.position, (n, 1)),
            quaternion_wxyz=np.tile(self._pose.quaternion_wxyz, (n, 1)),
            joints=np.tile(self._joints(), (n, 1)),
            moving=np.full(n, self._moving),
        )

    def statistics(self) -> StreamStatistics:
        """Return the counts."""
        return self._ticks.statistics()

    def close(self) -> None:
        """Do nothing: it stands."""

    def _joints(self) -> tuple[float, ...]:
        x, y, z = self._pose.position
        return (x, y, z, x + y, y + z, z + x, x + y + z)


ARM = Driver(
    ArmSettings, Arm, lambda settings: RobotSpecification(joints=JOINTS, joint_limits=((-3.0, 3.0),) * JOINTS)
)


# ---- the camera


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """The keys of ``[cameras.settings]``."""

    fps: float = 20.0
    width: int = 64
    height: int = 48


class Camera:
    """A :class:`robot_drivers.protocols.Camera` that sees a bar move over a grey field."""

    def __init__(self, settings: CameraSettings) -> None:
        self._settings = settings
        self._ticks = Ticks(settings.fps)

    @property
    def identity(self) -> DeviceIdentity:
        """Who it is."""
        return DeviceIdentity("camera", "bench camera", "C1", "this computer")

    def connect(self) -> None:
        """Begin anew."""
        self._ticks = Ticks(self._settings.fps)

    def read(self, timeout_s: float) -> list[Frame]:
        """Return the images that have fallen due."""
        counter, stamps = self._ticks.due(timeout_s)
        return [
            Frame(number, number / self._settings.fps, stamp, "mono8", self._image(number))
            for number, stamp in zip(counter.tolist(), stamps.tolist(), strict=True)
        ]

    def statistics(self) -> StreamStatistics:
        """Return the counts."""
        return self._ticks.statistics()

    def close(self) -> None:
        """Do nothing."""

    def _image(self, number: int) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
        image = np.full((self._settings.height, self._settings.width), 120, dtype=np.uint8)
        image[:, number % self._settings.width] = 200
        return image


CAMERA = Driver(CameraSettings, Camera, lambda settings: CameraSpecification(frames_per_s=settings.fps))
