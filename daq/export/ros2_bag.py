"""A recording as a rosbag2 folder for readers that know ROS 2 alone: standard messages, stamped with the wall clock.

A session's own files are stamped with the host's monotonic clock, which all its streams share and nobody sets, and have
topics that such readers do not know. Here ``header.stamp`` and ``log_time`` are Unix time: the receive stamps, moved by
the difference of both clocks when recording began. Left out are the events, the stamps of the devices, and samples that
the force sensor forbids to use. Images are PNG; a mosaic is one image, not its four planes. Depth is raw, in metres.
Transforms tell where the frames of the messages are: ``/tf`` the tool in the robot's base, ``/tf_static`` what the rig
file states.

Sources: REP 118, "Depth Images": 32FC1 in m, NaN where it is not known, in the pixels and the frame of its camera_info.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.errors import RecordingError
from daq.export.ros2_transforms import KEPT_FOR_LATER, TOOL_FRAME, transform_rows
from daq.progress import Progress
from daq.recording.folder import RIG_FILE
from daq.recording.layout import FORCE_FRAME, ROBOT_FRAME, camera_frame
from daq.recording.mcap import schemas
from daq.recording.mcap.chunks import Rows
from daq.recording.mcap.log import McapLog
from daq.recording.mcap.schemas import Schema
from daq.recording.messages import rows
from daq.recording.messages.rows import message_rows, placed
from daq.recording.reader import Recording
from daq.recording.recorded_depth import RecordedDepth
from daq.recording.sealing.seal import seal
from daq.recording.stored_streams import Images
from daq.rig import read_rig
from robot_drivers.protocols import IntArray

_BAG_FILE = "recording_0.mcap"
_BAG_VERSION = 5
_CHUNK_NS = 10**9


@dataclass(frozen=True, slots=True)
class Ros2Bag:
    """What was written: messages by topic, and how many samples the force sensor forbids to use."""

    messages: dict[str, int]
    unusable: int


@dataclass(frozen=True, slots=True)
class _Stream:
    """Messages of one topic, their times (n,), ns, and what is asked of their delivery; empty for the usual."""

    topic: str
    schema: Schema
    time_ns: IntArray
    messages: NDArray[np.void] | Images | RecordedDepth
    qos: str = ""


def write_ros2_bag(recording: Recording, folder: Path, progress: Progress) -> Ros2Bag:
    """Write a recording into a new folder.

    Raises
    ------
    RecordingError
        It holds no sample that could be written.
    """
    force = recording.force
    streams = [stream for stream in _streams(recording) if len(stream.time_ns)]
    if not streams:
        raise RecordingError(f"{recording.folder}: holds no sample; there is nothing to export")
    folder.mkdir()
    begin = min(int(stream.time_ns.min()) for stream in streams)
    end = max(int(stream.time_ns.max()) for stream in streams)
    chunks = (end - begin) // _CHUNK_NS + 1
    with McapLog(folder / _BAG_FILE) as log:
        channels = [
            log.add_channel(stream.topic, stream.schema, {"offered_qos_profiles": stream.qos})
            for stream in streams
        ]
        for number in range(chunks):
            progress("writing the bag", number, chunks)
            first = begin + number * _CHUNK_NS
            batch = [
                packed
                for stream, channel in zip(streams, channels, strict=True)
                for packed in _packed(stream, channel, first, first + _CHUNK_NS)
            ]
            if batch:
                log.append(*batch)
    seal(folder / _BAG_FILE)
    counts = {stream.topic: len(stream.time_ns) for stream in streams}
    (folder / "metadata.yaml").write_text(_metadata(streams, begin, end), encoding="utf-8")
    return Ros2Bag(counts, int(np.sum(~force.usable)))


def _streams(recording: Recording) -> Iterator[_Stream]:
    anchor = recording.info.clock_anchor
    shift_ns = anchor.wall_time_ns - anchor.host_time_ns
    force, robot = recording.force, recording.robot
    time_ns = force.host_time_ns[force.usable] + shift_ns
    wrench = message_rows(0, rows.wrench_layout(FORCE_FRAME), time_ns)
    wrench["message_body"]["wrench"] = force.wrench[force.usable]
    yield _Stream("/force/wrench", schemas.WRENCH, time_ns, wrench)
    time_ns = robot.host_time_ns + shift_ns
    pose = message_rows(0, rows.pose_layout(ROBOT_FRAME), time_ns)
    pose["message_body"]["position"] = robot.position
    pose["message_body"]["quaternion_xyzw"] = np.roll(robot.quaternion_wxyz, -1, axis=1)
    yield _Stream("/robot/pose", schemas.POSE, time_ns, pose)
    moved = transform_rows(
        ((ROBOT_FRAME, TOOL_FRAME),), time_ns, robot.position[:, None], robot.quaternion_wxyz[:, None]
    )
    yield _Stream("/tf", schemas.TRANSFORMS, time_ns, moved)
    yield from _fixed(recording, time_ns[:1])
    joints = message_rows(0, rows.joints_layout(ROBOT_FRAME, robot.joints.shape[1]), time_ns)
    joints["message_body"]["joints"] = robot.joints
    yield _Stream("/robot/joints", schemas.JOINT_STATE, time_ns, joints)
    for camera in recording.cameras:
        images = recording.images(camera)
        time_ns = images.host_time_ns + shift_ns
        info = recording.camera_info(camera)[:1]
        if len(info) and len(time_ns):
            described = message_rows(0, rows.camera_info_layout(camera_frame(camera)), time_ns[:1])
            for name in set(info.dtype.names or ()) - {"sec", "nanosec"}:
                described["message_body"][name] = info[name]
            yield _Stream(f"/camera/{camera}/camera_info", schemas.CAMERA_INFO, time_ns[:1], described)
        yield _Stream(f"/camera/{camera}/image", schemas.COMPRESSED_IMAGE, time_ns, images)
        depth = RecordedDepth.of(recording, camera)
        time_ns = depth.images.host_time_ns + shift_ns
        if depth.scale is not None:
            yield _Stream(f"/camera/{camera}/depth/image_raw", schemas.IMAGE, time_ns, depth)


def _fixed(recording: Recording, time_ns: IntArray) -> Iterator[_Stream]:
    """Yield the transforms that the rig file states, as one message of the first instant."""
    if not (recording.folder / RIG_FILE).is_file() or not len(time_ns):
        return
    frames = read_rig(recording.folder / RIG_FILE, to_connect=False).frames
    links = ((ROBOT_FRAME, "tissue"), (TOOL_FRAME, "gripper"), ("gripper", FORCE_FRAME))
    poses = [one.pose for one in (frames.T_base_tissue, frames.T_tool_gripper, frames.T_gripper_sensor)]
    places, turns = (
        np.array([getattr(pose, name) for pose in poses])[None] for name in ("position", "quaternion_wxyz")
    )
    message = transform_rows(links, time_ns, places, turns)
    yield _Stream("/tf_static", schemas.TRANSFORMS, time_ns, message, KEPT_FOR_LATER)


def _packed(stream: _Stream, channel: int, begin_ns: int, end_ns: int) -> Iterator[Rows]:
    """Yield the records of the messages from one instant to before another."""
    ascending = np.maximum.accumulate(stream.time_ns)
    first, last = np.searchsorted(ascending, [begin_ns, end_ns]).tolist()
    if first == last:
        return
    if isinstance(stream.messages, Images):
        for index in range(first, last):
            yield _image(stream, stream.messages, channel, index)
        return
    if isinstance(stream.messages, RecordedDepth):
        for index in range(first, last):
            yield _depth(stream, stream.messages, channel, index)
        return
    messages = stream.messages[first:last]
    messages["message_record"]["channel"] = channel
    messages["message_record"]["sequence"] = np.arange(first, last)
    yield placed(messages)


def _image(stream: _Stream, images: Images, channel: int, index: int) -> Rows:
    data = images.png(index)
    frame = camera_frame(stream.topic.split("/")[2])
    layout = rows.image_layout(frame, f"{images.pixel_format(index)}; png compressed")
    return _followed(message_rows(channel, layout, stream.time_ns[index : index + 1]), index, data)


def _depth(stream: _Stream, depth: RecordedDepth, channel: int, index: int) -> Rows:
    metres = depth.metres(index).astype("<f4")
    height, width = metres.shape
    layout = rows.raw_image_layout(camera_frame(stream.topic.split("/")[2]), "32FC1")
    message = message_rows(channel, layout, stream.time_ns[index : index + 1])
    for name, value in (("height", height), ("width", width), ("step", 4 * width)):
        message["message_body"][name] = value
    return _followed(message, index, metres.reshape(-1).view(np.uint8).data)


def _followed(message: NDArray[np.void], index: int, data: memoryview) -> Rows:
    """Return a message whose body ends with the data of an image."""
    message["message_record"]["sequence"] = index
    message["message_record"]["length"] += data.nbytes
    message["message_body"]["size"] = data.nbytes
    head = placed(message)
    return Rows((*head.parts, data), head.placed)


def _metadata(streams: Sequence[_Stream], begin_ns: int, end_ns: int) -> str:
    """Return the description of a bag; JSON is YAML."""
    total = sum(len(stream.time_ns) for stream in streams)
    times = {
        "starting_time": {"nanoseconds_since_epoch": begin_ns},
        "duration": {"nanoseconds": end_ns - begin_ns},
        "message_count": total,
    }
    topics = [
        {
            "topic_metadata": {
                "name": stream.topic,
                "type": stream.schema.name,
                "serialization_format": "cdr",
                "offered_qos_profiles": stream.qos,
            },
            "message_count": len(stream.time_ns),
        }
        for stream in streams
    ]
    told = {
        "version": _BAG_VERSION,
        "storage_identifier": "mcap",
        "relative_file_paths": [_BAG_FILE],
        **times,
        "topics_with_message_count": topics,
        "compression_format": "",
        "compression_mode": "",
        "files": [{"path": _BAG_FILE, **times}],
    }
    return json.dumps({"rosbag2_bagfile_information": told}, indent=2) + "\n"
