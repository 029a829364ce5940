"""Samples as rows of complete MCAP message records.

One sample of a device is one row: its message records one behind the other, so that a chunk that was cut anywhere
ends with whole rows but for its last one. Every record carries the host receive stamp as log and publish time, and
the sample's place in the stream as sequence number. Nothing is altered: the clocks are mapped when a recording is
read.
"""

import json
from collections.abc import Mapping

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from daq.recording.mcap.chunks import Placed, Rows
from daq.recording.messages.cdr import CdrLayout
from daq.recording.messages.codec import EncodedImage
from daq.vision.camera_model import PinholeCamera
from robot_drivers.protocols import JOINT_COUNTS, FloatArray, IntArray, PoseBlock, WrenchBlock

RECORD = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
    ]
)
_LENGTH_COUNTS_FROM = 9
_NO_FIELDS: Mapping[str, tuple[np.dtype[np.generic], int]] = {}


def wrench_layout(frame_id: str) -> CdrLayout:
    """Return the layout of ``WrenchStamped``: ``wrench`` (6,) N and N·m."""
    return CdrLayout().header(frame_id).add("wrench", "<f8", 6)


def pose_layout(frame_id: str) -> CdrLayout:
    """Return the layout of ``PoseStamped``: ``position`` (3,) m, ``quaternion_xyzw`` (4,)."""
    return CdrLayout().header(frame_id).add("position", "<f8", 3).add("quaternion_xyzw", "<f8", 4)


def joints_layout(frame_id: str, joints: int) -> CdrLayout:
    """Return the layout of ``JointState`` with so many positions, rad, and neither velocities nor efforts."""
    layout = CdrLayout().header(frame_id).length(joints)
    for number in range(1, joints + 1):
        layout.string(f"joint_{number}")
    return layout.length(joints).add("joints", "<f8", joints).length(0).length(0)


def stamp_layout(frame_id: str) -> CdrLayout:
    """Return the layout of ``DeviceStamp``."""
    return (
        CdrLayout()
        .header(frame_id)
        .add("counter", "<i8")
        .add("device_time_s", "<f8")
        .add("status", "<i8")
        .add("usable", "u1")
    )


def image_layout(frame_id: str, image_format: str) -> CdrLayout:
    """Return the layout of ``CompressedImage`` up to and with the ``size`` of its data, which follows."""
    return CdrLayout().header(frame_id).string(image_format).add("size", "<u4")


def raw_image_layout(frame_id: str, encoding: str) -> CdrLayout:
    """Return the layout of ``Image`` up to and with the ``size`` of its data, which follows."""
    layout = CdrLayout().header(frame_id).add("height", "<u4").add("width", "<u4").string(encoding)
    return layout.add("big_endian", "u1").add("step", "<u4").add("size", "<u4")


def camera_info_layout(frame_id: str) -> CdrLayout:
    """Return the layout of ``CameraInfo`` with five coefficients of distortion, all of the sensor, not binned."""
    layout = (
        CdrLayout().header(frame_id).add("height", "<u4").add("width", "<u4").string("plumb_bob").length(5)
    )
    layout.add("D", "<f8", 5).add("K", "<f8", 9).add("R", "<f8", 9).add("P", "<f8", 12)
    return layout.add("binning", "<u4", 2).add("region", "<u4", 4).add("do_rectify", "u1")


class WrenchRows:
    """Packs :class:`WrenchBlock` into ``WrenchStamped`` + ``DeviceStamp`` records of two channels."""

    def __init__(self, wrench_channel: int, stamp_channel: int, frame_id: str) -> None:
        self._template = _row(
            wrench=(wrench_channel, wrench_layout(frame_id)), stamp=(stamp_channel, stamp_layout(frame_id))
        )

    def pack(self, block: WrenchBlock, first_sequence: int) -> Rows:
        """Return the records of all samples of a block."""
        rows = _stamped_rows(self._template, block.host_time_ns, first_sequence)
        rows["wrench_body"]["wrench"] = block.wrench
        _fill_stamp(rows["stamp_body"], block.counter, block.device_time_s, block.status, block.usable)
        return placed(rows)


class PoseRows:
    """Packs :class:`PoseBlock` into ``PoseStamped`` + ``JointState`` + ``DeviceStamp`` records."""

    def __init__(self, pose_channel: int, joints_channel: int, stamp_channel: int, frame_id: str) -> None:
        self._templates = {
            joints: _row(
                pose=(pose_channel, pose_layout(frame_id)),
                joints=(joints_channel, joints_layout(frame_id, joints)),
                stamp=(stamp_channel, stamp_layout(frame_id)),
            )
            for joints in JOINT_COUNTS
        }

    def pack(self, block: PoseBlock, first_sequence: int) -> Rows:
        """Return the records of all samples of a block, of a robot with six or seven joints."""
        template = self._templates[block.joints.shape[1]]
        rows = _stamped_rows(template, block.host_time_ns, first_sequence)
        rows["pose_body"]["position"] = block.position
        rows["pose_body"]["quaternion_xyzw"] = np.roll(block.quaternion_wxyz, -1, axis=1)
        rows["joints_body"]["joints"] = block.joints
        moving = block.moving.astype(np.int64)
        usable = np.ones(len(block), dtype=np.bool_)
        _fill_stamp(rows["stamp_body"], block.counter, block.device_time_s, moving, usable)
        return placed(rows)


