"""The layout of a recording: its files, topics and frames.

Topics: ``/force/wrench``, ``/robot/pose``, ``/robot/joints``, and for each camera ``/camera/<name>/image``,
``/camera/<name>/image_raw`` for images that were not compressed, and ``/camera/<name>/camera_info``; each device with
its ``…/device`` stamps beside; and ``/events``. Of a camera with depth there is the same below
``/camera/<name>/depth``, in counts whose meaning an event tells. Force, robot and events go to ``signals.mcap``, the
cameras to ``cameras.mcap``.
"""

SIGNALS_FILE = "signals.mcap"
CAMERAS_FILE = "cameras.mcap"
EVENTS = "/events"
FORCE_FRAME = "force_sensor"
ROBOT_FRAME = "robot_base"


def depth_of(camera: str) -> str:
    """Return the name under which a camera's images of depth are recorded, as those of another camera would be."""
    return f"{camera}/depth"


def camera_frame(name: str) -> str:
    """Return the frame id that a camera's messages carry."""
    return f"camera_{name}"
