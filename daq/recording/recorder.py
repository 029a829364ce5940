"""Recording: what the streams bring is packed, images after compression, and handed to the writer."""

import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import asdict
from pathlib import Path

from daq.errors import RecordingError
from daq.recording.events import DEPTH_SCALE
from daq.recording.layout import (
    CAMERAS_FILE,
    EVENTS,
    FORCE_FRAME,
    ROBOT_FRAME,
    SIGNALS_FILE,
    camera_frame,
    depth_of,
)
from daq.recording.mcap import schemas
from daq.recording.mcap.log import McapLog
from daq.recording.messages import codec
from daq.recording.messages.codec import EncodedImage, Encoding
from daq.recording.messages.image_encoder import ImageEncoder
from daq.recording.messages.rows import EventRows, FrameRows, PoseRows, WrenchRows, camera_info_row
from daq.recording.streams import FORCE, ROBOT, Observer, StreamingDevices, Streams, camera_stream
from daq.recording.writer import Packet, RecordWriter
from daq.vision.camera_model import PinholeCamera
from robot_drivers.clock import host_time_ns
from robot_drivers.closing import ClosedAtExit
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import DepthScale, Frame, PoseBlock, WrenchBlock

_FULL_ENOUGH = 0.25


class Recorder(ClosedAtExit):
    """Records connected, streaming devices from construction to :meth:`close`; a context manager.

    It is itself the last of the observers: the others see every block before it is recorded.

    Parameters
    ----------
    models : of the cameras by name, where they are known
    tell_failure : called at once, from a thread of the recorder, when the disk takes no more
    with_depth : names of the cameras whose images come with depth; that of others is not recorded
    """

    def __init__(
        self,
        folder: Path,
        devices: StreamingDevices,
        observers: Sequence[Observer] = (),
        models: Mapping[str, PinholeCamera] | None = None,
        tell_failure: Callable[[RecordingError], None] = lambda failure: None,
        with_depth: Collection[str] = (),
    ) -> None:
        self._events = threading.Lock()
        self._event_sequence = self._force_sequence = self._pose_sequence = 0
        self._logs = ExitStack()
        self._signals = signals = self._logs.enter_context(McapLog(folder / SIGNALS_FILE))
        self._images = self._logs.enter_context(McapLog(folder / CAMERAS_FILE))
        self._event_rows = EventRows(signals.add_channel(EVENTS, schemas.EVENT))
        self._wrench_rows = WrenchRows(
            signals.add_channel("/force/wrench", schemas.WRENCH),
            signals.add_channel("/force/device", schemas.DEVICE_STAMP),
            frame_id=FORCE_FRAME,
        )
        self._pose_rows = PoseRows(
            signals.add_channel("/robot/pose", schemas.POSE),
            signals.add_channel("/robot/joints", schemas.JOINT_STATE),
            signals.add_channel("/robot/device", schemas.DEVICE_STAMP),
            frame_id=ROBOT_FRAME,
        )
        frame_rows = {name: self._frame_rows(name) for name in devices.cameras}
        depth_rows = {depth_of(name): self._frame_rows(depth_of(name)) for name in with_depth}
        for name, model in (models or {}).items():
            self._describe_camera(name, model)
        self._writer = RecordWriter((signals, self._images), self._dropped_packet, tell_failure=tell_failure)
        self._encoders = {
            **{name: self._encoder(name, rows, codec.IMAGES) for name, rows in frame_rows.items()},
            **{name: self._encoder(name, rows, codec.DEPTH) for name, rows in depth_rows.items()},
        }
        self._depth_scales: dict[str, DepthScale] = {}
        self._streams = Streams(devices, (*observers, self))

    def event(self, name: str, **details: object) -> int:
        """Record that something happened now; return the time, ns of the host clock."""
        now = host_time_ns()
        self._writer.insist(self._event_packet({"event": name, **details}, now))
        return now

    def check(self) -> None:
        """Raise when a device, the disk, or this program has failed."""
        self.check_disk()
        self._streams.check()
        if not all(encoder.is_alive() for encoder in self._encoders.values()):
            raise RecordingError(
                "a thread that encodes images has ended by a programming error; see its traceback above"
            )

    def check_disk(self) -> None:
        """Raise RecordingError when the disk has failed."""
        self._writer.check()

    def written(self) -> dict[str, int]:
        """Return the samples of each stream that are in the file and survive the death of this process."""
        return dict(self._writer.written)

    def dropped(self) -> dict[str, int]:
        """Return the samples of each stream that were received but not written."""
        return self._writer.dropped()

    def close(self) -> None:
        """Stop reading, write what is under way and close the files, unsealed."""
        self._streams.close()
        for encoder in self._encoders.values():
            encoder.close()
        self._writer.close()
        self._logs.close()

    def on_wrench(self, block: WrenchBlock) -> None:
        """Record samples of the force sensor."""
        if len(block):
            rows = self._wrench_rows.pack(block, self._force_sequence)
            self._writer.offer(Packet(self._signals, rows, FORCE, len(block)))
            self._force_sequence += len(block)

    def on_pose(self, block: PoseBlock) -> None:
        """Record states of the robot."""
        if len(block):
            rows = self._pose_rows.pack(block, self._pose_sequence)
            self._writer.offer(Packet(self._signals, rows, ROBOT, len(block)))
            self._pose_sequence += len(block)

    def on_frames(self, camera: str, frames: Sequence[Frame]) -> None:
        """Record images of one camera."""
        self._encoders[camera].put(frames)
        if (depth := self._encoders.get(depth_of(camera))) is not None:
            for frame in frames:
                if frame.depth is not None:
                    self._tell_scale(camera, frame.depth.scale)
                    depth.put([frame])

    def on_failure(self, stream: str, error: DeviceError) -> None:
        """Record that a device has failed."""
        self.event("device_failed", stream=stream, message=str(error))

    def _tell_scale(self, camera: str, scale: DepthScale) -> None:
        """Record what the counts of depth mean, where that is new."""
        if self._depth_scales.get(camera) != scale:
            self._depth_scales[camera] = scale
            # where the disk has failed that is told elsewhere, and not in the thread that reads a device
            with suppress(RecordingError):
                self.event(DEPTH_SCALE, camera=camera, **asdict(scale))

    def _frame_rows(self, name: str) -> FrameRows:
        return FrameRows(
            self._images.add_channel(f"/camera/{name}/image", schemas.COMPRESSED_IMAGE),
            self._images.add_channel(f"/camera/{name}/image_raw", schemas.IMAGE),
            self._images.add_channel(f"/camera/{name}/device", schemas.DEVICE_STAMP),
            frame_id=camera_frame(name),
        )

    def _describe_camera(self, name: str, model: PinholeCamera) -> None:
        channel = self._images.add_channel(f"/camera/{name}/camera_info", schemas.CAMERA_INFO)
        self._images.append(camera_info_row(channel, camera_frame(name), model, host_time_ns()))

    def _encoder(self, name: str, rows: FrameRows, encoding: Encoding) -> ImageEncoder:
        stream = camera_stream(name)

        def deliver(encoded: EncodedImage, sequence: int, backlog: int) -> None:
            self._writer.offer(Packet(self._images, rows.pack(encoded, sequence, backlog), stream, 1))

        return ImageEncoder(
            name,
            deliver,
            drop=lambda images: self._writer.drop(stream, images),
            disk_is_slow=lambda: self._writer.filling > _FULL_ENOUGH,
            encoding=encoding,
        )

    def _event_packet(self, event: Mapping[str, object], time_ns: int) -> Packet:
        with self._events:
            rows = self._event_rows.pack(event, time_ns, self._event_sequence)
            self._event_sequence += 1
        return Packet(self._signals, rows, "events", 1)

    def _dropped_packet(self, dropped: dict[str, int]) -> Packet:
        return self._event_packet({"event": "samples_dropped", "samples": dropped}, host_time_ns())
