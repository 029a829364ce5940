"""A thread for each device reads it and shows what came to the observers, whether it is recorded or not."""

import threading
from collections.abc import Callable, Mapping, Sequence, Sized
from typing import Protocol, TypeVar

from daq.errors import RecordingError
from robot_drivers.clock import Reader, host_time_ns, new_reader
from robot_drivers.closing import ClosedAtExit
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Camera, ForceSensor, Frame, PoseBlock, Robot, WrenchBlock
from robot_drivers.real_time import prefer_this_thread

FORCE = "force"
ROBOT = "robot"

_READ_TIMEOUT_S = 0.02

Block = TypeVar("Block", bound=Sized)


class Observer(Protocol):
    """Sees what arrives, in the thread of the device; an empty block means silence."""

    def on_wrench(self, block: WrenchBlock) -> None:
        """See samples of the force sensor."""

    def on_pose(self, block: PoseBlock) -> None:
        """See states of the robot."""

    def on_frames(self, camera: str, frames: Sequence[Frame]) -> None:
        """See images of one camera."""

    def on_failure(self, stream: str, error: DeviceError) -> None:
        """Learn that a device has failed; nothing more comes from it."""


class StreamingDevices(Protocol):
    """The devices whose streams are read; the cameras by their names."""

    @property
    def force_sensor(self) -> ForceSensor:
        """The force sensor."""

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def cameras(self) -> Mapping[str, Camera]:
        """The cameras."""


class Streams(ClosedAtExit):
    """Reads connected, streaming devices from construction to :meth:`close`; a context manager.

    The observers see every block in their order, before the next one is read.
    """

    def __init__(self, devices: StreamingDevices, observers: Sequence[Observer]) -> None:
        self._observers = observers
        self._failures: list[DeviceError] = []
        self._stopping = threading.Event()
        wrench_shows = [observer.on_wrench for observer in observers]
        pose_shows = [observer.on_pose for observer in observers]
        # The guard sits in these two, which therefore go before other programs.
        loops = [
            self._loop(FORCE, devices.force_sensor.read, wrench_shows, prefer_this_thread),
            self._loop(ROBOT, devices.robot.read, pose_shows, prefer_this_thread),
        ]
        for name, camera in devices.cameras.items():
            shows = _frame_shows(observers, name)
            loops.append(self._loop(camera_stream(name), camera.read, shows, _as_others))
        self._threads = [threading.Thread(target=loop, name=f"read-{n}") for n, loop in enumerate(loops)]
        for thread in self._threads:
            thread.start()

    def check(self) -> None:
        """Raise when a device or this program has failed."""
        if self._failures:
            raise self._failures[0]
        if not all(thread.is_alive() for thread in self._threads):
            raise RecordingError(
                "a recording thread has ended by a programming error; see its traceback above"
            )

    def close(self) -> None:
        """Stop reading."""
        self._stopping.set()
        for thread in self._threads:
            thread.join()

    def _loop(
        self,
        stream: str,
        read: Callable[[float], Block],
        shows: Sequence[Callable[[Block], None]],
        take_rank: Callable[[], object],
    ) -> Callable[[], None]:
        """Return what the thread of a device does until the end, or until the device fails.

        It takes its rank among the threads of the computer only when it has read what had gathered: of ten seconds
        without a reader that is a tenth of a second's work, for which nobody should have to wait.
        """

        def pass_on(reader: Reader) -> None:
            begun_ns = host_time_ns()
            block = read(_READ_TIMEOUT_S)
            for show in shows:
                show(block)
            reader.caught_up(begun_ns)

        def loop() -> None:
            reader = new_reader()
            try:
                pass_on(reader)
                take_rank()
                while not self._stopping.is_set():
                    pass_on(reader)
            except DeviceError as error:
                self._failures.append(error)
                for observer in self._observers:
                    observer.on_failure(stream, error)
            finally:
                reader.close()

        return loop


def _as_others() -> None:
    """Stay of the rank of other threads."""


def camera_stream(name: str) -> str:
    """Return what a camera's stream is called."""
    return f"camera/{name}"


def _frame_shows(observers: Sequence[Observer], name: str) -> list[Callable[[Sequence[Frame]], None]]:
    def shower(observer: Observer) -> Callable[[Sequence[Frame]], None]:
        return lambda frames: observer.on_frames(name, frames)

    return [shower(observer) for observer in observers]
