"""Devices made of arithmetic, with the protocols of the real ones and nothing behind them."""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceFaultError, MotionRefusedError
from robot_drivers.protocols import (
    DeviceIdentity,
    Frame,
    Pose,
    PoseBlock,
    RobotState,
    Speed,
    StreamStatistics,
    WrenchBlock,
)

PATIENCE_S = 60.0


class _Fake:
    kind = "fake"

    def __init__(self) -> None:
        self.counter = 0
        self.silent = threading.Event()
        self.closed = False
        self.counts = StreamStatistics()

    @property
    def identity(self) -> DeviceIdentity:
        return DeviceIdentity(self.kind, "fake", "0", "memory")

    def connect(self) -> None:
        self.closed = False

    def close(self) -> None:
        self.closed = True

    def statistics(self) -> StreamStatistics:
        return replace(self.counts, received=self.counter)

    def _stamps(self, timeout_s: float, period_s: float) -> np.ndarray:
        """Wait a while and return the counters of the samples that fell into it."""
        time.sleep(min(timeout_s, 0.005))
        if self.silent.is_set():
            return np.arange(0)
        count = max(1, round(0.005 / period_s))
        counters = self.counter + np.arange(count)
        self.counter += count
        return counters


class FakeRobot(_Fake):
    """Moves in ten jumps; ``poses`` is where it stood. It reports to be ``pushed_m`` off."""

    kind = "robot"

    def __init__(self, T_base_tool: Pose) -> None:
        super().__init__()
        self.pose = T_base_tool
        self.poses: list[Pose] = []
        self.held = threading.Event()
        self.hold_calls = 0
        self.move_s = 0.02
        self.on_the_way: Callable[[], object] | None = None
        self.reach_m = 1.0
        self.pushed_m = np.zeros(3)

    def state(self) -> RobotState:
        joints = (0.0,) * 6
        return RobotState(self.pose, joints, False, True, not self.held.is_set(), self.held.is_set(), "held")

    def move_linear(self, T_base_tool: Pose, speed: Speed, timeout_s: float) -> Pose:
        if self.held.is_set():
            raise MotionRefusedError("held")
        if (act := self.on_the_way) is not None:
            self.on_the_way = None
            act()
            if self.held.wait(PATIENCE_S):
                raise DeviceFaultError("held on the way")
        start = np.array(self.pose.position)
        way = np.array(T_base_tool.position) - start
        for number in range(1, 11):
            if self.held.wait(self.move_s / 10):
                raise DeviceFaultError("held on the way")
            x, y, z = start + way * number / 10
            self.pose = Pose((x, y, z), T_base_tool.quaternion_wxyz)
        self.poses.append(T_base_tool)
        return T_base_tool

    def check_trajectory(self, targets: Sequence[Pose], speed: Speed) -> None:
        if any(target.position[0] > self.reach_m for target in targets):
            raise MotionRefusedError(f"beyond the reach of {self.reach_m} m")

    def hold(self) -> None:
        self.hold_calls += 1
        self.held.set()

    def resume(self) -> None:
        self.held.clear()

    def read(self, timeout_s: float) -> PoseBlock:
        counters = self._stamps(timeout_s, 0.005)
        n = len(counters)
        return PoseBlock(
            counter=counters,
            device_time_s=np.full(n, time.monotonic()),
            host_time_ns=np.full(n, host_time_ns()),
            position=np.tile(self.pose.position + self.pushed_m, (n, 1)),
            quaternion_wxyz=np.tile(self.pose.quaternion_wxyz, (n, 1)),
            joints=np.zeros((n, 6)),
            moving=np.zeros(n, dtype=np.bool_),
        )


class FakeForceSensor(_Fake):
    """Reads ``wrench``, in which a test may write."""

    kind = "force sensor"

    def __init__(self) -> None:
        super().__init__()
        self.wrench = np.zeros(6)
        self.usable = True
        self.robot: FakeRobot | None = None
        self.force_per_metre = 0.0
        self.started = False

    def start(self) -> None:
        self.started = True

    def stop(self) -> None:
        self.started = False

    def read(self, timeout_s: float) -> WrenchBlock:
        counters = self._stamps(timeout_s, 0.001)
        n = len(counters)
        wrench = self.wrench.copy()
        if self.robot is not None:
            wrench[0] -= self.force_per_metre * self.robot.pose.position[0]
        return WrenchBlock(
            counter=counters,
            device_time_s=counters * 1e-3,
            host_time_ns=host_time_ns() - np.arange(n)[::-1] * 1_000_000,
            status=np.full(n, 0 if self.usable else 0x80020000),
            usable=np.full(n, self.usable),
            wrench=np.tile(wrench, (n, 1)),
        )


class FakeCamera(_Fake):
    """Delivers the same small image again and again."""

    kind = "camera"

    def __init__(self, pixel_format: str = "mono8") -> None:
        super().__init__()
        self.pixel_format = pixel_format
        shape = (6, 8, 3) if pixel_format == "bgr8" else (6, 8)
        self.image = np.arange(np.prod(shape), dtype=np.uint8).reshape(shape)

    def read(self, timeout_s: float) -> list[Frame]:
        time.sleep(0.02)
        self.counter += 1
        return [Frame(self.counter - 1, self.counter / 50, host_time_ns(), self.pixel_format, self.image)]
