"""Who reads the devices, and in which rank among the threads of the computer."""

import threading
import time
from collections.abc import Callable, Sequence

import pytest
from fake_devices import FakeCamera, FakeForceSensor, FakeRobot

import daq.recording.streams as streams
from daq.devices import Devices
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Frame, Pose, PoseBlock, WrenchBlock


class Watcher:
    """Notes which thread has shown what, and which has asked to go before others."""

    def __init__(self) -> None:
        self.noted: list[tuple[int, str]] = []

    def on_wrench(self, block: WrenchBlock) -> None:
        self._note("force")

    def on_pose(self, block: PoseBlock) -> None:
        self._note("robot")

    def on_frames(self, camera: str, frames: Sequence[Frame]) -> None:
        self._note("camera")

    def on_failure(self, stream: str, error: DeviceError) -> None:
        self._note("failure")

    def prefer(self) -> bool:
        self._note("preferred")
        return True

    def _note(self, what: str) -> None:
        self.noted.append((threading.get_ident(), what))

    def shown(self, what: str) -> int:
        """How often that was noted."""
        return sum(noted == what for _, noted in self.noted)

    def of_thread_with(self, what: str) -> list[str]:
        """What the thread that showed this has noted, in order."""
        thread = next(ident for ident, noted in self.noted if noted == what)
        return [noted for ident, noted in self.noted if ident == thread]


def wait_until(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + 60.0
    while not condition() and time.monotonic() < deadline_s:
        time.sleep(0.002)


def test_the_guards_threads_go_before_others_once_what_had_gathered_is_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    watcher = Watcher()
    monkeypatch.setattr(streams, "prefer_this_thread", watcher.prefer)
    robot = FakeRobot(Pose((0.5, 0.0, 0.3)))
    with streams.Streams(Devices(FakeForceSensor(), robot, {"left": FakeCamera()}), (watcher,)):
        wait_until(lambda: all(watcher.shown(one) > 1 for one in ("force", "robot", "camera")))
    for stream in ("force", "robot"):
        told = watcher.of_thread_with(stream)
        assert told[:2] == [stream, "preferred"]
        assert told.count("preferred") == 1
    assert "preferred" not in watcher.of_thread_with("camera")
