"""Reading a session folder: every stream as arrays exactly as the driver delivered it, images on demand."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import RecordingError
from daq.recording import rows
from daq.recording.cdr import CdrLayout
from daq.recording.damage import telling_damage
from daq.recording.folder import SessionInfo, read_info, recover_session
from daq.recording.recorder import CAMERAS_FILE, EVENTS, FORCE_FRAME, ROBOT_FRAME, SIGNALS_FILE, camera_frame
from daq.recording.rows import RECORD
from daq.recording.scan import scan
from daq.recording.segments import Scan
from daq.recording.stored_images import StoredImage, sequence_of, stored_image
from robot_drivers.protocols import FloatArray, IntArray, PoseBlock, WrenchBlock

_NO_DATA = memoryview(b"")


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
    backlog : (n,) images that waited when this one was encoded
    """

    counter: IntArray
    device_time_s: FloatArray
    host_time_ns: IntArray
    backlog: IntArray
    _stored: list[StoredImage]

    def __len__(self) -> int:
        return len(self._stored)

    def image(self, index: int) -> NDArray[np.uint8]:
        """Return one image, (height, width) or (height, width, 3) for bgr8."""
        image = self._stored[index].pixels()
        if image is None:
            raise RecordingError(f"image {index} of the recording cannot be decoded; verify the checksums")
        return image

    def pixel_format(self, index: int) -> str:
        """Return ``"mono8"``, ``"bgr8"`` or ``"bayer_rggb8"`` and its siblings."""
        return self._stored[index].pixel_format

    def is_raw(self, index: int) -> bool:
        """Tell whether the image was stored without compression."""
        return self._stored[index].compression is None

    def followed_by(self, later: "Images") -> "Images":
        """Return these images and later ones of the same camera."""
        return Images(
            counter=np.concatenate([self.counter, later.counter]),
            device_time_s=np.concatenate([self.device_time_s, later.device_time_s]),
            host_time_ns=np.concatenate([self.host_time_ns, later.host_time_ns]),
            backlog=np.concatenate([self.backlog, later.backlog]),
            _stored=[*self._stored, *later._stored],
        )

    def without_pixels(self, chosen: NDArray[np.bool_]) -> "Images":
        """Return the same with the chosen images (n,) no longer to be decoded, so that their memory is free."""
        stored = [
            replace(image, data=_NO_DATA) if gone and len(image.data) else image
            for image, gone in zip(self._stored, chosen.tolist(), strict=True)
        ]
        return replace(self, _stored=stored)


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
        with telling_damage(self.folder / SIGNALS_FILE):
            return events_of(self._signals)

    @property
    def force(self) -> WrenchBlock:
        """The whole force stream, sensor frame."""
        with telling_damage(self.folder / SIGNALS_FILE):
            return force_of(self._signals)

    @property
    def robot(self) -> PoseBlock:
        """The whole robot stream."""
        with telling_damage(self.folder / SIGNALS_FILE):
            return robot_of(self._signals)

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the recorded cameras."""
        with telling_damage(self.folder / CAMERAS_FILE):
            return cameras_of(self._images)

    def images(self, camera: str) -> Images:
        """Return the images of one camera; raises RecordingError for an unknown one."""
        if self._images.channel_id(f"/camera/{camera}/image") is None:
            raise RecordingError(f"{self.folder}: has no camera {camera!r}, only {', '.join(self.cameras)}")
        with telling_damage(self.folder / CAMERAS_FILE):
            return images_of(self._images, camera)


def events_of(found: Scan) -> list[Event]:
    """Return the events of a scan of the signals in the order of their recording."""
    channel = found.channel_id(EVENTS)
    events = []
    for record in found.records(channel) if channel is not None else ():
        time_ns = int(np.frombuffer(record, RECORD, 1)["log_time"][0])
        details = json.loads(bytes(record[RECORD.itemsize :]))
        events.append(Event(time_ns, details.pop("event"), details))
    return events


def force_of(found: Scan) -> WrenchBlock:
    """Return the force stream of a scan of the signals, sensor frame."""
    wrench = _messages(found, "/force/wrench", rows.wrench_layout(FORCE_FRAME))
    stamp = _messages(found, "/force/device", rows.stamp_layout(FORCE_FRAME))
    wrench = wrench[: len(stamp)]
    return WrenchBlock(
        counter=stamp["body"]["counter"],
        device_time_s=stamp["body"]["device_time_s"],
        host_time_ns=_host_time_ns(stamp),
        status=stamp["body"]["status"],
        usable=stamp["body"]["usable"].astype(np.bool_),
        wrench=wrench["body"]["wrench"],
    )


def robot_of(found: Scan) -> PoseBlock:
    """Return the robot stream of a scan of the signals."""
    poses = _messages(found, "/robot/pose", rows.pose_layout(ROBOT_FRAME))
    joints = _messages(found, "/robot/joints", rows.joints_layout(ROBOT_FRAME))
    stamp = _messages(found, "/robot/device", rows.stamp_layout(ROBOT_FRAME))
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


def cameras_of(found: Scan) -> tuple[str, ...]:
    """Return the names of the cameras that a scan knows of."""
    topics = (channel.topic for channel in found.channels.values())
    return tuple(topic.split("/")[2] for topic in topics if topic.endswith("/image"))


def images_of(found: Scan, camera: str) -> Images:
    """Return the images of one camera in a scan of the cameras, none for an unknown one."""
    stored = {
        sequence_of(record): stored_image(record, compressed)
        for topic, compressed in (
            (f"/camera/{camera}/image_raw", False),
            (f"/camera/{camera}/image", True),
        )
        if (channel := found.channel_id(topic)) is not None
        for record in found.records(channel)
    }
    stamp = _messages(found, f"/camera/{camera}/device", rows.stamp_layout(camera_frame(camera)))
    stamp = stamp[np.isin(stamp["record"]["sequence"], list(stored))]
    return Images(
        counter=stamp["body"]["counter"],
        device_time_s=stamp["body"]["device_time_s"],
        host_time_ns=_host_time_ns(stamp),
        backlog=stamp["body"]["status"],
        _stored=[stored[sequence] for sequence in stamp["record"]["sequence"].tolist()],
    )


def open_recording(folder: Path) -> Recording:
    """Open a session; one that was cut off is recovered first, and ``info.problems`` tells so.

    Raises
    ------
    RecordingError
        It is being recorded, or it is no session.
    """
    if read_info(folder).state == "recording":
        recover_session(folder)
    return Recording(folder)


def _messages(found: Scan, topic: str, layout: CdrLayout) -> NDArray[np.void]:
    """Return all messages of a topic as an array with the fields ``record`` and ``body``."""
    dtype = np.dtype([("record", RECORD), ("body", layout.dtype)])
    channel = found.channel_id(topic)
    try:
        records = b"" if channel is None else found.equal_records(channel, dtype.itemsize)
    except ValueError as error:
        raise RecordingError(f"{topic}: {error}; another program wrote this file") from error
    return np.frombuffer(records, dtype=dtype)


def _host_time_ns(messages: NDArray[np.void]) -> IntArray:
    return messages["record"]["log_time"].astype(np.int64)
