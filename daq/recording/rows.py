"""Samples as rows of complete MCAP message records.

One sample of a device is one row: its message records one behind the other, so that a file that was cut anywhere
ends with whole rows but for its last one. Every record carries the host receive stamp as log and publish time, and
the sample's place in the stream as sequence number. Nothing is altered: the clocks are mapped when a recording is
read.
"""

import json
from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from daq.recording.cdr import CdrLayout
from robot_drivers.protocols import FloatArray, Frame, IntArray, PoseBlock, WrenchBlock

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
_PNG = (
    cv2.IMWRITE_PNG_COMPRESSION, 1,
    cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE,
    cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_UP,
)  # fmt: skip


def wrench_layout(frame_id: str) -> CdrLayout:
    """Return the layout of ``WrenchStamped``: ``wrench`` (6,) N and N·m."""
    return CdrLayout().header(frame_id).add("wrench", "<f8", 6)


def pose_layout(frame_id: str) -> CdrLayout:
    """Return the layout of ``PoseStamped``: ``position`` (3,) m, ``quaternion_xyzw`` (4,)."""
    return CdrLayout().header(frame_id).add("position", "<f8", 3).add("quaternion_xyzw", "<f8", 4)


def joints_layout(frame_id: str) -> CdrLayout:
    """Return the layout of ``JointState`` with six positions, rad, and neither velocities nor efforts."""
    layout = CdrLayout().header(frame_id).length(6)
    for number in range(1, 7):
        layout.string(f"joint_{number}")
    return layout.length(6).add("joints", "<f8", 6).length(0).length(0)


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


class WrenchRows:
    """Packs :class:`WrenchBlock` into ``WrenchStamped`` + ``DeviceStamp`` records of two channels."""

    def __init__(self, wrench_channel: int, stamp_channel: int, frame_id: str) -> None:
        self._template = _row(
            wrench=(wrench_channel, wrench_layout(frame_id)), stamp=(stamp_channel, stamp_layout(frame_id))
        )

    def pack(self, block: WrenchBlock, first_sequence: int) -> bytes:
        """Return the records of all samples of a block."""
        rows = _stamped_rows(self._template, block.host_time_ns, first_sequence)
        rows["wrench_body"]["wrench"] = block.wrench
        _fill_stamp(rows["stamp_body"], block.counter, block.device_time_s, block.status, block.usable)
        return rows.tobytes()


class PoseRows:
    """Packs :class:`PoseBlock` into ``PoseStamped`` + ``JointState`` + ``DeviceStamp`` records."""

    def __init__(self, pose_channel: int, joints_channel: int, stamp_channel: int, frame_id: str) -> None:
        self._template = _row(
            pose=(pose_channel, pose_layout(frame_id)),
            joints=(joints_channel, joints_layout(frame_id)),
            stamp=(stamp_channel, stamp_layout(frame_id)),
        )

    def pack(self, block: PoseBlock, first_sequence: int) -> bytes:
        """Return the records of all samples of a block."""
        rows = _stamped_rows(self._template, block.host_time_ns, first_sequence)
        rows["pose_body"]["position"] = block.position
        rows["pose_body"]["quaternion_xyzw"] = np.roll(block.quaternion_wxyz, -1, axis=1)
        rows["joints_body"]["joints"] = block.joints
        moving = block.moving.astype(np.int64)
        usable = np.ones(len(block), dtype=np.bool_)
        _fill_stamp(rows["stamp_body"], block.counter, block.device_time_s, moving, usable)
        return rows.tobytes()


class FrameRows:
    """Packs images into ``DeviceStamp`` + ``CompressedImage`` (PNG, without loss) records."""

    def __init__(self, image_channel: int, stamp_channel: int, frame_id: str) -> None:
        self._image_channel = image_channel
        self._stamp_channel = stamp_channel
        self._frame_id = frame_id

    def pack(self, frames: Sequence[Frame], first_sequence: int) -> bytes:
        """Return the records of some images; compressing takes about 13 ms for each of 1288 × 964 mono pixels."""
        return b"".join(self._pack(frame, first_sequence + n) for n, frame in enumerate(frames))

    def _pack(self, frame: Frame, sequence: int) -> bytes:
        encoded = cv2.imencode(".png", frame.image, _PNG)[1].tobytes()
        image_format = f"{frame.pixel_format}; png compressed"
        template = _row(
            stamp=(self._stamp_channel, stamp_layout(self._frame_id)),
            image=(self._image_channel, image_layout(self._frame_id, image_format)),
        )
        rows = _stamped_rows(template, np.array([frame.host_time_ns]), sequence)
        counter = -1 if frame.counter is None else frame.counter
        device_time_s = np.nan if frame.device_time_s is None else frame.device_time_s
        _fill_stamp(
            rows["stamp_body"],
            np.array([counter]),
            np.array([device_time_s]),
            np.array([0]),
            np.array([True]),
        )
        rows["image_body"]["size"] = len(encoded)
        rows["image_record"]["length"] += len(encoded)
        return rows.tobytes() + encoded


class EventRows:
    """Packs events into JSON records."""

    def __init__(self, channel: int) -> None:
        self._channel = channel

    def pack(self, event: Mapping[str, object], host_time_ns: int, sequence: int) -> bytes:
        """Return the record of one event."""
        body = json.dumps(event, ensure_ascii=False).encode()
        record = _record(self._channel, len(body))
        record["sequence"] = sequence
        record["log_time"] = record["publish_time"] = host_time_ns
        return record.tobytes() + body


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