class FrameRows:
    """Packs images into ``DeviceStamp`` + ``CompressedImage``, or ``Image`` where they stayed raw."""

    def __init__(self, image_channel: int, raw_channel: int, stamp_channel: int, frame_id: str) -> None:
        self._image_channel = image_channel
        self._raw_channel = raw_channel
        self._stamp_channel = stamp_channel
        self._frame_id = frame_id

    def pack(self, encoded: EncodedImage, sequence: int, backlog: int = 0) -> Rows:
        """Return the records of one image; ``backlog`` images waited when this one was encoded."""
        frame = encoded.frame
        rows = _stamped_rows(self._template(encoded), np.array([frame.host_time_ns]), sequence)
        counter = -1 if frame.counter is None else frame.counter
        device_time_s = np.nan if frame.device_time_s is None else frame.device_time_s
        _fill_stamp(
            rows["stamp_body"],
            np.array([counter]),
            np.array([device_time_s]),
            np.array([backlog]),
            np.array([True]),
        )
        if encoded.compression is None:
            height, width = encoded.pixels.shape[:2]
            rows["image_body"]["height"], rows["image_body"]["width"] = height, width
            rows["image_body"]["step"] = encoded.pixels.nbytes // height
        rows["image_body"]["size"] = encoded.data.nbytes
        rows["image_record"]["length"] += encoded.data.nbytes
        records = placed(rows)
        return Rows((*records.parts, encoded.data), records.placed)

    def _template(self, encoded: EncodedImage) -> NDArray[np.void]:
        stamp = (self._stamp_channel, stamp_layout(self._frame_id))
        if encoded.compression is None:
            layout = raw_image_layout(self._frame_id, encoded.pixel_format)
            return _row(stamp=stamp, image=(self._raw_channel, layout))
        image_format = f"{encoded.pixel_format}; {encoded.compression}"
        return _row(stamp=stamp, image=(self._image_channel, image_layout(self._frame_id, image_format)))


def camera_info_row(channel: int, frame_id: str, model: PinholeCamera, host_time_ns: int) -> Rows:
    """Return the record of a camera's intrinsics; its projection is its own, not that of a rectified pair."""
    rows = _stamped_rows(_row(info=(channel, camera_info_layout(frame_id))), np.array([host_time_ns]), 0)
    body = rows["info_body"]
    body["height"], body["width"] = model.height, model.width
    body["D"], body["K"] = model.distortion, model.intrinsic_matrix.reshape(-1)
    body["R"] = np.eye(3).reshape(-1)
    body["P"] = np.column_stack([model.intrinsic_matrix, np.zeros(3)]).reshape(-1)
    return placed(rows)


def message_rows(channel: int, layout: CdrLayout, time_ns: IntArray) -> NDArray[np.void]:
    """Return messages of one channel, stamped and numbered, with the other fields of ``message_body`` still zero."""
    return _stamped_rows(_row(message=(channel, layout)), time_ns, 0)


class EventRows:
    """Packs events into JSON records."""

    def __init__(self, channel: int) -> None:
        self._channel = channel

    def pack(self, event: Mapping[str, object], host_time_ns: int, sequence: int) -> Rows:
        """Return the record of one event."""
        body = json.dumps(event, ensure_ascii=False).encode()
        record = _record(self._channel, len(body))
        record["sequence"] = sequence
        record["log_time"] = record["publish_time"] = host_time_ns
        where = Placed(self._channel, np.array([host_time_ns]), np.array([0]))
        return Rows((record.tobytes() + body,), (where,))


def _row(**messages: tuple[int, CdrLayout]) -> NDArray[np.void]:
    """Return the template () of a row: for each message its ``<name>_record`` and its ``<name>_body``."""
    fields: list[tuple[str, np.dtype[np.void]]] = []
    template = b""
    for name, (channel, layout) in messages.items():
        fields += [(f"{name}_record", RECORD), (f"{name}_body", layout.dtype)]
        template += _record(channel, len(layout.template)).tobytes() + layout.template
    return np.frombuffer(template, np.dtype(fields))[0]


def _record(channel: int, body_size: int) -> NDArray[np.void]:
    record = np.zeros((), dtype=RECORD)
    record["opcode"] = Opcode.MESSAGE
    record["length"] = RECORD.itemsize - _LENGTH_COUNTS_FROM + body_size
    record["channel"] = channel
    return record


def _stamped_rows(template: NDArray[np.void], host_time_ns: IntArray, first: int) -> NDArray[np.void]:
    count = len(host_time_ns)
    # repeated as bytes: numpy copies the fields of a record, not the constants between them
    rows = np.frombuffer(bytearray(template.tobytes() * count), template.dtype)
    sequence = (first + np.arange(count)) % 2**32
    seconds, nanoseconds = np.divmod(host_time_ns, 10**9)
    for name in template.dtype.names or ():
        if name.endswith("_record"):
            rows[name]["sequence"] = sequence
            rows[name]["log_time"] = rows[name]["publish_time"] = host_time_ns
        else:
            rows[name]["sec"] = seconds
            rows[name]["nanosec"] = nanoseconds
    return rows


def placed(rows: NDArray[np.void]) -> Rows:
    """Return the bytes of rows, and where the messages of each channel lie in them."""
    starts = np.arange(len(rows)) * rows.dtype.itemsize
    found = []
    for name, (_, place, *_) in (rows.dtype.fields or _NO_FIELDS).items():
        if name.endswith("_record"):
            record = rows[name]
            times = record["log_time"].astype(np.int64)
            found.append(Placed(int(record["channel"][0]), times, starts + place))
    return Rows((rows.tobytes(),), tuple(found))


def _fill_stamp(
    body: NDArray[np.void],
    counter: IntArray,
    device_time_s: FloatArray,
    status: IntArray,
    usable: NDArray[np.bool_],
) -> None:
    body["counter"] = counter
    body["device_time_s"] = device_time_s
    body["status"] = status
    body["usable"] = usable
