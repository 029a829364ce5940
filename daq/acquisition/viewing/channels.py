"""What viewers are shown: force, pose, images and state as a client is told them, in standard messages of ROS 2."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from daq.acquisition.messages import Telemetry
from daq.acquisition.viewing.protocol import Channel
from daq.recording.layout import FORCE_FRAME, ROBOT_FRAME, camera_frame
from daq.recording.mcap import schemas
from daq.recording.mcap.schemas import Schema
from daq.recording.messages import rows
from daq.recording.messages.cdr import CdrLayout
from daq.recording.messages.rows import message_rows
from robot_drivers.protocols import FloatArray

Shown = tuple[str, int, bytes]
"""Topic, Unix time in ns, and the message."""

FORCE, POSE, STATE = "/force/wrench", "/robot/pose", "/state"
BEADS, ESTIMATE = "/tissue/beads", "/estimate"
_TISSUE_FRAME = "tissue"
_STATE_SCHEMA = {
    "type": "object",
    "properties": {
        "state": {"type": "string"},
        "step": {"type": "integer"},
        "steps": {"type": "integer"},
        "session": {"type": "string"},
        "held": {"type": "string"},
        "problems": {"type": "array", "items": {"type": "string"}},
        "lost": {"type": "object"},
    },
}
_ESTIMATE_SCHEMA = {
    "type": "object",
    "properties": {
        "step": {"type": "integer"},
        "parameters": {
            "type": "object",
            "additionalProperties": {
                "type": "object",
                "properties": {name: {"type": "number"} for name in ("value", "low", "high")},
            },
        },
    },
}
_QUALITY = (cv2.IMWRITE_JPEG_QUALITY, 80)


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """What a client has made of the measurements of a running session, to be shown as well.

    Attributes
    ----------
    time_ns : that it belongs to, host clock
    step : of the session, from 0
    beads : (m, 3) tissue frame, m; NaN where one is not seen
    parameters : value, and the ends of its 95 % interval, by the parameter's name, SI units
    """

    time_ns: int
    step: int
    beads: FloatArray
    parameters: Mapping[str, tuple[float, float, float]]


def image_topic(camera: str) -> str:
    """Return the topic of a camera's images, at a quarter of their size."""
    return f"/camera/{camera}/image"


def channels_of(cameras: tuple[str, ...]) -> tuple[Channel, ...]:
    """Return all channels of a rig with these cameras."""
    ros = {FORCE: schemas.WRENCH, POSE: schemas.POSE, BEADS: schemas.POSE_ARRAY}
    ros |= {image_topic(camera): schemas.COMPRESSED_IMAGE for camera in cameras}
    found = [
        _ros_channel(number, topic, schema) for number, (topic, schema) in enumerate(ros.items(), start=1)
    ]
    documents = ((STATE, "State", _STATE_SCHEMA), (ESTIMATE, "Estimate", _ESTIMATE_SCHEMA))
    for topic, name, schema in documents:
        found.append(Channel(len(found) + 1, topic, "json", name, "jsonschema", json.dumps(schema)))
    return tuple(found)


def shown(telemetry: Telemetry, shift_ns: int, wanted: frozenset[str]) -> Iterator[Shown]:
    """Yield the messages of what a client was told, of the wanted topics alone.

    Parameters
    ----------
    shift_ns : from the host's clock to Unix time
    """
    if FORCE in wanted:
        yield from _signal(
            FORCE, rows.wrench_layout(FORCE_FRAME), telemetry.force, shift_ns, {"wrench": slice(1, 7)}
        )
    if POSE in wanted:
        turned = telemetry.pose[:, [0, 1, 2, 3, 5, 6, 7, 4]]
        parts = {"position": slice(1, 4), "quaternion_xyzw": slice(4, 8)}
        yield from _signal(POSE, rows.pose_layout(ROBOT_FRAME), turned, shift_ns, parts)
    time_ns = telemetry.time_ns + shift_ns
    for camera, pixels in telemetry.images.items():
        if image_topic(camera) in wanted:
            yield image_topic(camera), time_ns, _image(camera, pixels, time_ns)
    if STATE in wanted:
        yield STATE, time_ns, _state(telemetry)


def shown_analysis(analysis: Analysis, shift_ns: int, wanted: frozenset[str]) -> Iterator[Shown]:
    """Yield the messages of what a client has made of the measurements, of the wanted topics alone."""
    time_ns = analysis.time_ns + shift_ns
    if BEADS in wanted:
        yield BEADS, time_ns, _beads(analysis.beads, time_ns)
    if ESTIMATE in wanted:
        parameters = {
            name: dict(zip(("value", "low", "high"), map(float, values), strict=True))
            for name, values in analysis.parameters.items()
        }
        yield ESTIMATE, time_ns, json.dumps({"step": analysis.step, "parameters": parameters}).encode()


def _ros_channel(number: int, topic: str, schema: Schema) -> Channel:
    return Channel(number, topic, schema.message_encoding, schema.name, schema.encoding, schema.text)


def _signal(
    topic: str, layout: CdrLayout, values: FloatArray, shift_ns: int, parts: Mapping[str, slice]
) -> Iterator[Shown]:
    """Yield a message for each row; its first column is the host's time, s."""
    time_ns = np.rint(values[:, 0] * 1e9).astype(np.int64) + shift_ns
    body = message_rows(0, layout, time_ns)["message_body"]
    for name, columns in parts.items():
        body[name] = values[:, columns]
    for place, stamp in enumerate(time_ns.tolist()):
        yield topic, stamp, body[place].tobytes()


def _beads(places: FloatArray, time_ns: int) -> bytes:
    """Return the beads as poses without a turn, in their order; the place of one that is not seen is NaN."""
    layout = CdrLayout().header(_TISSUE_FRAME).length(len(places))
    for number in range(len(places)):
        layout.add(f"position_{number}", "<f8", 3).add(f"quaternion_xyzw_{number}", "<f8", 4)
    body = message_rows(0, layout, np.array([time_ns]))["message_body"]
    for number, place in enumerate(places):
        body[f"position_{number}"] = place
        body[f"quaternion_xyzw_{number}"] = (0.0, 0.0, 0.0, 1.0)
    return bytes(body[0].tobytes())


def _image(camera: str, pixels: NDArray[np.uint8], time_ns: int) -> bytes:
    data = cv2.imencode(".jpg", np.ascontiguousarray(pixels), _QUALITY)[1]
    body = message_rows(0, rows.image_layout(camera_frame(camera), "jpeg"), np.array([time_ns]))[
        "message_body"
    ]
    body["size"] = data.nbytes
    return bytes(body[0].tobytes() + data.tobytes())


def _state(telemetry: Telemetry) -> bytes:
    told = {
        "state": telemetry.state,
        "step": telemetry.step,
        "steps": telemetry.steps,
        "session": "" if telemetry.session is None else telemetry.session.name,
        "held": telemetry.held,
        "problems": list(telemetry.problems),
        "lost": {name: one.lost for name, one in telemetry.counts.items()},
    }
    return json.dumps(told).encode()
