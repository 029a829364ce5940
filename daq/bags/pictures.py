"""Images of a bag, and what is known of the cameras: told, not followed."""

from collections.abc import Sequence
from typing import Any

from robot_drivers.protocols import IntArray

KINDS = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
INFO = "sensor_msgs/msg/CameraInfo"


def image_line(topic: str, log_time_ns: IntArray, first: Any) -> str:
    """Return what there is of images, by the first of them."""
    seconds = (log_time_ns[-1] - log_time_ns[0]) / 1e9
    rate = f", {(len(log_time_ns) - 1) / seconds:.1f} Hz" if seconds > 0 else ""
    size = (
        f"{first.width} x {first.height} {first.encoding}" if hasattr(first, "width") else str(first.format)
    )
    return f"{topic}: {len(log_time_ns)} images{rate}, {size}; points in images are not looked for"


def camera_line(topic: str, first: Any) -> str:
    """Return the intrinsics of a camera: focal lengths and centre, pixels, and its distortion."""
    fx, _, cx, _, fy, cy = _numbers(first.k if hasattr(first, "k") else first.K)[:6]
    distortion = ", ".join(
        f"{value:.5g}" for value in _numbers(first.d if hasattr(first, "d") else first.D)[:8]
    )
    model = first.distortion_model or "no model"
    return (
        f"{topic}: fx {fx:.2f}, fy {fy:.2f}, cx {cx:.2f}, cy {cy:.2f} pixels; {model} {distortion}".rstrip()
    )


def _numbers(values: Sequence[float]) -> list[float]:
    return [float(value) for value in values]
