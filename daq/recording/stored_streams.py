"""The streams in the files of a recording, as arrays.

The records of one sample carry its number in the stream. They are brought together by it, in its order, whatever order
the chunks are in.
"""

import json
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import RecordingError
from daq.recording.layout import EVENTS, FORCE_FRAME, ROBOT_FRAME, camera_frame
from daq.recording.messages import codec, rows
from daq.recording.messages.cdr import CdrLayout
from daq.recording.messages.rows import RECORD
from daq.recording.messages.stored_images import StoredImage, sequence_of, stored_image
from daq.recording.scanning.segments import Scan
from robot_drivers.protocols import JOINT_COUNTS, FloatArray, IntArray, PoseBlock, WrenchBlock

_NO_DATA = memoryview(b"")
_IMAGES = (["image"], ["image_raw"], ["device"])


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

    def depth(self, index: int) -> NDArray[np.uint16]:
        """Return the counts of one image of depth, (height, width)."""
        counts = self._stored[index].counts()
        if counts is None:
            raise RecordingError(
                f"depth image {index} of the recording cannot be decoded; verify the checksums"
            )
        return counts

    def pixel_format(self, index: int) -> str:
        """Return ``"mono8"``, ``"bgr8"`` or ``"bayer_rggb8"`` and its siblings."""
        return self._stored[index].pixel_format

    def png(self, index: int) -> memoryview:
        """Return one image as every reader of PNG takes it; a mosaic is one, not its four planes."""
        stored = self._stored[index]
        if stored.compression is None or stored.compression.endswith(codec.PLANES):
            return codec.as_png(self.image(index))
        return stored.data

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


def events_of(found: Scan) -> list[Event]:
    """Return the events of a scan of the signals in the order of their recording."""
    events: dict[int, Event] = {}
    records = found.records(EVENTS)
    numbers = [sequence_of(record) for record in records]
    for number, record in zip(numbers if any(numbers) else range(len(records)), records, strict=True):
        time_ns = int(np.frombuffer(record, RECORD, 1)["log_time"][0])
        details = json.loads(bytes(record[RECORD.itemsize :]))
        events[number] = Event(time_ns, details.pop("event"), details)
    return [event for _, event in sorted(events.items())]


def force_of(found: Scan) -> WrenchBlock:
    """Return the force stream of a scan of the signals, sensor frame."""
    wrench, stamp = _samples(
        messages_of(found, "/force/wrench", rows.wrench_layout(FORCE_FRAME)),
        messages_of(found, "/force/device", rows.stamp_layout(FORCE_FRAME)),
    )
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
    poses, joints, stamp = _samples(
        messages_of(found, "/robot/pose", rows.pose_layout(ROBOT_FRAME)),
        _joints_of(found),
        messages_of(found, "/robot/device", rows.stamp_layout(ROBOT_FRAME)),
    )
    return PoseBlock(
        counter=stamp["body"]["counter"],
        device_time_s=stamp["body"]["device_time_s"],
        host_time_ns=_host_time_ns(stamp),
        position=poses["body"]["position"],
        quaternion_wxyz=np.roll(poses["body"]["quaternion_xyzw"], 1, axis=1),
        joints=joints["body"]["joints"],
        moving=stamp["body"]["status"] != 0,
    )


def _joints_of(found: Scan) -> NDArray[np.void]:
    """Return the messages of the robot's joints, as many as it has."""
    failures = []
    for joints in JOINT_COUNTS:
        try:
            return messages_of(found, "/robot/joints", rows.joints_layout(ROBOT_FRAME, joints))
        except RecordingError as error:
            failures.append(error)
    raise failures[0]


def cameras_of(found: Scan) -> tuple[str, ...]:
    """Return the names of the cameras that a scan knows of."""
    topics = (channel.topic.split("/") for channel in found.channels.values())
    return tuple(dict.fromkeys(topic[2] for topic in topics if topic[1] == "camera" and topic[3:] in _IMAGES))


def images_of(found: Scan, camera: str) -> Images:
    """Return the images of one camera in a scan of the cameras, none for an unknown one."""
    records = [
        (record, compressed)
        for topic, compressed in (
            (f"/camera/{camera}/image_raw", False),
            (f"/camera/{camera}/image", True),
        )
        for record in found.records(topic)
    ]
    stamp = _in_order(messages_of(found, f"/camera/{camera}/device", rows.stamp_layout(camera_frame(camera))))
    key = "sequence" if _numbered(stamp) else "log_time"
    stored = {
        int(np.frombuffer(record, RECORD, 1)[key][0]): stored_image(record, compressed)
        for record, compressed in records
    }
    stamp = stamp[np.isin(stamp["record"][key], list(stored))]
    return Images(
        counter=stamp["body"]["counter"],
        device_time_s=stamp["body"]["device_time_s"],
        host_time_ns=_host_time_ns(stamp),
        backlog=stamp["body"]["status"],
        _stored=[stored[number] for number in stamp["record"][key].tolist()],
    )


def messages_of(found: Scan, topic: str, layout: CdrLayout) -> NDArray[np.void]:
    """Return all messages of a topic as an array with the fields ``record`` and ``body``, in the order of the file.

    Raises
    ------
    RecordingError
        They are of another layout.
    """
    dtype = np.dtype([("record", RECORD), ("body", layout.dtype)])
    try:
        records = found.equal_records(topic, dtype.itemsize)
    except ValueError as error:
        raise RecordingError(
            f"{topic}: {error}, which the messages of a session have; the file is of profile {found.profile!r} by "
            f"{found.library!r}, and only sessions that this software recorded are read"
        ) from error
    return np.frombuffer(records, dtype=dtype)


def _numbered(messages: NDArray[np.void]) -> bool:
    """Tell whether messages carry their numbers, which some programs leave out when they write a file again."""
    return len(messages) < 2 or bool(messages["record"]["sequence"].any())


def _in_order(messages: NDArray[np.void]) -> NDArray[np.void]:
    """Return messages in the order of their numbers, each once; most are so already."""
    numbers = messages["record"]["sequence"].astype(np.int64)
    if not _numbered(messages) or np.all(np.diff(numbers) > 0):
        return messages
    _, first = np.unique(numbers, return_index=True)
    return messages[first]


def _samples(*parts: NDArray[np.void]) -> list[NDArray[np.void]]:
    """Return of the parts of samples those whose sample is whole, all in its order."""
    if not all(_numbered(part) for part in parts):
        shortest = min(len(part) for part in parts)
        return [part[:shortest] for part in parts]
    ordered = [_in_order(part) for part in parts]
    numbers = [part["record"]["sequence"] for part in ordered]
    if all(np.array_equal(numbers[0], others) for others in numbers[1:]):
        return ordered
    whole = reduce(np.intersect1d, numbers)
    return [part[np.isin(one, whole)] for part, one in zip(ordered, numbers, strict=True)]


def _host_time_ns(messages: NDArray[np.void]) -> IntArray:
    return messages["record"]["log_time"].astype(np.int64)
