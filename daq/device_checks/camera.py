"""Is a camera fit for a session? Its rate, its format, its exposure."""

import math

import numpy as np

from daq.device_checks.report import Check
from daq.device_checks.streams import collected, identity_check, losses_check, rate_check
from robot_drivers.cameras.depth import depth_m
from robot_drivers.protocols import Camera, Frame

_SATURATED_SHARE = 0.2
"""Of an image's pixels that may be at the end of their range before beads can no longer be trusted."""

_KNOWN_SHARE = 0.5
"""Of an image's pixels that know their depth; where they know it is not told by this."""


def check_camera(
    camera: Camera, wanted_fps: float | None, size: tuple[int, int] | None, seconds: float
) -> list[Check]:
    """Check a connected camera.

    Parameters
    ----------
    wanted_fps : of its settings; None where the camera itself tells
    size : width and height that its calibration is for, px; None without one
    seconds : how long to look at its images
    """
    frames = [frame for block in collected(camera.read, seconds) for frame in block]
    if len(frames) < 2:
        return [Check("rate", False, f"{len(frames)} images came in {seconds:g} s; check cable and trigger")]
    stated = camera.identity.details.get("fps")
    wanted = wanted_fps or (float(stated) if stated and float(stated) > 0 else None)
    return [
        identity_check(camera.identity),
        rate_check(_frame_rate_hz(frames), wanted),
        losses_check(camera.statistics()),
        _format_check(frames, size),
        _exposure_check(frames[-1]),
        *_depth_checks(frames[-1]),
    ]


def _frame_rate_hz(frames: list[Frame]) -> float:
    """Return how fast the camera exposes: by its own counter and clock, else by what arrives."""
    first, last = frames[0], frames[-1]
    exposures = len(frames) - 1
    if first.counter is not None and last.counter is not None:
        exposures = last.counter - first.counter
    if first.device_time_s is not None and last.device_time_s is not None:
        span_s = last.device_time_s - first.device_time_s
    else:
        span_s = (last.host_time_ns - first.host_time_ns) * 1e-9
    return exposures / span_s if span_s > 0 else math.nan


def _format_check(frames: list[Frame], size: tuple[int, int] | None) -> Check:
    found = {(frame.image.shape[1], frame.image.shape[0], frame.pixel_format) for frame in frames}
    told = " and ".join(f"{width}x{height} {name}" for width, height, name in sorted(found))
    fits = len(found) == 1 and (size is None or next(iter(found))[:2] == size)
    if size is not None and not fits:
        told += f", the calibration is for {size[0]}x{size[1]}"
    return Check("format", fits, told)


def _depth_checks(frame: Frame) -> list[Check]:
    """Check the depth of a frame; nothing where it has none."""
    if frame.depth is None:
        return []
    depth = depth_m(frame.depth.counts, frame.depth.scale)
    known = float(np.mean(np.isfinite(depth)))
    told = f"known in {100 * known:.0f} % of the pixels"
    if known < _KNOWN_SHARE:
        return [Check("depth", False, f"{told}: set range and exposure with its maker's program")]
    return [Check("depth", True, f"{told}, half of them within {np.nanmedian(depth):.3g} m")]


def _exposure_check(frame: Frame) -> Check:
    white = float(np.mean(frame.image == 255))
    black = float(np.mean(frame.image == 0))
    passed = max(white, black) < _SATURATED_SHARE
    told = f"{100 * white:.1f} % of the pixels white, {100 * black:.1f} % black"
    return Check("exposure", passed, told if passed else f"{told}: set shutter and gain, take off the cap")
