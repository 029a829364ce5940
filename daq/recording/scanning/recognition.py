"""Channels recognised by their messages: what a recorder of this software writes names its stream itself.

Declarations stand once in a file, without a checksum of their own. The messages of a chunk whose checksum agrees
carry frame and layout, which no two topics share, and so tell the topic where its declaration is lost or altered.
"""

import json
import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from mcap.records import Channel
from mcap.records import Schema as SchemaRecord

from daq.recording.layout import EVENTS, FORCE_FRAME, ROBOT_FRAME
from daq.recording.mcap import schemas
from daq.recording.mcap.schemas import Schema
from daq.recording.messages import rows
from daq.recording.messages.cdr import ENCAPSULATION, CdrLayout
from daq.recording.messages.rows import RECORD
from daq.recording.messages.stored_images import Fields
from daq.recording.scanning.segments import Scan, Segment
from robot_drivers.protocols import JOINT_COUNTS

_CAMERA_FRAME = "camera_"
_LENGTH_COUNTS_FROM = 9
_NO_SIZES: Mapping[int, str] = {}
_ENCODING = re.compile(r"(mono|bgr|rgb|bayer_)\w+(; png compressed( planes)?)?")
_TOPIC = re.compile(
    r"/events|/force/(wrench|device)|/robot/(pose|joints|device)"
    r"|/camera/[^/]+(/depth)?/(image|image_raw|device|camera_info)"
)
_SCHEMAS_BY_END: Mapping[str, Schema] = {
    "events": schemas.EVENT,
    "wrench": schemas.WRENCH,
    "pose": schemas.POSE,
    "joints": schemas.JOINT_STATE,
    "device": schemas.DEVICE_STAMP,
    "image": schemas.COMPRESSED_IMAGE,
    "image_raw": schemas.IMAGE,
    "camera_info": schemas.CAMERA_INFO,
}


def is_own_topic(topic: str) -> bool:
    """Tell whether a recorder writes messages of this topic."""
    return _TOPIC.fullmatch(topic) is not None


def topic_of(body: memoryview) -> str | None:
    """Return the topic of a message by its body, None where this software writes no such message."""
    try:
        if body[:4] != ENCAPSULATION:
            return EVENTS if isinstance(json.loads(bytes(body)), dict) else None
        frame = Fields(body).string()
        if frame == FORCE_FRAME:
            return _by_layout(
                body,
                {
                    "/force/wrench": rows.wrench_layout(frame),
                    "/force/device": rows.stamp_layout(frame),
                },
            )
        if frame == ROBOT_FRAME:
            return _by_layout(
                body,
                {
                    "/robot/pose": rows.pose_layout(frame),
                    "/robot/device": rows.stamp_layout(frame),
                },
                {
                    rows.joints_layout(frame, joints).dtype.itemsize: "/robot/joints"
                    for joints in JOINT_COUNTS
                },
            )
        if frame.startswith(_CAMERA_FRAME):
            kind = _camera_message(body, frame)
            return f"/camera/{frame.removeprefix(_CAMERA_FRAME)}/{kind}" if kind else None
    except (ValueError, struct.error, LookupError, RecursionError):
        pass
    return None


def _by_layout(
    body: memoryview, layouts: Mapping[str, CdrLayout], further: Mapping[int, str] = _NO_SIZES
) -> str | None:
    """Return the topic of a message by its size: that of a layout, or one of the further sizes."""
    sizes = {layout.dtype.itemsize: topic for topic, layout in layouts.items()}
    return sizes.get(len(body)) or further.get(len(body))


def _camera_message(body: memoryview, frame: str) -> str | None:
    if len(body) == rows.camera_info_layout(frame).dtype.itemsize and b"plumb_bob\0" in bytes(body):
        return "camera_info"
    fields = Fields(body)
    fields.string()
    if _is_text(fields, body):
        return "image"
    fields = Fields(body)
    fields.string()
    fields.uint32()
    fields.uint32()
    if _is_text(fields, body):
        return "image_raw"
    return "device" if len(body) == rows.stamp_layout(frame).dtype.itemsize else None


