"""Transforms as messages of ROS 2, by which its programs know where the frames of a recording are."""

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from daq.recording.messages.cdr import CdrLayout
from daq.recording.messages.rows import message_rows
from robot_drivers.protocols import FloatArray, IntArray

TOOL_FRAME = "tool"

_EVER = {"sec": 9223372036, "nsec": 854775807}
KEPT_FOR_LATER = json.dumps(
    [
        {
            "history": 1,
            "depth": 1,
            "reliability": 1,
            "durability": 1,
            "deadline": _EVER,
            "lifespan": _EVER,
            "liveliness": 1,
            "liveliness_lease_duration": _EVER,
            "avoid_ros_namespace_conventions": False,
        }
    ]
)
"""Quality of service of what is told once, and kept for those who listen later (transient local); JSON is YAML."""


def transform_rows(
    links: Sequence[tuple[str, str]], time_ns: IntArray, position: FloatArray, quaternion_wxyz: FloatArray
) -> NDArray[np.void]:
    """Return messages (n,) of transforms between frames.

    Parameters
    ----------
    links : parent and child of each
    time_ns : (n,) of each message
    position : (n, links, 3) of the child in the parent, m
    quaternion_wxyz : (n, links, 4)
    """
    layout = CdrLayout().length(len(links))
    for place, (parent, child) in enumerate(links):
        if place:
            layout.add(f"sec_{place}", "<i4").add(f"nanosec_{place}", "<u4").string(parent)
        else:
            layout.header(parent)
        layout.string(child).add(f"position_{place}", "<f8", 3).add(f"quaternion_xyzw_{place}", "<f8", 4)
    messages = message_rows(0, layout, time_ns)
    body = messages["message_body"]
    for place in range(len(links)):
        body[f"position_{place}"] = position[:, place]
        body[f"quaternion_xyzw_{place}"] = np.roll(quaternion_wxyz[:, place], -1, axis=1)
        if place:
            body[f"sec_{place}"], body[f"nanosec_{place}"] = body["sec"], body["nanosec"]
    return messages
