"""Is each device of a rig fit for a session? Who answers, and a few seconds of what it delivers while nothing moves."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from daq.devices import Devices
from daq.frames import compose, inverse
from daq.rig import Rig
from daq.vision.camera_model import PinholeCamera, StereoCalibration
from robot_drivers.ati.gamma import GAGE_NOISE_STD, RATED_WRENCH
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import (
    Camera,
    DeviceIdentity,
    FloatArray,
    ForceSensor,
    Frame,
    Robot,
    StreamStatistics,
    WrenchBlock,
)

_READ_S = 0.2
_RATE_TOLERANCE = 0.05
_NOISE_ALLOWANCE = 8.0
"""Times the noise of one count on every gage; the sensor's maker takes 80 counts for the most."""
_TELLING_SAMPLES = 20
"""More samples than these are never all alike in a sensor that works."""
_LARGEST_REST_SHARE = 0.5
"""Of the rated range that a sensor at rest may already need: for its offset and the weight of the tool."""
_SMALLEST_JOINT_MARGIN_RAD = math.radians(5.0)
_SATURATED_SHARE = 0.2
"""Of an image's pixels that may be at the end of their range before beads can no longer be trusted."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Check:
    """One property of a device; ``told`` is what was found, and where ``passed`` is not, what was expected."""

    name: str
    passed: bool
    told: str


@dataclass(frozen=True, slots=True)
class DeviceReport:
    """What the checks of one device say; ``identity`` is None where it did not answer."""

    role: str
    identity: DeviceIdentity | None
    checks: tuple[Check, ...] = field(default=())

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)


def check_devices(rig: Rig, devices: Devices, seconds: float) -> list[DeviceReport]:
    """Check every device by itself, so that one that is missing hides no other. Nothing moves.

    Parameters
    ----------
    seconds : how long to look at what each one delivers
    """
    sizes = _calibrated_sizes(rig)
    reports = [
        _report(
            "force sensor", devices.force_sensor, lambda: _check_force(devices.force_sensor, rig, seconds)
        ),
        _report("robot", devices.robot, lambda: _check_robot(devices.robot, rig, seconds)),
    ]
    for camera in rig.cameras:
        device = devices.cameras[camera.name]
        wanted_fps = getattr(camera.settings, "fps", None)
        checks = _check_camera(device, wanted_fps, sizes.get(camera.name), seconds)
        reports.append(_report(f"camera {camera.name}", device, checks))
    return reports


def _report(
    role: str, device: ForceSensor | Robot | Camera, check: Callable[[], list[Check]]
) -> DeviceReport:
    identity = None
    try:
        device.connect()
        identity = device.identity
        return DeviceReport(role, identity, (Check("reachable", True, identity.address), *check()))
    except DeviceError as error:
        name = "reachable" if identity is None else "stream"
        return DeviceReport(role, identity, (Check(name, False, str(error)),))
    finally:
        device.close()


# ---- force sensor


def _check_force(sensor: ForceSensor, rig: Rig, seconds: float) -> list[Check]:
    settings = rig.force_sensor.settings
    sensor.start()
    blocks = _collected(sensor.read, len, seconds)
    statistics = sensor.statistics()
    sensor.stop()
    if not blocks:
        return [Check("rate", False, f"no sample came in {seconds:g} s; check that the sensor streams")]
    wrench = np.concatenate([block.wrench for block in blocks])
    usable = np.concatenate([block.usable for block in blocks])
    details = sensor.identity.details
    rated = np.array(getattr(settings, "rated_wrench", RATED_WRENCH))
    return [
        _identity_check(sensor.identity),
        _rate_check(_wrench_rate_hz(blocks), getattr(settings, "rate_hz", None), "rate_hz"),
        _losses_check(statistics),
        Check("units", True, details.get("units") or details.get("counts per N and N·m", "N, N·m")),
        _usable_check(usable),
        _range_check(wrench, rated),
        _noise_check(wrench, settings),
    ]


def _wrench_rate_hz(blocks: list[WrenchBlock]) -> float:
    counter = np.concatenate([block.counter for block in blocks])
    time_s = np.concatenate([block.host_time_ns for block in blocks]) * 1e-9
    return _rate_hz(counter, time_s)


def _rate_hz(counter: np.ndarray[Any, Any], time_s: FloatArray) -> float:
    """Return how fast the device counts, lost samples included."""
    span_s = float(time_s[-1] - time_s[0])
    return float(counter[-1] - counter[0]) / span_s if span_s > 0 else math.nan


def _usable_check(usable: np.ndarray[Any, Any]) -> Check:
    share = 100.0 * float(np.mean(~usable))
    return Check(
        "saturation", share == 0.0, f"{share:.3g} % of the samples not usable (status word, gages, range)"
    )


def _range_check(wrench: FloatArray, rated: FloatArray) -> Check:
    """Judge the mean: what is used of the range at rest is not there for the measurement."""
    shares = np.abs(wrench.mean(axis=0)) / rated
    axis = int(shares.argmax())
    told = f"{_AXES[axis]} at {100 * shares[axis]:.0f} % of its ±{rated[axis]:g} {_UNITS[axis]}"
    if shares[axis] > _LARGEST_REST_SHARE:
        told += f", at most {100 * _LARGEST_REST_SHARE:.0f} % is for rest: relieve the sensor, or bias it"
    return Check("range", bool(shares[axis] <= _LARGEST_REST_SHARE), told)


def _noise_check(wrench: FloatArray, settings: object) -> Check:
    """Judge the scatter about a straight line against the sensor's, and against none at all."""
    n = len(wrench)
    ramp = np.stack([np.ones(n), np.linspace(-1.0, 1.0, n)], axis=1)
    residuals = wrench - ramp @ np.linalg.lstsq(ramp, wrench, rcond=None)[0]
    noise = residuals.std(axis=0, ddof=min(2, n - 1))
    step = _resolution(settings)
    expected = np.hypot(GAGE_NOISE_STD, step / math.sqrt(12.0))
    axis = int((noise / expected).argmax())
    told = "std " + " ".join(f"{value:.2g}" for value in noise) + " N, N·m"
    if n > _TELLING_SAMPLES and not noise.any() and not step.any():
        return Check("noise", False, f"{told}: no channel moves by a count; the sensor repeats one sample")
    limit = _NOISE_ALLOWANCE * expected[axis]
    if noise[axis] > limit:
        told += f"; {_AXES[axis]} at most {limit:.2g} expected: does something move, or a cable pick up?"
    return Check("noise", bool(noise[axis] <= limit), told)


