"""Reading a session folder: every stream as arrays exactly as the driver delivered it, images on demand."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.errors import RecordingError
from daq.recording import rows
from daq.recording.cdr import CdrLayout
from daq.recording.folder import SessionInfo, read_info
from daq.recording.recorder import CAMERAS_FILE, EVENTS, FORCE_FRAME, ROBOT_FRAME, SIGNALS_FILE, camera_frame
from daq.recording.rows import RECORD
from daq.recording.scan import Scan, scan
from robot_drivers.protocols import FloatArray, IntArray, PoseBlock, WrenchBlock

_UINT32 = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened at an instant of the host clock, ns."""

    time_ns: int
    name: str
    details: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Images:
    """The images of one camera; each is decoded when it is asked for.

    Attributes
    ----------
    counter : (n,) the camera's frame counter, -1 where it tells none
    device_time_s : (n,) the camera's clock, NaN where it tells none
    host_time_ns : (n,) receive stamps
    """

    counter: IntArray
    device_time_s: FloatArray
    host_time_ns: IntArray
    _records: list[memoryview]

    def __len__(self) -> int:
        return len(self._records)

    def image(self, index: int) -> NDArray[np.uint8]:
        """Return one image, (height, width) or (height, width, 3) for bgr8."""
        data = np.frombuffer(self._parts(index)[1], dtype=np.uint8)
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
        if image is None:
            raise RecordingError(f"image {index} of the recording cannot be decoded; verify the checksums")
        return np.asarray(image, dtype=np.uint8)

    def pixel_format(self, index: int) -> str:
        """Return ``"mono8"``, ``"bgr8"`` or ``"bayer_rggb8"`` and its siblings."""
        return self._parts(index)[0].partition(";")[0]

    def _parts(self, index: int) -> tuple[str, memoryview]:
        """Return the format string and the data of a ``CompressedImage``."""
        body = self._records[index][RECORD.itemsize :]
        frame_id_end = 16 + _UINT32.unpack_from(body, 12)[0]
        text_start = frame_id_end + -(frame_id_end - 4) % 4
        text_end = text_start + 4 + _UINT32.unpack_from(body, text_start)[0]
        data_start = text_end + -(text_end - 4) % 4 + 4
        return bytes(body[text_start + 4 : text_end - 1]).decode(), body[data_start:]


class Recording:
    """A session folder, sealed or not; a sample whose records were cut off is not there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.info: SessionInfo = read_info(folder)
        self._signals = scan(folder / SIGNALS_FILE)
        self._images = scan(folder / CAMERAS_FILE)

    @property
    def events(self) -> list[Event]:
        """All events in the order of their recording."""
        channel = self._signals.channel_id(EVENTS)
        found = []
        for record in self._signals.records(channel) if channel is not None else ():
            time_ns = int(np.frombuffer(record, RECORD, 1)["log_time"][0])
            details = json.loads(bytes(record[RECORD.itemsize :]))
            found.append(Event(time_ns, details.pop("event"), details))
        return found

    @property
    def force(self) -> WrenchBlock:
        """The whole force stream, sensor frame."""
        wrench = _messages(self._signals, "/force/wrench", rows.wrench_layout(FORCE_FRAME))
        stamp = _messages(self._signals, "/force/device", rows.stamp_layout(FORCE_FRAME))
        wrench = wrench[: len(stamp)]
        return WrenchBlock(
            counter=stamp["body"]["counter"],
            device_time_s=stamp["body"]["device_time_s"],
            host_time_ns=_host_time_ns(stamp),
            status=stamp["body"]["status"],
            usable=stamp["body"]["usable"].astype(np.bool_),
            wrench=wrench["body"]["wrench"],
        )

    @property
    def robot(self) -> PoseBlock:
        """The whole robot stream."""
        poses = _messages(self._signals, "/robot/pose", rows.pose_layout(ROBOT_FRAME))
        joints = _messages(self._signals, "/robot/joints", rows.joints_layout(ROBOT_FRAME))
        stamp = _messages(self._signals, "/robot/device", rows.stamp_layout(ROBOT_FRAME))
        poses, joints = poses[: len(stamp)], joints[: len(stamp)]
        return PoseBlock(
            counter=stamp["body"]["counter"],
            device_time_s=stamp["body"]["device_time_s"],
            host_time_ns=_host_time_ns(stamp),
            position=poses["body"]["position"],
            quaternion_wxyz=np.roll(poses["body"]["quaternion_xyzw"], 1, axis=1),
            joints=joints["body"]["joints"],
            moving=stamp["body"]["status"] != 0,
        )

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the recorded cameras."""
        topics = (channel.topic for channel in self._images.channels.values())
        return tuple(topic.split("/")[2] for topic in topics if topic.endswith("/image"))

    def images(self, camera: str) -> Images:
        """Return the images of one camera; raises RecordingError for an unknown one."""
        channel = self._images.channel_id(f"/camera/{camera}/image")
        if channel is None:
            raise RecordingError(f"{self.folder}: has no camera {camera!r}, only {', '.join(self.cameras)}")
        records = self._images.records(channel)
        stamp = _messages(self._images, f"/camera/{camera}/device", rows.stamp_layout(camera_frame(camera)))
        stamp = stamp[: len(records)]
        return Images(
            counter=stamp["body"]["counter"],
            device_time_s=stamp["body"]["device_time_s"],
            host_time_ns=_host_time_ns(stamp),
            _records=records,
        )


def _messages(found: Scan, topic: str, layout: CdrLayout) -> NDArray[np.void]:
    """Return all messages of a topic as an array with the fields ``record`` and ``body``."""
    dtype = np.dtype([("record", RECORD), ("body", layout.dtype)])
    channel = found.channel_id(topic)
    records = found.records(channel) if channel is not None else []
    if any(len(record) != dtype.itemsize for record in records):
        raise RecordingError(
            f"{topic}: its messages are not {dtype.itemsize} bytes long; another program wrote this file"
        )
    return np.frombuffer(b"".join(records), dtype=dtype)


def _host_time_ns(messages: NDArray[np.void]) -> IntArray:
    return messages["record"]["log_time"].astype(np.int64)
