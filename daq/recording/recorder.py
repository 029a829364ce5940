"""Recording: one thread for each device reads it, shows every block to the observers and hands it to the writer.

Topics: ``/force/wrench``, ``/robot/pose``, ``/robot/joints`` and ``/camera/<name>/image``, each device with its
``…/device`` stamps beside, and ``/events``. Force, robot and events go to ``signals.mcap``, images to
``cameras.mcap``.
"""

import threading
from collections.abc import Callable, Mapping, Sequence, Sized
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self, TypeVar

from daq.errors import RecordingError
from daq.recording import schemas
from daq.recording.mcap_log import McapLog
from daq.recording.rows import EventRows, FrameRows, PoseRows, WrenchRows
from daq.recording.writer import Packet, RecordWriter
from robot_drivers.clock import host_time_ns
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import Camera, ForceSensor, Frame, PoseBlock, Robot, WrenchBlock

SIGNALS_FILE = "signals.mcap"
CAMERAS_FILE = "cameras.mcap"
EVENTS = "/events"
FORCE_FRAME = "force_sensor"
ROBOT_FRAME = "robot_base"

_READ_TIMEOUT_S = 0.02

Block = TypeVar("Block", bound=Sized)
Loop = Callable[[], None]


class Observer(Protocol):
    """Sees what arrives, in the thread of the device, before it is written; an empty block means silence."""

    def on_wrench(self, block: WrenchBlock) -> None:
        """See samples of the force sensor."""

    def on_pose(self, block: PoseBlock) -> None:
        """See states of the robot."""

    def on_frames(self, camera: str, frames: Sequence[Frame]) -> None:
        """See images of one camera."""


class Recorder:
    """Records connected, streaming devices from construction to :meth:`close`; a context manager."""

    def __init__(
        self,
        folder: Path,
        force_sensor: ForceSensor,
        robot: Robot,
        cameras: Mapping[str, Camera],
        observers: Sequence[Observer] = (),
    ) -> None:
        self._observers = observers
        self._failures: list[DeviceError] = []
        self._stopping = threading.Event()
        self._event_lock = threading.Lock()
        self._event_sequence = 0
        self._logs = ExitStack()
        self._signals = self._logs.enter_context(McapLog(folder / SIGNALS_FILE))
        self._images = self._logs.enter_context(McapLog(folder / CAMERAS_FILE))
        self._event_rows = EventRows(self._signals.add_channel(EVENTS, schemas.EVENT))
        self._writer = RecordWriter((self._signals, self._images), self._dropped_packet)
        loops = [self._force_loop(force_sensor), self._robot_loop(robot)]
        loops += [self._camera_loop(name, camera) for name, camera in cameras.items()]
        self._threads = [threading.Thread(target=loop, name=f"record-{n}") for n, loop in enumerate(loops)]
        for thread in self._threads:
            thread.start()

    def event(self, name: str, **details: object) -> int:
        """Record that something happened now; return the time, ns of the host clock."""
        now = host_time_ns()
        self._writer.insist(self._event_packet({"event": name, **details}, now))
        return now

    def check(self) -> None:
        """Raise when a device, the disk, or this program has failed."""
        self._writer.check()
        if self._failures:
            raise self._failures[0]
        if not all(thread.is_alive() for thread in self._threads):
            raise RecordingError(
                "a recording thread has ended by a programming error; see its traceback above"
            )

    def dropped(self) -> dict[str, int]:
        """Return the samples of each stream that were received but not written."""
        return self._writer.dropped()

    def close(self) -> None:
        """Stop reading, write what is under way and close the files, unsealed."""
        self._stopping.set()
        for thread in self._threads:
            thread.join()
        self._writer.close()
        self._logs.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _force_loop(self, sensor: ForceSensor) -> Loop:
        def show(block: WrenchBlock) -> None:
            for observer in self._observers:
                observer.on_wrench(block)

        rows = WrenchRows(
            self._signals.add_channel("/force/wrench", schemas.WRENCH),
            self._signals.add_channel("/force/device", schemas.DEVICE_STAMP),
            frame_id=FORCE_FRAME,
        )
        return self._loop("force", self._signals, sensor.read, show, rows.pack)

    def _robot_loop(self, robot: Robot) -> Loop:
        def show(block: PoseBlock) -> None:
            for observer in self._observers:
                observer.on_pose(block)

        rows = PoseRows(
            self._signals.add_channel("/robot/pose", schemas.POSE),
            self._signals.add_channel("/robot/joints", schemas.JOINT_STATE),
            self._signals.add_channel("/robot/device", schemas.DEVICE_STAMP),
            frame_id=ROBOT_FRAME,
        )
        return self._loop("robot", self._signals, robot.read, show, rows.pack)

    def _camera_loop(self, name: str, camera: Camera) -> Loop:
        def show(frames: Sequence[Frame]) -> None:
            for observer in self._observers:
                observer.on_frames(name, frames)

        rows = FrameRows(
            self._images.add_channel(f"/camera/{name}/image", schemas.COMPRESSED_IMAGE),
            self._images.add_channel(f"/camera/{name}/device", schemas.DEVICE_STAMP),
            frame_id=camera_frame(name),
        )
        return self._loop(f"camera/{name}", self._images, camera.read, show, rows.pack)

    def _loop(
        self,
        stream: str,
        log: McapLog,
        read: Callable[[float], Block],
        show: Callable[[Block], None],
        pack: Callable[[Block, int], bytes],
    ) -> Loop:
        """Return what the thread of a device does until the end, or until the device fails."""

        def loop() -> None:
            sequence = 0
            try:
                while not self._stopping.is_set():
                    block = read(_READ_TIMEOUT_S)
                    show(block)
                    if len(block):
                        self._writer.offer(Packet(log, pack(block, sequence), stream, len(block)))
                        sequence += len(block)
            except DeviceError as error:
                self._failures.append(error)
                self.event("device_failed", stream=stream, message=str(error))

        return loop

    def _event_packet(self, event: Mapping[str, object], time_ns: int) -> Packet:
        with self._event_lock:
            records = self._event_rows.pack(event, time_ns, self._event_sequence)
            self._event_sequence += 1
        return Packet(self._signals, records, "events", 1)

    def _dropped_packet(self, dropped: dict[str, int]) -> Packet:
        return self._event_packet({"event": "samples_dropped", "samples": dropped}, host_time_ns())


def camera_frame(name: str) -> str:
    """Return the frame id that a camera's messages carry."""
    return f"camera_{name}"