def _resolution(settings: object) -> FloatArray:
    """Return the size of a count (6,), N and N·m, where it is coarse and the settings tell it; else 0."""
    counts = [getattr(settings, name, math.inf) for name in ("counts_per_newton", "counts_per_newton_metre")]
    return np.repeat(1.0 / np.array(counts), 3)


_AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_UNITS = ("N", "N", "N", "N·m", "N·m", "N·m")


# ---- robot


def _check_robot(robot: Robot, rig: Rig, seconds: float) -> list[Check]:
    blocks = _collected(robot.read, len, seconds)
    state = robot.state()
    told = [word for word, there in (("motors on", state.motors_on), ("moving", state.moving)) if there]
    checks = [
        _identity_check(robot.identity),
        Check("state", state.ready and not state.moving, ", ".join([*told, state.message or "ready"])),
    ]
    if not blocks:
        checks.append(Check("rate", False, f"no pose came in {seconds:g} s; check its state stream or EGM"))
    else:
        counter = np.concatenate([block.counter for block in blocks])
        time_s = np.concatenate([block.host_time_ns for block in blocks]) * 1e-9
        checks += [_rate_check(_rate_hz(counter, time_s), None, ""), _losses_check(robot.statistics())]
    limits = getattr(getattr(rig.robot.settings, "limits", None), "joint_limits", None)
    if limits is not None:
        checks.append(_joint_check(state.joints, limits))
    T_tissue_base = inverse(rig.frames.T_base_tissue.pose)
    gripper = compose(compose(T_tissue_base, state.T_base_tool), rig.frames.T_tool_gripper.pose).position
    inside = bool(rig.limits.workspace.contains(gripper))
    place = " ".join(f"{1e3 * p:.1f}" for p in gripper)
    where = "inside" if inside else "outside"
    checks.append(Check("workspace", inside, f"gripper at {place} mm of the tissue frame, {where} its box"))
    return checks