def _is_text(fields: Fields, body: memoryview) -> bool:
    """Tell whether the name of an encoding of images comes next."""
    place = fields.position + -(fields.position - len(ENCAPSULATION)) % 4
    length = int.from_bytes(body[place : place + 4], "little")
    text = bytes(body[place + 4 : place + 4 + length])
    return 0 < length <= 64 and _ENCODING.fullmatch(text[:-1].decode("ascii", "replace")) is not None


@dataclass(frozen=True, slots=True)
class Declared:
    """Declarations that a checksum agrees with, by id."""

    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, SchemaRecord] = field(default_factory=dict)


def recognise(found: Scan, trusted: Declared) -> None:
    """Correct the channels and schemas of a scan by its messages, and note what was corrected."""
    declared = {**found.channels, **trusted.channels}
    found.schemas.update(trusted.schemas)
    channels: dict[int, Channel] = {}
    for key in sorted({key for segment in found.segments for key in segment.offsets}):
        topic = topic_of(_first_body(found.segments, key))
        before = declared.get(key)
        if topic is None:
            channels[key] = before or _undeclared(key)
            if before is None:
                found.notes.append(
                    f"channel {key} is declared nowhere and not known by its messages; kept as {channels[key].topic}"
                )
        elif before is not None and _fits(found, before, topic, trusted):
            channels[key] = before
        else:
            channels[key] = _own(found, key, topic)
            what = "lost" if before is None else "damaged"
            found.notes.append(
                f"the declaration of channel {key} is {what}; its messages are those of {topic}"
            )
    for key, channel in declared.items():
        if key not in channels and (key in trusted.channels or is_own_topic(channel.topic)):
            has_schema = not channel.schema_id or channel.schema_id in found.schemas
            own = has_schema or not is_own_topic(channel.topic)
            channels[key] = channel if own else _own(found, key, channel.topic)
    found.channels = dict(sorted(channels.items()))


def _fits(found: Scan, channel: Channel, topic: str, trusted: Declared) -> bool:
    """Tell whether a declaration is right for a topic: with a checksum, or as this software writes it."""
    if channel.topic != topic:
        return False
    if channel.id in trusted.channels:
        return not channel.schema_id or channel.schema_id in found.schemas
    schema = _SCHEMAS_BY_END[topic.rpartition("/")[2]]
    if channel.message_encoding != schema.message_encoding:
        return False
    record = found.schemas.get(channel.schema_id)
    if record is None or not schema.name:
        return not schema.name
    return (record.name, record.encoding, record.data) == (schema.name, schema.encoding, schema.text.encode())


def _own(found: Scan, key: int, topic: str) -> Channel:
    """Return the channel that a recorder declares for a topic, and see to it that its schema is there."""
    schema = _SCHEMAS_BY_END[topic.rpartition("/")[2]]
    return Channel(
        id=key,
        topic=topic,
        message_encoding=schema.message_encoding,
        metadata={},
        schema_id=_schema_id(found, schema) if schema.name else 0,
    )


def _schema_id(found: Scan, schema: Schema) -> int:
    data = schema.text.encode()
    for key, record in found.schemas.items():
        if (record.name, record.encoding, record.data) == (schema.name, schema.encoding, data):
            return key
    key = max([0, *found.schemas]) + 1
    found.schemas[key] = SchemaRecord(id=key, name=schema.name, encoding=schema.encoding, data=data)
    return key


def _undeclared(key: int) -> Channel:
    return Channel(id=key, topic=f"/undeclared_{key}", message_encoding="", metadata={}, schema_id=0)


def _first_body(segments: Sequence[Segment], key: int) -> memoryview:
    segment = next(segment for segment in segments if key in segment.offsets)
    offset = int(segment.offsets[key][0])
    head = segment.heads(key)[0]
    return segment.data[offset + RECORD.itemsize : offset + _LENGTH_COUNTS_FROM + int(head["length"])]