def _joint_check(joints: tuple[float, ...], limits: tuple[tuple[float, float], ...]) -> Check:
    margins = [min(q - low, high - q) for q, (low, high) in zip(joints, limits, strict=True)]
    axis = int(np.argmin(margins))
    told = f"axis {axis + 1} is {math.degrees(margins[axis]):.1f}° from its end"
    passed = margins[axis] >= _SMALLEST_JOINT_MARGIN_RAD
    if not passed:
        told += f", at least {math.degrees(_SMALLEST_JOINT_MARGIN_RAD):.0f}° expected: jog it away"
    return Check("joints", passed, told)


# ---- cameras


def _check_camera(
    camera: Camera, wanted_fps: float | None, size: tuple[int, int] | None, seconds: float
) -> Callable[[], list[Check]]:
    def check() -> list[Check]:
        frames = [frame for block in _collected(camera.read, len, seconds) for frame in block]
        if len(frames) < 2:
            return [
                Check("rate", False, f"{len(frames)} images came in {seconds:g} s; check cable and trigger")
            ]
        stated = camera.identity.details.get("fps")
        wanted = wanted_fps or (float(stated) if stated and float(stated) > 0 else None)
        return [
            _identity_check(camera.identity),
            _rate_check(_frame_rate_hz(frames), wanted, "fps"),
            _losses_check(camera.statistics()),
            _format_check(frames, size),
            _exposure_check(frames[-1]),
        ]

    return check


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


def _exposure_check(frame: Frame) -> Check:
    white = float(np.mean(frame.image == 255))
    black = float(np.mean(frame.image == 0))
    passed = max(white, black) < _SATURATED_SHARE
    told = f"{100 * white:.1f} % of the pixels white, {100 * black:.1f} % black"
    return Check("exposure", passed, told if passed else f"{told}: set shutter and gain, take off the cap")


def _calibrated_sizes(rig: Rig) -> Mapping[str, tuple[int, int]]:
    """Return the image sizes (px) that the stereo calibration is for, by camera; none without its file."""
    if not rig.stereo_calibration.exists():
        return {}
    pair = StereoCalibration.load(rig.stereo_calibration)
    cameras: tuple[PinholeCamera, PinholeCamera] = (pair.left, pair.right)
    return {
        device.name: (camera.width, camera.height)
        for device, camera in zip(rig.cameras, cameras, strict=True)
    }


# ---- any device


def _collected(read: Callable[[float], T], size: Callable[[T], int], seconds: float) -> list[T]:
    """Return what comes for so long, but for empty answers."""
    end_s = time.monotonic() + seconds
    blocks = []
    while (left_s := end_s - time.monotonic()) > 0:
        block = read(min(_READ_S, left_s))
        if size(block):
            blocks.append(block)
    return blocks


def _identity_check(identity: DeviceIdentity) -> Check:
    serial = f" {identity.serial}" if identity.serial else ""
    return Check("identity", bool(identity.model), f"{identity.model}{serial}")


def _rate_check(rate_hz: float, wanted_hz: float | None, setting: str) -> Check:
    if wanted_hz is None:
        return Check("rate", math.isfinite(rate_hz), f"{rate_hz:.1f} Hz")
    passed = abs(rate_hz - wanted_hz) <= _RATE_TOLERANCE * wanted_hz
    told = f"{rate_hz:.1f} Hz" if passed else f"{rate_hz:.1f} Hz, {setting} says {wanted_hz:g}"
    return Check("rate", passed, told)


def _losses_check(counts: StreamStatistics) -> Check:
    """Judge what never came; what came twice or late was put right."""
    told = f"{counts.lost} lost of {counts.received + counts.lost}"
    for name in ("duplicated", "late", "malformed", "restarts"):
        if number := getattr(counts, name):
            told += f", {number} {name}"
    return Check("losses", not (counts.lost or counts.malformed or counts.restarts), told)
